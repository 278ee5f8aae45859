"""Twenty short drives calibrated by leadlag, SciPy's least_squares and differential_evolution, the package `geneticalgorithm` and JAX.

    fleet.py LEADLAG PAIRS.csv

PAIRS.csv is a table of make_fleet.py; its first twenty pairs are used. The model is IDM with delta = 4, NRMSE(s,v,a), the bounds of `--bounds human`.
SciPy and the genetic algorithm have an objective in numba and their own defaults. `least_squares` minimises squares, so it runs from ten random
starts on the normalised residuals, and from the best again with weights that make their sum that of the three errors. JAX simulates the populations of all pairs at a time (vmap) for
a plain differential evolution with SciPy's defaults. Compilation is not counted. Every objective must give leadlag's score for leadlag's optimum.
"""

import csv
import math
import os
import resource
import subprocess
import sys
import tempfile
import time

import numba
import numpy as np

PAIRS = 20
# The genetic algorithm's defaults take minutes for each.
GENETIC_PAIRS = 3
DT = 0.1
NAMES = ["v_0_mps", "d_0_m", "t_h_s", "a_max_mps2", "a_min_mps2"]
BOUNDS = np.array([[1.0, 70.0], [0.1, 8.0], [0.1, 5.0], [0.1, 6.0], [-6.0, -0.1]])
TOLERANCE = 1e-9
FAILED = 1e5
# A pair is done once its score is within this share of leadlag's.
CLOSE = 1e-3


@numba.njit
def residuals(s_m, v_m, v_l, c):
    """Normalised residuals of s, v and a; infinite after a collision."""
    v_0, d_0, t_h, a_max, a_min = c[0], c[1], c[2], c[3], c[4]
    brake = 2 * math.sqrt(-a_max * a_min)
    s, v = s_m[0], v_m[0]
    errors, measured = np.zeros((3, len(s_m) - 1)), np.zeros(3)
    for i in range(1, len(s_m)):
        wanted = d_0 + max(0.0, t_h * v - v * (v_l[i - 1] - v) / brake)
        a = a_max * (1 - (v / v_0) ** 4 - (wanted / s) ** 2)
        new = max(0.0, v + a * DT)
        a = (new - v) / DT
        # The measured gap gives the position of the leader.
        s += s_m[i] - s_m[i - 1] + ((v_m[i - 1] + v_m[i]) - (v + new)) / 2 * DT
        v = new
        if not s > 0.0:
            errors[:] = math.inf
            return errors
        a_m = (v_m[i] - v_m[i - 1]) / DT
        errors[0, i - 1], errors[1, i - 1], errors[2, i - 1] = s - s_m[i], v - v_m[i], a - a_m
        measured += np.array([s_m[i] ** 2, v_m[i] ** 2, a_m**2])
    for k in range(3):
        errors[k] /= math.sqrt(measured[k])
    return errors


@numba.njit
def score(s_m, v_m, v_l, c):
    errors = residuals(s_m, v_m, v_l, c)
    if not math.isfinite(errors[0, 0]):
        return FAILED
    return math.sqrt((errors[0] ** 2).sum()) + math.sqrt((errors[1] ** 2).sum()) + math.sqrt((errors[2] ** 2).sum())


def read(path, folder):
    """The first pairs, and a table of them alone."""
    pairs, small = {}, os.path.join(folder, "pairs.csv")
    with open(path, newline="") as table, open(small, "w", newline="") as out:
        reader, writer = csv.DictReader(table), None
        for row in reader:
            if len(pairs) == PAIRS and row["Trajectory_ID"] not in pairs:
                break
            if writer is None:
                writer = csv.DictWriter(out, reader.fieldnames)
                writer.writeheader()
            writer.writerow(row)
            signals = [float(row[name]) for name in ("Spatial_Gap", "Speed_FAV", "Speed_LV")]
            pairs.setdefault(row["Trajectory_ID"], []).append(signals)
    return [np.array(rows).T.copy() for rows in pairs.values()], small


