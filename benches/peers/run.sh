#!/usr/bin/env bash
# leadlag beside numba, numpy and JAX, and on an NVIDIA GPU CUDA, on the same case, candidates and machine; needs python3 with venv, and pip.
#
#   benches/peers/run.sh [ROUNDS]      default 3
#
# Everything is made in target/peers. The programs take turns, so that a change of the machine's load affects all alike; each
# must agree with leadlag's f64 scores before it is timed. The last columns say how many times faster `lanes` is.
#
#   PYTHON=python3 LEADLAG=target/release/leadlag benches/peers/run.sh
#
# takes a Python that has the packages and a program that is built. Where that Python has CuPy and an NVIDIA GPU, a kernel in CUDA and JAX
# on the GPU take part, and the last column says how many times faster `gpu` is.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
rounds=${1:-3}
work=target/peers
python=${PYTHON:-$work/venv/bin/python}
leadlag=${LEADLAG:-target/release/leadlag}

mkdir -p "$work"
if [[ -z ${PYTHON:-} ]] && ! "$python" -c 'import jax, numba, numpy' 2>/dev/null; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet numba numpy jax
fi
[[ -n ${LEADLAG:-} ]] || cargo build --release --locked
"$leadlag" bench --export "$work/case"
gpu_peers=()
if "$python" -c 'import cupy; cupy.cuda.runtime.getDeviceCount()' 2>/dev/null; then
    gpu_peers+=('cuda f32')
fi
if "$python" -c 'import jax; jax.devices("cuda")' 2>/dev/null; then
    gpu_peers+=('jax-gpu f32')
fi

log=$work/rounds.jsonl
: >"$log"
for ((round = 1; round <= rounds; round++)); do
    printf 'round %d of %d\n' "$round" "$rounds" >&2
    "$leadlag" bench --model 1 --json 2>/dev/null | "$python" -c 'import json, sys; print(json.dumps(json.load(sys.stdin)))' >>"$log"
    for population in 1024 4096; do
        for peer in 'numba f64' 'numba f32' 'numpy f64' 'numpy f32' 'jax f64' 'jax f32'; do
            # shellcheck disable=SC2086 # two words on purpose
            "$python" benches/peers/peers.py "$work/case" $peer "$population" 3 >>"$log"
        done
    done
    for population in 4096 32768 262144; do
        for peer in ${gpu_peers[@]+"${gpu_peers[@]}"}; do
            # shellcheck disable=SC2086 # two words on purpose
            "$python" benches/peers/peers.py "$work/case" $peer "$population" 3 >>"$log"
        done
    done
done

printf 'machine   %s, %s cores\n' "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1)" "$(nproc)"
printf 'date      %s\n' "$(date -u +%F)"
[[ ${#gpu_peers[@]} -eq 0 ]] || printf 'gpu       %s\n' "$(nvidia-smi --query-gpu=name,driver_version --format=csv,noheader)"
printf 'leadlag   %s%s\n' "$("$leadlag" --version | cut -d' ' -f2)" "$(rustc --version 2>/dev/null | sed 's/^/, /')"
"$python" benches/peers/table.py "$log"
