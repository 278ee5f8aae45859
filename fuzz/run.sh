#!/bin/sh
# Runs fuzz targets for SECONDS each (default 600), from the small files of tests/data as seeds; without names, all of them.
#   fuzz/run.sh [SECONDS [TARGET...]]
# An input that takes longer than 10 s or more than 1 GB is a finding, as a crash is.
# Needs cargo-fuzz (cargo install cargo-fuzz); works on the stable toolchain.
set -eu
cd "$(dirname "$0")"
seconds=${1:-600}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- detect openacc astazero_rebuilt astazero_processed ultra_av pair parquet grade labels extension columns
data=../tests/data
for target in "$@"; do
    seeds=corpus/$target
    mkdir -p "$seeds"
    case $target in
        detect) cp $data/*.csv $data/processed/made_up.csv "$seeds" ;;
        openacc) cp $data/openacc.csv $data/rebuilt.csv "$seeds" ;;
        astazero_rebuilt) cp $data/rebuilt.csv "$seeds" ;;
        astazero_processed) cp $data/processed/made_up.csv "$seeds" ;;
        grade) cp $data/grade_open.csv $data/processed/Slope.csv "$seeds" ;;
        extension) cp ../shaders/extension/*.wgsl "$seeds" ;;
        columns)
            for map in ngsim highd sumo-fcd; do
                printf '%s\0Vehicle_ID,Frame_ID\n1,2\n' "$map" > "$seeds/$map"
                { cat "../src/data/trajectory/import/columns/maps/$map.toml"; printf '\0'; } > "$seeds/$map.toml"
            done
            ;;
        parquet) cp $data/*.parquet "$seeds" ;;
        labels) cp $data/processed/Labels.csv "$seeds" ;;
        *) cp "$data/$target.csv" "$seeds" ;;
    esac
    # The first 14 lines alone are easier to mutate than 60 rows.
    for file in "$seeds"/*.csv; do
        [ -e "$file" ] || continue
        head -n 14 "$file" > "$seeds/short_$(basename "$file" .csv | sed 's/^short_//').csv"
    done
    # The extensions run on a small stack, and an address sanitizer makes every frame several times as large.
    sanitizer=address
    [ "$target" = extension ] && sanitizer=none
    RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir . --sanitizer "$sanitizer" "$target" -- -max_total_time="$seconds" -max_len=8192 \
        -timeout=10 -rss_limit_mb=1024 -print_final_stats=1
done
