"""What `auto` finds on the processed AstaZero followers, beside the lowest scores known.

    python3 benches/optima.py PROGRAM FOLDER [MODELS [SEEDS]]

PROGRAM is the leadlag binary, FOLDER holds the three processed platoons (astazero_c2art), MODELS are ids of variants or other models and SEEDS
seeds, with commas. The lowest known scores of a variant are those of benches/spread.jsonl: ten replicates of L-SHADE and CMA-ES per surface,
authors' convention, NRMSE(s,v,a). That of another model is found here: the
lowest of all seeds and of one run of each, with OTHERS simulations.
"""

import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

OTHERS = 120_000
PLATOONS = {3: "ASta_040719_platoon7", 4: "ASta_040719_platoon8", 5: "ASta_040719_platoon9"}


def known():
    surfaces = {}
    for line in (pathlib.Path(__file__).parent / "spread.jsonl").read_text().splitlines():
        row = json.loads(line)
        task = row["task"]
        scores = [score for score in row["scores"] if score is not None]
        if task["aim"] == "spread" and scores:
            spent = statistics.mean(row["evaluations"])
            surfaces[task["model_id"], task["platoon"], task["follower"]] = (min(scores), spent)
    return surfaces


def calibrated(program, file, follower, model, *words):
    """Score and number of simulations."""
    with tempfile.TemporaryDirectory() as out:
        words = [program, "calibrate", file, "--follower", str(follower), "--model", model, *words]
        words += ["--convention", "authors", "--no-intervals", "--json", "--out", out]
        result = json.loads(subprocess.run(words, check=True, capture_output=True).stdout)
    return result["score"]["nrmse_sva"], result["evaluations"]


def main():
    program, folder = sys.argv[1:3]
    models = (sys.argv[3] if len(sys.argv) > 3 else "1,4,19,28,31,37,55,73").split(",")
    seeds = (sys.argv[4] if len(sys.argv) > 4 else "1").split(",")
    surfaces = known()
    print("| variant | runs | within 0.1 % | within 1 % | furthest above, below | evaluations, median (most) | before |")
    print("|---|---|---|---|---|---|---|")
    all_spent = []
    for model in models:
        off, spent, before = [], [], []
        for platoon, stem in PLATOONS.items():
            for follower in range(1, 5):
                file = f"{folder}/{stem}.csv"
                found = [calibrated(program, file, follower, model, "--seed", seed) for seed in seeds]
                if model.isdigit():
                    lowest, usual = surfaces[int(model), platoon, follower]
                else:
                    limit = ["--max-evaluations", str(OTHERS)]
                    others = [calibrated(program, file, follower, model, "--optimizer", o, *limit) for o in ("lshade", "cmaes")]
                    lowest, usual = min(score for score, _ in found + others), OTHERS
                off += [score / lowest - 1 for score, _ in found]
                spent += [simulations for _, simulations in found]
                before += [usual] * len(found)
        all_spent += spent
        near = [sum(x <= limit for x in off) for limit in (1e-3, 1e-2)]
        print(
            f"| {model} | {len(off)} | {near[0]} | {near[1]} | {round(max(off), 5) + 0.0:+.3%}, {round(min(off), 5) + 0.0:+.3%} "
            f"| {statistics.median(spent):,.0f} ({max(spent):,}) | {statistics.mean(before):,.0f} |",
            flush=True,
        )
    print(f"\nAll: median {statistics.median(all_spent):,.0f} evaluations, most {max(all_spent):,}.")


if __name__ == "__main__":
    main()
