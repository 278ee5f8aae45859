"""Tables of docs/benchmark/conventions.md, from what scripts/questions made.

    questions.py WORK touching      ids of the variants whose winners touch an acceleration bound on P3
    questions.py WORK tables        the tables
"""

import csv
import statistics
import sys
from pathlib import Path

work = Path(sys.argv[1])
BASES = ["idm", "gipps", "l-cth", "l-idm", "l-gipps"]
# Variants without a constraint, by their place among the 18 of a base model.
PARTS = {1: "none", 4: "linear", 7: "nonlinear", 10: "delay", 13: "delay+linear", 16: "delay+nonlinear"}
QUESTIONS = {
    "road_load": "road loads as printed instead of SI",
    "delay": "τ_p in whole samples instead of continuous",
    "tau_a": "τ_a from 0 to 0.8 s instead of 0.3 to 0.8 s",
    "acceleration": "accelerations one sample apart instead of aligned",
    "bounds": "a touched bound rejects instead of clipping",
    "authors": "all conventions of the authors' program",
}
# A change of a score that is more than what is left of the search (coefficient of variation of most optima: below 0.001 %).
NOTABLE = 0.001


def read(path):
    """First replicates on P3 by (id, follower)."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file)
        return {(int(row["model_id"]), int(row["follower_position"])): row for row in rows
                if row["platoon"] == "P3" and row["replicate"] == "0" and row["success"] == "true"}


def number(row, column):
    return float(row[column])


def touches(row):
    return int(row["n_cut_acc"]) + int(row["n_cut_dec"]) > 0


def percent(change):
    return f"{100 * change:+.2f}"


as_it_is = read(work / "as_it_is/calibrations.csv")
if sys.argv[2] == "touching":
    print(", ".join(map(str, sorted({model for (model, _), row in as_it_is.items() if touches(row)}))))
    sys.exit()

turned = {}
for name in QUESTIONS:
    path = work / name / "merged/calibrations.csv"
    if path.exists():
        # Both sides of every comparison must be there, for all followers.
        rows = {key: row for key, row in read(path).items() if key in as_it_is}
        turned[name] = {key: row for key, row in rows.items() if all((key[0], follower) in rows for follower in range(1, 5))}

print("| turned | pairs | change of NRMSE(s,v,a), % : median | lowest | highest | lower | same | higher | of s | of v | of a |")
print("|---|---|---|---|---|---|---|---|---|---|---|")
for name, rows in turned.items():
    if not rows:
        continue

    def changes(column):
        return [number(row, column) / number(as_it_is[key], column) - 1 for key, row in rows.items()]

    change = changes("nrmse_sva")
    lower = sum(x < -NOTABLE for x in change)
    higher = sum(x > NOTABLE for x in change)
    signals = " | ".join(percent(statistics.median(changes(column))) for column in ["nrmse_s", "nrmse_v", "nrmse_a"])
    print(f"| {QUESTIONS[name]} | {len(change)} | {percent(statistics.median(change))} | {percent(min(change))} | {percent(max(change))} | "
          f"{lower} | {len(change) - lower - higher} | {higher} | {signals} |")

if turned.get("tau_a"):
    pairs = [(number(as_it_is[key], "tau_a_s"), number(row, "tau_a_s")) for key, row in turned["tau_a"].items()]
    print(f"\nτ_a: at its lower bound of 0.3 s in {sum(a < 0.3005 for a, _ in pairs)} of {len(pairs)}; where it may go to 0, below 0.3 s in "
          f"{sum(b < 0.2995 for _, b in pairs)}, at 0 in {sum(b < 0.0008 for _, b in pairs)}, median {statistics.median(b for _, b in pairs):.2f} s.")
if turned.get("delay"):
    steps = [abs(number(as_it_is[key], "tau_p_s") - number(row, "tau_p_s")) for key, row in turned["delay"].items()]
    print(f"\nτ_p moves by {statistics.median(steps):.3f} s in the median, {max(steps):.3f} s at most.")
free = {key: row for key, row in as_it_is.items() if (key[0] - 1) % 3 > 0}
print(f"\nWinners with a constraint on P3 that touch a bound: {sum(map(touches, free.values()))} of {len(free)}, "
      f"of them with the constant bounds {sum(touches(row) for key, row in free.items() if (key[0] - 1) % 3 == 1)}.")


def medians(rows):
    """Eq. 19 over the variants without a constraint that are there for all followers, then the median over followers, by id."""
    models = sorted({model for model, _ in rows if (model - 1) % 3 == 0 and all((model, f) in rows for f in range(1, 5))})
    if not models:
        return {}
    lowest = {f: min(number(rows[model, f], "score") for model in models) for f in range(1, 5)}
    return {model: statistics.median(number(rows[model, f], "score") / lowest[f] - 1 for f in range(1, 5)) for model in models}


def ranks(values):
    return [sum(y < x for y in values) + (sum(y == x for y in values) + 1) / 2 for x in values]


def spearman(a, b):
    a, b = ranks(a), ranks(b)
    return statistics.correlation(a, b) if len(a) > 2 else float("nan")


with open(Path(__file__).parent.parent / "src/study/paper/table4.csv", encoding="utf-8") as file:
    table4 = list(csv.reader(line for line in file if not line.startswith("#")))[1:]
paper = {int(row[0]): float(row[1]) for row in table4}


def order(values, base):
    first = 18 * BASES.index(base)
    here = [(value, PARTS[model - first]) for model, value in values.items() if first < model <= first + 18]
    return " < ".join(f"{name} {value:.3f}" for value, name in sorted(here)) if len(here) == 6 else None


# Within a base model, so that it does not matter which others are there.
print("\nOrder of the parts within a base model: median over P3's followers of the score over the lowest of these six, minus 1.")
print("\n| base | convention | order | rank correlation with the paper's Table 4 |\n|---|---|---|---|")
for base in BASES:
    first = 18 * BASES.index(base)
    own = {key: row for key, row in as_it_is.items() if first < key[0] <= first + 18}
    for name in [None, *turned]:
        here = {key: row for key, row in turned.get(name, {}).items() if key in own}
        # A switch of everything must have turned everything; what others cannot touch is as it was.
        needed = {None: 0, "road_load": 8, "delay": 12, "tau_a": 16, "acceleration": 24, "authors": 24}.get(name)
        if needed is None or len(here) < needed:
            continue
        values = medians({**own, **here})
        text = order(values, base)
        if text:
            rho = spearman(list(values.values()), [paper[m] for m in values])
            print(f"| {base} | {QUESTIONS[name] if name else 'paper'} | {text} | {rho:.2f} |")
before = medians(as_it_is)
print("\nRank correlation over all variants compared (without a constraint):")
print("\n| turned | variants | with the unchanged order | with the paper's Table 4 | unchanged: with the paper's Table 4 |\n|---|---|---|---|---|")
for name in turned:
    if name == "bounds" or not turned[name]:
        continue
    touched = {model for model, f in turned[name]}
    whole = name in ("authors", "acceleration")
    models = [m for m in before if (all((m, f) in turned[name] for f in range(1, 5)) if whole else True)]
    rows = {key: turned[name].get(key, row) for key, row in as_it_is.items() if key[0] in models}
    own = {key: row for key, row in as_it_is.items() if key[0] in models}
    if len(models) < 3:
        continue
    values, plain = medians(rows), medians(own)
    with_own = spearman([values[m] for m in models], [plain[m] for m in models])
    with_paper = spearman([values[m] for m in models], [paper[m] for m in models])
    plain_paper = spearman([plain[m] for m in models], [paper[m] for m in models])
    print(f"| {QUESTIONS[name]} | {len(models)} ({len(touched & set(models))} touched) | {with_own:.2f} | {with_paper:.2f} | {plain_paper:.2f} |")
