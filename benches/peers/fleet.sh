#!/usr/bin/env bash
# Twenty short drives by leadlag beside SciPy, the package geneticalgorithm and JAX; needs python3 with venv, pip, and the shared tools
# (LEADLAG_SHARED).
#
#   benches/peers/fleet.sh
#
# Everything is made in target/peers.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=target/peers
python=$work/venv/bin/python
program=${LEADLAG:-target/release/leadlag}

mkdir -p "$work"
if ! "$python" -c 'import geneticalgorithm, jax, numba, scipy' 2>/dev/null; then
    python3 -m venv "$work/venv"
    # matplotlib: the package needs it without declaring it.
    "$work/venv/bin/pip" install --quiet numba numpy scipy jax geneticalgorithm matplotlib
fi
[ -n "${LEADLAG:-}" ] || cargo build --release --locked
[ -e "$work/fleet/pairs.csv" ] || python3 "${LEADLAG_SHARED:-../shared}/tools/make_fleet.py" "$work/fleet" --pairs 25
printf 'machine   %s, %s cores\n' "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1)" "$(nproc)"
printf 'date      %s; load average %s\n' "$(date -u +%F)" "$(cut -d' ' -f1-3 /proc/loadavg)"
printf 'leadlag   %s\n\n' "$("$program" --version | cut -d' ' -f2)"
"$python" benches/peers/fleet.py "$program" "$work/fleet/pairs.csv"
