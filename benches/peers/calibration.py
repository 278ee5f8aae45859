"""One calibration by leadlag and by the PyPI package `geneticalgorithm` with an objective in numba, in turns on the same machine.

    calibration.py LEADLAG DATA MODEL ITERATIONS ROUNDS

The case is P3 follower 1 (Tesla), the authors' convention, NRMSE(s,v,a). The genetic algorithm has the settings of the paper; the
paper lets it run for up to 10,000 iterations, ITERATIONS says how many here. The objective is what one would write in Python:
the equations of the authors' program, one candidate at a time, compiled by numba before it is timed. It must give leadlag's score
for leadlag's optimum.
"""

import csv
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numba
import numpy as np

FILE = "ASta_040719_platoon7.csv"
# Same equations in another order, in f64, through 9,226 steps.
TOLERANCE = 1e-9
# Names and bounds (Table 3) in the order of the objective's candidate.
MODELS = {
    1: [("delta", 0.1, 10), ("v_0", 30, 35), ("d_0", 1, 5), ("t_h", 0.1, 3), ("a_max", 0.5, 5), ("a_min", -5, -0.5)],
    28: [("theta", 0, 3), ("v_0", 30, 35), ("d_0", 1, 5), ("t_h", 0.1, 3), ("a_max", 0.5, 5), ("a_min", -5, -0.5),
         ("a_hat_min", -5, -0.5), ("tau_p", 0.1, 0.8)],
}
LEADLAG_EVALUATIONS = {1: 24_000, 28: 60_000}
# Score of a failed candidate in the authors' program.
FAILED = 100_000.0


@numba.njit
def score(x_l, v_l, x_f, v_f, a_f, length, dt, c, gipps):
    """NRMSE(s,v,a) of one candidate."""
    n = len(x_l)
    delay = int(math.floor(c[7] / dt)) if gipps else 0
    x, v = np.empty(n), np.empty(n)
    x[: delay + 1], v[: delay + 1] = x_f[: delay + 1], v_f[: delay + 1]
    e_s, e_v, e_a, o_s, o_v, o_a = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if gipps:
        theta, v_0, d_0, t_h, a_max, a_min, a_hat_min = c[0], c[1], c[2], c[3], c[4], c[5], c[6]
        h = t_h / 2 + theta
        for i in range(delay + 1):
            gap = x_l[i] - x[i] - length - d_0
            if a_min * a_min * h * h - a_min * (2 * gap - v[i] * t_h - v_l[i] ** 2 / a_hat_min) < 0:
                x[i] = x_l[i] - length - d_0 - (a_min * h * h + v[i] * t_h + v_l[i] ** 2 / a_hat_min) / 2
    else:
        delta, v_0, d_0, t_h, a_max, a_min = c[0], c[1], c[2], c[3], c[4], c[5]
        brake = 2 * math.sqrt(-a_max * a_min)
    for i in range(delay + 1):
        if x_l[i] - x[i] - length <= 0:
            return FAILED
    for i in range(delay + 1, n):
        j, p = i - delay - 1, i - 1
        s = x_l[j] - x[j] - length
        if gipps:
            q = a_min * a_min * h * h - a_min * (2 * (s - d_0) - v[j] * t_h - v_l[j] ** 2 / a_hat_min)
            if q < -1e-10:
                return FAILED
            free = v[j] + 2.5 * a_max * t_h * (1 - v[j] / v_0) * math.sqrt(0.025 + v[j] / v_0)
            a = (min(free, a_min * h + math.sqrt(max(0.0, q))) - v[p]) / t_h
        else:
            s_des = d_0 + max(0.0, t_h * v[j] + v[j] * (v[j] - v_l[j]) / brake)
            a = a_max * (1 - (v[j] / v_0) ** delta - (s_des / s) ** 2)
        v[i] = max(0.0, v[p] + a * dt)
        x[i] = x[p] + (v[p] + v[i]) / 2 * dt
        s = x_l[i] - x[i] - length
        if s <= 0:
            return FAILED
        s_o = x_l[i] - x_f[i] - length
        v_o = v_f[i] if abs(v_f[i]) > 0.001 else 0.001
        e_s, o_s = e_s + (s - s_o) ** 2, o_s + s_o * s_o
        e_v, o_v = e_v + (v[i] - v_f[i]) ** 2, o_v + v_o * v_o
        e_a, o_a = e_a + ((v[i] - v[p]) / dt - a_f[i]) ** 2, o_a + a_f[i] * a_f[i]
    return math.sqrt(e_s / o_s) + math.sqrt(e_v / o_v) + math.sqrt(e_a / o_a)


