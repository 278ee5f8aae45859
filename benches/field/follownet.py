#!/usr/bin/env python3
"""FollowNet's benchmark: a law and the causes that leadlag chooses, chosen and fitted on the validation events, read once on the test events.

    follownet.py LEADLAG DATA OUT [Waymo|NGSIM_I_80]

DATA: the folder `data` of github.com/ZjGDP/follow_car_datasets; nothing of it is kept here (Waymo's terms allow evaluation only). Needs numpy.
An event is [spacing, speed, relative speed, speed ahead] every 0.1 s. The first second is history, as in the benchmark; the simulation
is free from there to 15 s. The score is the mean over events of the mean squared error of the spacing.
"""
import pathlib
import sys

import numpy
from common import fits, table

BASE, LAST_S, HISTORY_S = "l-cth", 14.9, 1.0


def main():
    leadlag, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    name = sys.argv[4] if len(sys.argv) > 4 else "Waymo"
    out.mkdir(parents=True, exist_ok=True)
    files = {part: out / f"{name}_{part}.csv" for part in ("val", "test")}
    for part, file in files.items():
        events = numpy.load(data / f"{name}_{part}_data.npy", allow_pickle=True)
        table(((spacing, speed, ahead) for spacing, speed, _, ahead in events), file)
    window = ["--to", str(LAST_S), "--history", str(HISTORY_S)]
    for model, fit in fits(leadlag, out, files["val"], files["test"], BASE, lambda scores: scores["mse_s_m2"], window):
        rows = (f"{part} {fit[key]['mse_s_m2']:.2f} m², {fit[key]['failed']} fail" for part, key in (("val", "per_drive"), ("test", "held_back")))
        print(f"{name} {BASE} {model}: {'; '.join(rows)}")


main()
