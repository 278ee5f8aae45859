"""The numbers of docs/REPRODUCTION.md from what scripts/reproduction made.

    reproduction.py WORK complete     number of replicates, and ids of the variants, that every trajectory has
    reproduction.py WORK numbers VEHICLES.csv      the tables, in Markdown
"""

import csv
import json
import statistics
import sys
from collections import defaultdict
from pathlib import Path

work = Path(sys.argv[1])
BASES = ["idm", "gipps", "l-cth", "l-idm", "l-gipps"]
PARTS = ["none", "linear", "nonlinear", "delay", "delay+linear", "delay+nonlinear"]
VARIANTS = 90
# Seconds of a core for one calibration of 9,227 samples by the authors' program, measured on another, faster machine and extrapolated over
# its stopping rule (models 1 and 54).
AUTHORS_S = (31 * 60, 48 * 60)


def read(path):
    with open(work / path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


calibrations = read("all/calibrations.csv")
TRAJECTORIES = len({(row["platoon"], row["follower_position"]) for row in calibrations})
REPLICATES = 1 + max(int(row["replicate"]) for row in calibrations)
if sys.argv[2] == "complete":
    done = defaultdict(set)
    for row in calibrations:
        done[int(row["model_id"])].add((row["platoon"], row["follower_position"], row["replicate"]))
    whole = all(len(done[model]) == TRAJECTORIES * REPLICATES for model in range(1, VARIANTS + 1))
    first = {model: sum(replicate == "0" for *_, replicate in cells) for model, cells in done.items()}
    complete = sorted(model for model, count in first.items() if count == TRAJECTORIES)
    print(REPLICATES if whole else 1, ", ".join(map(str, complete)))
    sys.exit()

status = json.loads((work / "status.json").read_text())
print(f"{status['done']} of {status['tasks']} calibrations are done, {status['infeasible']} without a feasible candidate.")
evaluations = statistics.mean(int(row["evaluations"]) for row in calibrations)
# The times include lost results; the rate counts all evaluations.
each = evaluations * status["cpu_s"] / status["evaluations"]
print(f"\nCPU time {status['cpu_s']:.0f} s, wall time {status['wall_s']:.0f} s (of all runs), {status['evaluations']:.4g} evaluations: "
      f"{evaluations:.0f} evaluations and {each:.2f} CPU seconds a calibration, {1 / each:.2f} tasks per CPU second.")
print(f"The authors' program on 9,227 samples: {AUTHORS_S[0]} to {AUTHORS_S[1]} s a calibration, "
      f"{AUTHORS_S[0] / each:.0f} to {AUTHORS_S[1] / each:.0f} times as long.")
stops = defaultdict(int)
for row in calibrations:
    stops[row["stop"]] += 1
print("Stopped because: " + ", ".join(f"{stop} {count}" for stop, count in sorted(stops.items())) + ".")

print("\n## Spread of the optimum over replicates\n")
cells = defaultdict(list)
for row in calibrations:
    if row["success"] == "true":
        cells[int(row["model_id"]), row["variant"], row["base"], row["platoon"], row["follower_position"]].append(float(row["score"]))
spread = {key: statistics.stdev(x) / statistics.mean(x) for key, x in cells.items() if len(x) == REPLICATES}
print("| base | values | median CV | 95 % | worst | above 1 % |\n|---|---|---|---|---|---|")
for base in [*BASES, "all"]:
    values = sorted(cv for key, cv in spread.items() if base in (key[2], "all"))
    if values:
        print(f"| {base} | {len(values)} | {100 * statistics.median(values):.1g} % | {100 * values[int(0.95 * (len(values) - 1))]:.1g} % | "
              f"{100 * values[-1]:.3g} % | {sum(cv > 0.01 for cv in values)} |")
print("\nAbove 1 %: " + (", ".join(f"{key[0]} `{key[1]}` on {key[3]}-{key[4]} {100 * cv:.2f} %"
                                for key, cv in sorted(spread.items(), key=lambda item: -item[1]) if cv > 0.01) or "none") + ".")
above = [score / min(x) - 1 for key, x in cells.items() if key in spread for score in x]
within = [f"{sum(ratio <= limit for ratio in above) / len(above):.1%} within {limit:.1%}" for limit in (1e-3, 1e-2)]
print(f"Replicates by their distance from the lowest score of the surface: {', '.join(within)}, the farthest {max(above):.1%} above it.")

four = {int(row["model_id"]): row for row in read("complete/report/table4.csv")}
five = {int(row["model_id"]): row for row in read("complete/report/table5.csv")}
print(f"\n## Tables 4 and 5, {len(four)} variants\n")
print("Median normalised error (in brackets the paper's), variants without a constraint:\n")
print("| base | " + " | ".join(PARTS) + " |\n|---|" + "---|" * len(PARTS))
for b, base in enumerate(BASES):
    cell = lambda row: f"{float(row['median']):.3f} ({float(row['paper_median']):.3f})" if row else "–"
    print(f"| {base} | " + " | ".join(cell(four.get(18 * b + 3 * p + 1)) for p in range(len(PARTS))) + " |")
print("\nChange of NRMSE(s,v,a) against the base model in calibration / in validation, % (in brackets the paper's):\n")
print("| base | " + " | ".join(PARTS[1:]) + " |\n|---|" + "---|" * len(PARTS[1:]))
for b, base in enumerate(BASES):
    def change(row, column):
        number = lambda text: f"{float(text):+.1f}" if text else "–"
        return f"{number(row[column])} ({number(row['paper_' + column])})"

    def both(row):
        return f"{change(row, 'calibration_nrmse_sva_percent')} / {change(row, 'validation_nrmse_sva_percent')}" if row else "–"

    print(f"| {base} | " + " | ".join(both(five.get(18 * b + 3 * p + 1)) for p in range(1, len(PARTS))) + " |")
print("\nCollisions in validation, over the same variants, and other early ends:\n")
print("| base | variants | collisions | the paper's, same variants | other early ends |\n|---|---|---|---|---|")
for b, base in enumerate(BASES):
    rows = [five[model] for model in five if 18 * b < model <= 18 * (b + 1)]
    if rows:
        total = lambda column: sum(float(row[column]) for row in rows)
        ours, theirs = total("collisions"), total("paper_collisions")
        runs, paper_runs = total("validation_runs"), total("paper_validation_runs")
        print(f"| {base} | {len(rows)} | {ours:.0f} of {runs:.0f} ({100 * ours / runs:.1f} %) | {theirs:.0f} of {paper_runs:.0f} "
              f"({100 * theirs / paper_runs:.1f} %) | {total('other_early_ends'):.0f} |")

first = {(int(row["model_id"]), row["platoon"], row["follower_position"]): float(row["score"])
         for row in calibrations if row["replicate"] == "0" and row["success"] == "true"}
for offset, name in [(1, "constant"), (2, "MFC")]:
    away = sorted(abs(score / first[model - offset, *drive] - 1) for (model, *drive), score in first.items()
                  if (model - 1) % 3 == offset and (model - offset, *drive) in first)
    print(f"\nScores with the {name} constraint against those without: {len(away)} pairs, {sum(x == 0 for x in away)} equal to the last bit, "
          f"{sum(x > 0.001 for x in away)} more than 0.1 % apart, the largest difference {100 * away[-1]:.2g} %.")

print("\nBy the platoon of the calibration:\n")
runs = read("complete/merged/validations.csv")
platoons = sorted({row["platoon"] for row in runs})
print("| base | " + " | ".join(platoons) + " |\n|---|" + "---|" * len(platoons))
for base in BASES:
    hit = lambda platoon: [row["collision"] == "true" for row in runs if row["base"] == base and row["platoon"] == platoon]
    if any(row["base"] == base for row in runs):
        print(f"| {base} | " + " | ".join(f"{sum(hit(platoon))} of {len(hit(platoon))}" for platoon in platoons) + " |")

bounded = [row for row in calibrations if row["constraint"] != "none" and row["replicate"] == "0" and row["success"] == "true"]
touching = [row for row in bounded if int(row["n_cut_acc"]) + int(row["n_cut_dec"]) > 0]
print(f"\nFirst replicates with a constraint that touch a bound: {len(touching)} of {len(bounded)}; of the constant ones "
      f"{sum(row['constraint'] == 'constant' for row in touching)} of {sum(row['constraint'] == 'constant' for row in bounded)}.")

vehicles = {row["slug"]: row for row in csv.DictReader(open(sys.argv[3], encoding="utf-8"))}
heavy = [row for row in read("complete/merged/calibrations.csv") if row["dynamics"] == "nonlinear" and row["is_best"] == "true"]


def bound(row, parameter, side):
    vehicle = vehicles[row["vehicle"]]
    name, column = {"f_0": (f"f_0_{side}_N", "f_0_N"), "f_2": (f"f_2_{side}_si_N_s2_per_m2", "f_2_kg_per_m"),
                    "m_load": (f"load_{side}_kg", "m_load_kg")}[parameter]
    return parameter in row["at_bound"].split() and abs(float(row[column]) / float(vehicle[name]) - 1) < 0.01


print(f"\nWinners with nonlinear dynamics at a bound, of {len(heavy)}:\n\n| | f_0 | f_2 | m_load |\n|---|---|---|---|")
for side, name in [("lb", "lower"), ("ub", "upper")]:
    print(f"| {name} | " + " | ".join(str(sum(bound(row, parameter, side) for row in heavy)) for parameter in ["f_0", "f_2", "m_load"]) + " |")
print()
best = [row for row in read("complete/merged/calibrations.csv") if row["constraint"] == "none" and row["is_best"] == "true"]
counts = {}
for parameter in ["v_0", "d_0", "theta", "delta", "a_min", "tau_p", "tau_a"]:
    column = parameter + {"delta": "", "v_0": "_mps", "d_0": "_m", "a_min": "_mps2"}.get(parameter, "_s")
    have = [row for row in best if row[column]]
    counts[parameter] = f"{parameter} {sum(parameter in row['at_bound'].split() for row in have)} of {len(have)}"
print("Winners without a constraint at a bound of Table 3: " + ", ".join(counts.values()) + ".")

text = (work / "complete/report/report.md").read_text(encoding="utf-8")
print("\n" + text[text.index("## Where it agrees"):text.index("## The variants")].strip())
