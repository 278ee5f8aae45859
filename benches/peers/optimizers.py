"""Other optimisers on the two tasks of leadlag's `auto` and `cmaes`.

    optimizers.py restarts                 evaluations of pycma's BIPOP-CMA-ES on Rastrigin's function (tests/model/optimize.rs holds leadlag's to it)
    optimizers.py polish LEADLAG DATA      evaluations from close to an optimum to its last digits, by three methods

The authors of CMA-ES maintain pycma. A polish begins where f32 can no longer distinguish candidates, 1e-5 above the optimum of a calibration
(variants 1 and 28, P3 follower 1, authors' convention, f64 objective in numba), and is done within 1e-9 of it.
"""

import sys
import warnings

import numpy as np

warnings.simplefilter("ignore")
import cma  # noqa: E402  (it warns that matplotlib is missing)

SEEDS = 25
STARTS = 20
MOST = 20_000


def restarts(n, budget):
    """Expected running time to 1e-8: all evaluations of all runs by the number of runs that come so far."""
    spent, hits = [], []
    for seed in range(SEEDS):
        used, hit = 0, None

        def rastrigin(x):
            nonlocal used, hit
            used += 1
            z = np.asarray(x) - 0.7
            y = float(np.sum(z * z - 10 * np.cos(2 * np.pi * z) + 10))
            if y < 1e-8 and hit is None:
                hit = used
            return y

        rng = np.random.default_rng(seed)
        settings = {"bounds": [-5.12, 5.12], "maxfevals": budget, "verbose": -9, "seed": seed + 1, "ftarget": 1e-9}
        cma.fmin(rastrigin, lambda: rng.uniform(-5.12, 5.12, n), 0.2 * 10.24, settings, restarts=20, bipop=True)
        spent.append(hit or used)
        hits += [hit] if hit else []
    print(f"pycma {cma.__version__}, BIPOP, Rastrigin in {n} dimensions: {len(hits)} of {SEEDS} runs reach 1e-8 within {budget:,} evaluations,"
          f" {sum(spent) / max(len(hits), 1):,.0f} evaluations each")


class Done(Exception):
    """The target is reached, or the budget is exhausted."""


def polish(program, data):
    from scipy.optimize import minimize

    import calibration

    drive = calibration.read(data)
    for model, names in calibration.MODELS.items():
        low, high = (np.array([row[k] for row in names], dtype=float) for k in (1, 2))
        of_unit = lambda u: calibration.score(*drive, low + np.clip(u, 0, 1) * (high - low), model == 28)
        found = calibration.leadlag(program, data, model, 0)
        optimum = (np.array([found["parameters"][name] for name, _, _ in names]) - low) / (high - low)
        best, dimensions = of_unit(optimum), len(names)

        def nelder_mead(f, u, size):
            for _ in range(10):
                corners = [u + 2 * size * np.eye(dimensions)[i] * (1 if u[i] < 0.5 else -1) for i in range(dimensions)]
                settings = {"initial_simplex": np.clip([u, *corners], 0, 1), "xatol": 1e-14, "fatol": 1e-15, "maxfev": MOST, "adaptive": True}
                u = minimize(f, u, method="Nelder-Mead", bounds=[(0, 1)] * dimensions, options=settings).x

        def quasi_newton(f, u, size):
            for _ in range(10):
                settings = {"eps": 1e-7, "ftol": 1e-16, "gtol": 1e-12, "maxfun": MOST}
                u = minimize(f, u, method="L-BFGS-B", bounds=[(0, 1)] * dimensions, options=settings).x

        def cma_es(f, u, size):
            settings = {"bounds": [0, 1], "verbose": -9, "seed": 1, "tolfun": 1e-15, "tolx": 1e-14, "maxfevals": MOST}
            cma.fmin(f, u, 2 * size, settings)

        for name, method in (("Nelder-Mead", nelder_mead), ("L-BFGS-B", quasi_newton), ("CMA-ES", cma_es)):
            rng, reached = np.random.default_rng(3), []
            for _ in range(STARTS):
                direction, size, used = rng.normal(size=dimensions), 0.3, 0
                start = lambda: np.clip(optimum + size * direction / np.linalg.norm(direction), 0, 1)
                while of_unit(start()) >= best * (1 + 1e-5):
                    size *= 0.7

                def objective(u):
                    nonlocal used
                    used += 1
                    y = of_unit(np.asarray(u, dtype=float))
                    if y < best * (1 + 1e-9):
                        reached.append(used)
                        raise Done
                    if used > MOST:
                        raise Done
                    return y

                try:
                    method(objective, start(), size)
                except Done:
                    pass
            print(f"variant {model:>2}, {name:<12} {len(reached):>2} of {STARTS} starts come within 1e-9, median {np.median(reached):,.0f} evaluations,"
                  f" most {max(reached):,}", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "polish":
        polish(*sys.argv[2:4])
    else:
        restarts(5, 100_000)
