#!/usr/bin/env bash
# One calibration by leadlag beside the PyPI package geneticalgorithm with a numba objective; needs python3 with venv, pip and the
# shared data (LEADLAG_SHARED).
#
#   benches/peers/calibration.sh [ITERATIONS] [ROUNDS]      default 1000 3; the paper lets the package run for 10,000
#
# Everything is made in target/peers. The programs take turns, so that a change of the machine's load affects both alike.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=target/peers
python=$work/venv/bin/python
program=${LEADLAG:-target/release/leadlag}
data=${LEADLAG_SHARED:-../shared}/data

mkdir -p "$work"
if ! "$python" -c 'import geneticalgorithm, numba' 2>/dev/null; then
    python3 -m venv "$work/venv"
    # matplotlib: the package needs it without declaring it.
    "$work/venv/bin/pip" install --quiet numba numpy geneticalgorithm matplotlib
fi
[ -n "${LEADLAG:-}" ] || cargo build --release --locked
printf 'machine   %s, %s cores\n' "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1)" "$(nproc)"
printf 'date      %s; load average %s\n' "$(date -u +%F)" "$(cut -d' ' -f1-3 /proc/loadavg)"
printf 'leadlag   %s\n\n' "$("$program" --version | cut -d' ' -f2)"
for model in 1 28; do
    "$python" benches/peers/calibration.py "$program" "$data" "$model" "${1:-1000}" "${2:-3}"
done
