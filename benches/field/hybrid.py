#!/usr/bin/env python3
"""The benchmark of hybrid stochastic laws (approximate Bayesian computation): a law and causes, chosen and fitted on the training drives, read once on the test drives.

    hybrid.py LEADLAG DATA OUT ["HDV/NGSIM I_80"|"AV/CAR MODEL I"|"AV/CAR MODEL II"]

DATA: the folder `data` of github.com/jiangjiwan/Approximate-Bayesian-Computation-Hybrid-Car-following-Model; nothing of it is kept here. Needs numpy.
A table has a row per 0.1 s and a column per drive; those of NGSIM are in ft. As in the benchmark, the spacing is the difference of the positions, and the
simulation is free from the first sample to the last. A drive of the test is left out of training. The score is the mean over drives of the RMSE of the position.
"""
import pathlib
import sys

import numpy
from common import fits, table

BASE = "l-cth"
M_PER_FT = 0.3048


def drives(folder, unit):
    """Spacings, speeds and speeds ahead of each drive, by all its values: a drive that occurs twice counts once."""
    names = ("Leading Position", "Following Position", "Following Speed", "Leading Speed")
    lead, own, speed, ahead = (unit * numpy.loadtxt(folder / f"{name}.csv", delimiter=",").T for name in names)
    return {drive.tobytes(): drive for drive in numpy.stack([lead - own, speed, ahead], axis=1)}


def main():
    leadlag, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    name = sys.argv[4] if len(sys.argv) > 4 else "HDV/NGSIM I_80"
    out.mkdir(parents=True, exist_ok=True)
    unit = M_PER_FT if name.startswith("HDV") else 1.0
    found = {part: drives(data / name / folder, unit) for part, folder in (("train", "Trajectory"), ("test", "Testing"))}
    found["train"] = {key: drive for key, drive in found["train"].items() if key not in found["test"]}
    files = {part: out / f"{part}.csv" for part in found}
    for part, file in files.items():
        table(found[part].values(), file)
    for model, fit in fits(leadlag, out, files["train"], files["test"], BASE, lambda scores: scores["mean"], ["--history", "0"]):
        told = (f"{part} {fit[key]['mean']:.3f} m, {fit[key]['failed']} fail" for part, key in (("train", "per_drive"), ("test", "held_back")))
        print(f"{name} {BASE} {model}: {'; '.join(told)}")


main()
