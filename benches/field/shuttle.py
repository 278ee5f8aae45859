#!/usr/bin/env python3
"""An automated shuttle in mixed traffic: a law and causes, chosen and fitted on the training drives, read once on the test drives.

    shuttle.py LEADLAG REPOSITORY OUT

REPOSITORY: a clone of github.com/renanfavero30/AS_car_following, in which `7z x results_ACC.7z` has unpacked the test drives; nothing of it is kept here.
Both tables have a row per second. As in the benchmark, a row with `delta_t` other than 1 begins a drive, its first two rows are measured and the simulation is
free from there to the next drive. Drives of 10 s train. The score is the RMSE of the position in ft over all rows, where measured rows have no error.
"""
import csv
import math
import pathlib
import sys

from common import fits, table

BASE, STEP_S, MEASURED_ROWS, TRAINED_S = "l-cth", 1.0, 2, 10.0
M_PER_FT = 0.3048


def drives(file):
    """Spacings, speeds and speeds ahead of each drive."""
    found = []
    with open(file, newline="") as rows:
        for row in csv.DictReader(rows):
            if not found or float(row["delta_t"]) != STEP_S:
                found.append([])
            found[-1].append([float(row[name]) * M_PER_FT for name in ("delta_s", "Follower_sp_[ft]", "Leader_sp_[ft]")])
    return [list(zip(*drive)) for drive in found]


def position_rmse(scores, lengths, rows):
    """The RMSE in ft over `rows` rows, of which drives of these lengths are simulated behind their measured rows."""
    named = {str(number): length for number, length in enumerate(lengths, 1)}
    squares = sum(drive["rmse"][0] ** 2 * (named[drive["name"]] - MEASURED_ROWS) for drive in scores["drives"] if drive["rmse"])
    return math.sqrt(squares / rows) / M_PER_FT


def main():
    leadlag, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    parts = {"train": (data / "dataset_models.csv", int(TRAINED_S / STEP_S) + 1),
             "test": (data / "results_ACC" / "dataset_test_simulation.csv", MEASURED_ROWS + 1)}
    files, lengths, rows = {}, {}, {}
    for part, (source, least) in parts.items():
        found = drives(source)
        used = [drive for drive in found if len(drive[0]) >= least]
        files[part], lengths[part] = out / f"{part}.csv", [len(drive[0]) for drive in used]
        rows[part] = sum(len(drive[0]) for drive in found if part == "test" or drive in used)
        table(used, files[part], STEP_S)

    def score(part, scores):
        return position_rmse(scores, lengths[part], rows[part])

    history = ["--history", str((MEASURED_ROWS - 1) * STEP_S)]
    for model, fit in fits(leadlag, out, files["train"], files["test"], BASE, lambda scores: score("train", scores), history, "pooled-rmse-s"):
        told = (f"{part} {score(part, fit[key]):.1f} ft, {fit[key]['failed']} fail" for part, key in (("train", "per_drive"), ("test", "held_back")))
        print(f"shuttle {BASE} {model}: {'; '.join(told)}")


main()
