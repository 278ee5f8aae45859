"""How well calibrations recover the parameters of synthetic IDM drivers: tables of docs/benchmark/optimizers.md and fleet.md.

    python3 benches/coverage.py PROGRAM SHARED

PROGRAM is the leadlag binary, SHARED the folder with tools/make_fleet.py. A drive determines a parameter if `calibrate` gives an interval.
"""

import csv
import statistics
import subprocess
import sys
import tempfile

# Columns of a result, and names in the truth, where a_min is a positive deceleration.
PARAMETERS = {"v_0_mps": "v_0", "t_h_s": "t_h", "d_0_m": "d_0", "a_max_mps2": "a_max", "a_min_mps2": "a_min"}
# Number of drives, shortest and longest [s].
FLEETS = [(500, 30, 60), (120, 200, 200), (60, 900, 900)]
# Kind of the acceleration noise, and how long it lasts [s].
NOISES = {"lasting": 1.5, "white": 0.04}


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)


def recovered(folder):
    """Truth, estimate and interval (`None` if there is none) of every driver, by column."""
    truth = {row["trajectory"]: row for row in csv.DictReader(open(f"{folder}/truth.csv"))}
    found = {column: [] for column in PARAMETERS}
    for row in csv.DictReader(open(f"{folder}/out/parameters.csv")):
        for column, name in PARAMETERS.items():
            sign = -1 if name == "a_min" else 1
            ends = [row[f"{column}_{end}"] for end in ("low", "high")]
            interval = None if "" in ends else [float(end) for end in ends]
            found[column].append((sign * float(truth[row["trajectory"]][name]), float(row[column]), interval))
    return found


def covered(drives):
    return sum(low <= truth <= high for truth, _, (low, high) in drives) / len(drives)


def rank_correlation(drives):
    def ranks(k):
        order = sorted(range(len(drives)), key=lambda i: drives[i][k])
        return sorted(range(len(drives)), key=order.__getitem__)

    return statistics.correlation(ranks(0), ranks(1))


def main():
    program, shared = sys.argv[1:3]
    names = " | ".join(PARAMETERS.values())
    print("Three rows per fleet: share of the intervals that contain the truth (drives that determine the parameter);")
    print("rank correlation of estimate and truth over these drives; median estimate (truth).\n")
    print(f"| drives | noise lasts | {names} |\n|---|---|{'---|' * len(PARAMETERS)}")
    for drives, shortest, longest in FLEETS:
        for noise, lasts in NOISES.items():
            with tempfile.TemporaryDirectory() as folder:
                size = ["--pairs", drives, "--shortest", shortest, "--longest", longest]
                run(sys.executable, f"{shared}/tools/make_fleet.py", folder, "--noise", noise, *size)
                table, out = f"{folder}/pairs.csv", f"{folder}/out"
                run(program, "calibrate", table, "--all", "--model", "idm", "--bounds", "human", "--quiet", "--out", out)
                found = recovered(folder).values()
            determined = [[one for one in drives if one[2]] for drives in found]
            median = [[statistics.median(one[k] for one in drives) for k in (1, 0)] for drives in found]
            rows = [
                [f"{covered(drives):.0%} ({len(drives)})" for drives in determined],
                [f"{rank_correlation(drives):.2f}" for drives in determined],
                [f"{estimate:.2f} ({truth:.2f})" for estimate, truth in median],
            ]
            length = f"{shortest} s" if shortest == longest else f"{shortest} to {longest} s"
            for row in rows:
                print(f"| {drives} of {length} | {lasts} s | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