def cpu():
    return sum(usage.ru_utime + usage.ru_stime for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


def timed(work):
    start, used = time.perf_counter(), cpu()
    result = work()
    return result, time.perf_counter() - start, cpu() - used


def leadlag(program, table, out):
    subprocess.run([program, "-q", "calibrate", table, "--all", "--model", "idm", "--bounds", "human", "--no-intervals", "--out", out],
                   check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(out, "parameters.csv"), newline="") as file:
        rows = list(csv.DictReader(file))
    return [(float(row["score"]), [float(row[name]) for name in NAMES], int(row["evaluations"])) for row in rows]


def squares(pair):
    from scipy.optimize import least_squares
    low, high = BOUNDS.T
    rng = np.random.default_rng(1)
    calls = 0

    def descend(start, weights):
        nonlocal calls
        weighted = lambda c: np.nan_to_num(weights[:, None] * residuals(*pair, c), posinf=1.0).ravel()
        found = least_squares(weighted, start, bounds=(low, high), x_scale=high - low)
        calls += found.nfev + len(BOUNDS) * found.njev
        return found.x

    best = min((descend(low + (high - low) * rng.random(len(BOUNDS)), np.ones(3)) for _ in range(10)), key=lambda c: score(*pair, c))
    for _ in range(5):
        norms = np.sqrt((residuals(*pair, best) ** 2).sum(1))
        if np.isfinite(norms).all():
            best = min(best, descend(best, norms**-0.5), key=lambda c: score(*pair, c))
    return score(*pair, best), calls


def scipy_s(pair):
    from scipy.optimize import differential_evolution
    found = differential_evolution(lambda c: score(*pair, c), BOUNDS, seed=1)
    return found.fun, found.nfev


def genetic(pair):
    from geneticalgorithm import geneticalgorithm
    calls = 0

    def objective(c):
        nonlocal calls
        calls += 1
        return score(*pair, c)

    np.random.seed(1)
    algorithm = geneticalgorithm(function=objective, dimension=len(BOUNDS), variable_type="real", variable_boundaries=BOUNDS,
                                 progress_bar=False, convergence_curve=False)
    stdout, sys.stdout = sys.stdout, open(os.devnull, "w")
    try:
        algorithm.run()
    finally:
        sys.stdout = stdout
    return algorithm.output_dict["function"], calls


def jax_s(pairs, wanted):
    """Differential evolution (best1bin, 75 members) of all pairs at a time, until all are close or 1000 generations have passed."""
    import jax
    import jax.numpy as jnp
    jax.config.update("jax_enable_x64", True)
    longest = max(pair.shape[1] for pair in pairs)
    data = jnp.array(np.stack([np.pad(pair, ((0, 0), (0, longest - pair.shape[1])), mode="edge") for pair in pairs]))
    counts = jnp.array([pair.shape[1] for pair in pairs])
    low, high = jnp.array(BOUNDS[:, 0]), jnp.array(BOUNDS[:, 1])

    def one(pair, count, c):
        s_m, v_m, v_l = pair
        v_0, d_0, t_h, a_max, a_min = c
        brake = 2 * jnp.sqrt(-a_max * a_min)

        def step(state, i):
            s, v, sums, alive = state
            target = d_0 + jnp.maximum(0.0, t_h * v - v * (v_l[i - 1] - v) / brake)
            new = jnp.maximum(0.0, v + a_max * (1 - (v / v_0) ** 4 - (target / s) ** 2) * DT)
            a, a_m = (new - v) / DT, (v_m[i] - v_m[i - 1]) / DT
            s = s + s_m[i] - s_m[i - 1] + ((v_m[i - 1] + v_m[i]) - (v + new)) / 2 * DT
            counted = i < count
            alive = alive & ((s > 0) | ~counted)
            terms = jnp.array([(s - s_m[i]) ** 2, (new - v_m[i]) ** 2, (a - a_m) ** 2, s_m[i] ** 2, v_m[i] ** 2, a_m**2])
            return (jnp.where(s > 0, s, 1.0), new, sums + jnp.where(counted, terms, 0.0), alive), None

        (_, _, sums, alive), _ = jax.lax.scan(step, (s_m[0], v_m[0], jnp.zeros(6), True), jnp.arange(1, longest))
        return jnp.where(alive, jnp.sqrt(sums[:3] / sums[3:]).sum(), FAILED)

    population = jax.vmap(jax.vmap(one, (None, None, 0)), (0, 0, 0))

    @jax.jit
    def generation(key, members, values):
        keys = jax.random.split(key, 5)
        shape = values.shape
        best = jnp.take_along_axis(members, values.argmin(1)[:, None, None], 1)
        pick = [jnp.take_along_axis(members, jax.random.randint(k, shape, 0, shape[1])[..., None], 1) for k in keys[:2]]
        mutant = best + jax.random.uniform(keys[2], (shape[0], 1, 1), minval=0.5, maxval=1.0) * (pick[0] - pick[1])
        trial = jnp.where(jax.random.uniform(keys[3], members.shape) < 0.7, mutant, members)
        inside = (trial >= low) & (trial <= high)
        trial = jnp.where(inside, trial, low + jax.random.uniform(keys[4], members.shape) * (high - low))
        tried = population(data, counts, trial)
        better = tried < values
        return jnp.where(better[..., None], trial, members), jnp.where(better, tried, values)

    def run(generations):
        key = jax.random.PRNGKey(1)
        members = low + jax.random.uniform(key, (len(pairs), 75, len(BOUNDS))) * (high - low)
        values = population(data, counts, members)
        done = 0
        while done < generations and not bool((values.min(1) <= wanted * (1 + CLOSE)).all()):
            key, own = jax.random.split(key)
            members, values = generation(own, members, values)
            done += 1
        return np.array(values.min(1)), 75 * (done + 1)

    run(2)
    return timed(lambda: run(1000))


def main():
    program, path = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        pairs, table = read(path, folder)
        score(*pairs[0], BOUNDS.mean(1))
        found, wall, used = timed(lambda: leadlag(program, table, os.path.join(folder, "fleet")))
    wanted = np.array([one[0] for one in found])
    for pair, (best, candidate, _) in zip(pairs, found):
        assert abs(score(*pair, np.array(candidate)) / best - 1) < TOLERANCE, "the objective is another one"
    close = lambda scores: int((np.array(scores) <= wanted * (1 + CLOSE)).sum())
    print(f"{'':24} {'wall s':>8} {'CPU s':>8} {'simulations':>12} {'per pair':>9} {'within 0.1 %':>13}")
    row = lambda name, wall, used, calls, near, of=PAIRS: print(
        f"{name:24} {wall:8.2f} {used:8.2f} {calls:12} {calls / of:9.0f} {near:10} of {of}", flush=True)
    row("leadlag --all", wall, used, sum(one[2] for one in found), PAIRS)
    for name, method, some in (("least_squares, numba", squares, pairs), ("SciPy, numba", scipy_s, pairs),
                               ("geneticalgorithm, numba", genetic, pairs[:GENETIC_PAIRS])):
        results, wall, used = timed(lambda: [method(pair) for pair in some])
        near = close([value for value, _ in results] + [math.inf] * (PAIRS - len(some)))
        row(name, wall, used, sum(calls for _, calls in results), near, len(some))
    (values, each), wall, used = jax_s(pairs, wanted)
    row("JAX, vmap over pairs", wall, used, each * PAIRS, close(values))


main()
