#!/usr/bin/env bash
# Other optimisers on tasks of leadlag's; needs python3 with venv, pip and the shared data (LEADLAG_SHARED).
#
#   benches/peers/optimizers.sh
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=target/peers
python=$work/venv/bin/python
program=${LEADLAG:-target/release/leadlag}
data=${LEADLAG_SHARED:-../shared}/data

mkdir -p "$work"
if ! "$python" -c 'import cma, numba, scipy' 2>/dev/null; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet cma numba numpy scipy
fi
[ -n "${LEADLAG:-}" ] || cargo build --release --locked
"$python" benches/peers/optimizers.py restarts
"$python" benches/peers/optimizers.py polish "$program" "$data"
