"""IDM on the case of `leadlag bench --export`, in numba, numpy, JAX and CUDA: the equations of shaders/, spacing as state, Eq. 1.

run.sh starts it; it prints one JSON line per measurement. Every program gets the same drive and candidates, warms up once
(compiling is not timed), and must agree with leadlag's f64 scores before it is timed.
"""

import csv
import json
import os
import resource
import sys
import time

import numpy as np

DT = 0.1
# Largest relative difference to leadlag's f64 score. f32 carries 24 bits through 9,226 steps (measured: 8e-6).
TOLERANCE = {"f64": 1e-9, "f32": 1e-4}


def read(folder):
    with open(os.path.join(folder, "drive.csv")) as file:
        drive = np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])
    with open(os.path.join(folder, "candidates.csv")) as file:
        rows = list(csv.reader(file))[1:]
    candidates = np.array([[float(x) for x in row[:6]] for row in rows])
    scores = np.array([float(row[6]) if row[6] else np.nan for row in rows])
    return drive, candidates, scores


def finish(square, drive):
    """NRMSE(s,v,a) from the sums of squares, in f64."""
    measured = drive[1:, 2:5].astype(np.float64)
    rms = np.sqrt((measured**2).mean(axis=0))
    mean = np.asarray(square, dtype=np.float64) / len(measured)
    return (np.sqrt(mean) / rms[:, None]).sum(axis=0)


def numpy_idm(drive, candidates, dtype):
    """All candidates at once, step by step, in one thread."""
    v_l, dx_l, s_m, v_m, a_m = (column.astype(dtype) for column in drive.T)
    delta, v_0, d_0, t_h, a_max, a_min = (column.astype(dtype) for column in candidates.T)
    per_v_0, brake, dt = 1 / v_0, 1 / (2 * np.sqrt(-a_max * a_min)), dtype(DT)

    def run():
        s = np.full(len(candidates), s_m[0])
        v = np.full(len(candidates), v_m[0])
        square = np.zeros((3, len(candidates)), dtype)
        for t in range(1, len(v_l)):
            s_des = d_0 + np.maximum(t_h * v - v * (v_l[t - 1] - v) * brake, 0)
            a = a_max * (1 - (v * per_v_0) ** delta - (s_des / s) ** 2)
            v_next = np.maximum(v + a * dt, 0)
            s = s + (dx_l[t] - (v + v_next) * (dt / 2))
            square[0] += (s - s_m[t]) ** 2
            square[1] += (v_next - v_m[t]) ** 2
            square[2] += ((v_next - v) / dt - a_m[t]) ** 2
            v = v_next
        return square

    return run


def numba_idm(drive, candidates, dtype):
    """One candidate per iteration of a parallel loop, compiled by LLVM; what most users of Python would write."""
    import numba

    v_l, dx_l, s_m, v_m, a_m = (np.ascontiguousarray(column.astype(dtype)) for column in drive.T)
    c = candidates.astype(dtype)
    dt, one, two, zero = dtype(DT), dtype(1), dtype(2), dtype(0)

    @numba.njit(parallel=True, fastmath=False)
    def kernel(v_l, dx_l, s_m, v_m, a_m, c, square):
        for i in numba.prange(c.shape[0]):
            delta, v_0, d_0, t_h, a_max, a_min = c[i, 0], c[i, 1], c[i, 2], c[i, 3], c[i, 4], c[i, 5]
            per_v_0, brake, per_dt = one / v_0, one / (two * np.sqrt(-a_max * a_min)), one / dt
            s, v = s_m[0], v_m[0]
            e_s, e_v, e_a = zero, zero, zero
            for t in range(1, v_l.shape[0]):
                s_des = d_0 + max(t_h * v - v * (v_l[t - 1] - v) * brake, zero)
                closeness = s_des / s
                a = a_max * (one - (v * per_v_0) ** delta - closeness * closeness)
                v_next = max(v + a * dt, zero)
                s = s + (dx_l[t] - (v + v_next) * (dt / two))
                r_s, r_v, r_a = s - s_m[t], v_next - v_m[t], (v_next - v) * per_dt - a_m[t]
                e_s, e_v, e_a = e_s + r_s * r_s, e_v + r_v * r_v, e_a + r_a * r_a
                v = v_next
            square[0, i], square[1, i], square[2, i] = e_s, e_v, e_a

    square = np.zeros((3, len(c)), dtype)

    def run():
        kernel(v_l, dx_l, s_m, v_m, a_m, c, square)
        return square

    return run