def read(data):
    folder = os.path.join(data, "astazero_c2art")
    with open(os.path.join(folder, FILE), encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    column = lambda name: np.array([float(row[name]) for row in rows])
    with open(os.path.join(folder, "Labels.csv"), encoding="utf-8-sig") as file:
        labels = {row["File"]: row for row in csv.DictReader(file)}
    length = float(labels[FILE.removesuffix(".csv")]["length1"])
    dt = float(rows[1]["Time"]) - float(rows[0]["Time"])
    a = np.append(np.diff(column("SpeedDoppler2")) / 0.1, 0.0)
    return column("X1"), column("SpeedDoppler1"), column("X2"), column("SpeedDoppler2"), a, length, dt


def cpu(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def timed(who, work):
    start, used = time.perf_counter(), cpu(who)
    result = work()
    return result, time.perf_counter() - start, cpu(who) - used


def leadlag(program, data, model, seed):
    with tempfile.TemporaryDirectory() as out:
        command = [program, "calibrate", os.path.join(data, "astazero_c2art", FILE), "--follower", "1", "--model", str(model),
                   "--convention", "authors", "--max-evaluations", str(LEADLAG_EVALUATIONS[model]), "--seed", str(seed),
                   "--no-intervals", "--evaluator", "lanes", "--out", out]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
            return json.load(file)


def genetic(objective, model, iterations, seed):
    from geneticalgorithm import geneticalgorithm

    np.random.seed(seed)
    bounds = np.array([[low, high] for _, low, high in MODELS[model]], dtype=float)
    settings = {"max_num_iteration": iterations, "population_size": 100, "mutation_probability": 0.1, "elit_ratio": 0.01,
                "crossover_probability": 0.5, "parents_portion": 0.3, "crossover_type": "uniform",
                "max_iteration_without_improv": 8000}
    search = geneticalgorithm(function=objective, dimension=len(bounds), variable_type="real", variable_boundaries=bounds,
                              algorithm_parameters=settings, convergence_curve=False, progress_bar=False)
    stdout, sys.stdout = sys.stdout, open(os.devnull, "w", encoding="utf-8")
    try:
        search.run()
    finally:
        sys.stdout = stdout
    return search.output_dict["function"]


def main():
    program, data, model, iterations, rounds = sys.argv[1], sys.argv[2], *map(int, sys.argv[3:6])
    drive = read(data)
    count = 0

    def objective(c):
        nonlocal count
        count += 1
        return score(*drive, c, model == 28)

    found = leadlag(program, data, model, 0)
    optimum = np.array([found["parameters"][name] for name, _, _ in MODELS[model]])
    own, theirs = found["score"]["nrmse_sva"], objective(optimum)
    if not abs(theirs / own - 1) < TOLERANCE:
        sys.exit(f"model {model}: the objective gives {theirs!r} where leadlag gives {own!r}")
    rows = {"leadlag": [], "geneticalgorithm": []}
    for seed in range(1, rounds + 1):
        result, wall, used = timed(resource.RUSAGE_CHILDREN, lambda: leadlag(program, data, model, seed))
        rows["leadlag"].append((result["score"]["nrmse_sva"], result["evaluations"], wall, used))
        count = 0
        best, wall, used = timed(resource.RUSAGE_SELF, lambda: genetic(objective, model, iterations, seed))
        rows["geneticalgorithm"].append((best, count, wall, used))
        for name, results in rows.items():
            print(json.dumps(dict(zip(["program", "model", "seed", "optimum", "evaluations", "wall_s", "cpu_s"],
                                      [name, model, seed, *results[-1]]))), file=sys.stderr)
    print(f"{'program':<18}{'model':>6}{'optimum: best':>15}{'worst':>10}{'evaluations':>13}{'wall s':>9}{'CPU s':>9}{'us/eval.':>10}")
    middle = {}
    for name, results in rows.items():
        optima, evaluations, wall, used = zip(*results)
        middle[name] = [statistics.median(x) for x in (evaluations, wall, used)]
        each = 1e6 * sum(used) / sum(evaluations)
        print(f"{name:<18}{model:>6}{min(optima):>15.6f}{max(optima):>10.6f}{middle[name][0]:>13.0f}{middle[name][1]:>9.2f}{middle[name][2]:>9.2f}{each:>10.1f}")
    ratio = [theirs / own for theirs, own in zip(middle["geneticalgorithm"], middle["leadlag"])]
    print(f"geneticalgorithm / leadlag: {ratio[0]:.2f} x the evaluations, {ratio[1]:.1f} x the wall time, {ratio[2]:.1f} x the CPU time")
    full = 100 + 70 * 10_000
    print(f"with the paper's 10,000 iterations ({full:,} evaluations), extrapolated: {ratio[2] * full / middle['geneticalgorithm'][0]:.0f} x the CPU time")


if __name__ == "__main__":
    main()