def jax_idm(drive, candidates, dtype, platform="cpu"):
    """vmap over candidates of a scan over time, compiled by XLA."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_platforms", platform)
    jax.config.update("jax_enable_x64", dtype == np.float64)
    v_l, dx_l, s_m, v_m, a_m = (column.astype(dtype) for column in drive.T)
    steps = [jnp.asarray(x) for x in (v_l[:-1], dx_l[1:], s_m[1:], v_m[1:], a_m[1:])]
    c = jnp.asarray(candidates.astype(dtype))
    dt, s_0, v_0_ = dtype(DT), dtype(s_m[0]), dtype(v_m[0])

    def one(c):
        delta, v_0, d_0, t_h, a_max, a_min = c
        per_v_0, brake = 1 / v_0, 1 / (2 * jnp.sqrt(-a_max * a_min))

        def step(state, here):
            s, v, e_s, e_v, e_a = state
            v_l, dx_l, s_m, v_m, a_m = here
            s_des = d_0 + jnp.maximum(t_h * v - v * (v_l - v) * brake, 0)
            a = a_max * (1 - (v * per_v_0) ** delta - (s_des / s) ** 2)
            v_next = jnp.maximum(v + a * dt, 0)
            s = s + (dx_l - (v + v_next) * (dt / 2))
            e_s, e_v = e_s + (s - s_m) ** 2, e_v + (v_next - v_m) ** 2
            return (s, v_next, e_s, e_v, e_a + ((v_next - v) / dt - a_m) ** 2), None

        zero = dtype(0)
        (_, _, e_s, e_v, e_a), _ = jax.lax.scan(step, (s_0, v_0_, zero, zero, zero), tuple(steps))
        return jnp.stack([e_s, e_v, e_a])

    compiled = jax.jit(jax.vmap(one, out_axes=1))
    return lambda: np.asarray(compiled(c).block_until_ready())


CUDA = """
extern "C" __global__ void idm(const REAL* v_l, const REAL* dx_l, const REAL* s_m, const REAL* v_m, const REAL* a_m, int steps,
                               const REAL* c, int n, REAL dt, REAL* square) {
    int i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i >= n) return;
    const REAL one = 1, two = 2, zero = 0;
    REAL delta = c[i], v_0 = c[n + i], d_0 = c[2 * n + i], t_h = c[3 * n + i], a_max = c[4 * n + i], a_min = c[5 * n + i];
    REAL per_v_0 = one / v_0, brake = one / (two * sqrt(-a_max * a_min)), per_dt = one / dt, half_dt = dt / two;
    REAL s = s_m[0], v = v_m[0], e_s = 0, e_v = 0, e_a = 0;
    for (int t = 1; t < steps; t++) {
        REAL s_des = d_0 + max(t_h * v - v * (v_l[t - 1] - v) * brake, zero);
        REAL closeness = s_des / s;
        REAL a = a_max * (one - pow(v * per_v_0, delta) - closeness * closeness);
        REAL v_next = max(v + a * dt, zero);
        s = s + (dx_l[t] - (v + v_next) * half_dt);
        REAL r_s = s - s_m[t], r_v = v_next - v_m[t], r_a = (v_next - v) * per_dt - a_m[t];
        e_s += r_s * r_s;
        e_v += r_v * r_v;
        e_a += r_a * r_a;
        v = v_next;
    }
    square[i] = e_s;
    square[n + i] = e_v;
    square[2 * n + i] = e_a;
}
"""


def cuda_idm(drive, candidates, dtype):
    """One thread per candidate, written in CUDA C for this model only: the ceiling on an NVIDIA GPU. Candidates go there and sums come back."""
    import cupy

    kernel = cupy.RawKernel("#define REAL " + {np.float32: "float", np.float64: "double"}[dtype] + CUDA, "idm")
    columns = [cupy.asarray(np.ascontiguousarray(column.astype(dtype))) for column in drive.T]
    c = np.ascontiguousarray(candidates.astype(dtype).T)
    n, block = len(candidates), 64

    def run():
        square = cupy.empty((3, n), dtype)
        kernel(((n + block - 1) // block,), (block,),
               (*columns, np.int32(len(drive)), cupy.asarray(c), np.int32(n), dtype(DT), square))
        return cupy.asnumpy(square)

    return run


PEERS = {"numpy": numpy_idm, "numba": numba_idm, "jax": jax_idm, "cuda": cuda_idm,
         "jax-gpu": lambda *case: jax_idm(*case, platform="cuda")}
PACKAGES = {"cuda": "cupy", "jax-gpu": "jax"}
ON_GPU = ("cuda", "jax-gpu")
# An idle GPU is slow at first; `leadlag bench` warms it up for as long [s].
AWAKE = 0.3


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main():
    folder, name, width, count, repetitions = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5])
    drive, candidates, expected = read(folder)
    # More than there are: the same again.
    which = np.arange(count) % len(candidates)
    candidates, expected = candidates[which], expected[which]
    dtype = {"f32": np.float32, "f64": np.float64}[width]
    with np.errstate(all="ignore"):
        run = PEERS[name](drive, candidates, dtype)
        scores = finish(run(), drive)
    complete = np.isfinite(expected)
    worst = float(np.max(np.abs(scores[complete] / expected[complete] - 1)))
    if not worst < TOLERANCE[width]:
        sys.exit(f"{name} {width}: scores differ by {worst:.1e} from leadlag's, more than {TOLERANCE[width]:.0e}")
    awake = time.perf_counter() + (AWAKE if name in ON_GPU else 0)
    while time.perf_counter() < awake:
        run()
    wall, cpu = [], []
    for _ in range(repetitions):
        start, used = time.perf_counter(), cpu_seconds()
        with np.errstate(all="ignore"):
            run()
        cpu.append(cpu_seconds() - used)
        wall.append(time.perf_counter() - start)
    package = PACKAGES.get(name, name)
    version = f"{package} {__import__(package).__version__}"
    print(json.dumps({"peer": name, "version": version, "on_gpu": name in ON_GPU, "precision": width, "population": count, "steps": len(drive),
                      "wall_s": wall, "cpu_s": cpu, "worst_difference": worst}))


if __name__ == "__main__":
    main()
