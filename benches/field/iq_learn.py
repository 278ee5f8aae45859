#!/usr/bin/env python3
"""Drivers behind automated Waymo cars, as in the benchmark of IQ-Learn: a law and causes, chosen and fitted on the training events, read once on the test events.

    iq_learn.py LEADLAG REPOSITORY OUT [CF_HV-AV_2|CF_HV-AV_4]

REPOSITORY: a clone of github.com/18627242758/IQ-Learn-car-following; nothing of it is kept here (Waymo's terms allow evaluation only).
Needs scipy. An event has columns of spacing, speed, relative speed and speed ahead, every 0.1 s. The simulation is free from the first sample
to the last, so there is no history for a delay. The score is the pooled RMSPE: the root of the summed squared errors of the spacing over the summed squared spacings.
"""
import math
import pathlib
import sys

import scipy.io
from common import fits, table

BASE = "l-cth"


def pooled(scores, events):
    """The RMSPE of the spacing over all drives that do not fail."""
    driven = [(drive["rmse"][0], spacing) for drive, (spacing, *_) in zip(scores["drives"], events) if drive["rmse"]]
    errors = sum(len(spacing) * rmse**2 for rmse, spacing in driven)
    return math.sqrt(errors / sum(float(spacing @ spacing) for _, spacing in driven))


def main():
    leadlag, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    name = sys.argv[4] if len(sys.argv) > 4 else "CF_HV-AV_2"
    out.mkdir(parents=True, exist_ok=True)
    files, events = {}, {}
    for part in ("train", "test"):
        states = scipy.io.loadmat(data / name / f"{part}_cf_{name[-1]}.mat")["states"][0]
        events[part], files[part] = [(event[:, 0], event[:, 1], event[:, 3]) for event in states], out / f"{name}_{part}.csv"
        table(events[part], files[part])
    for model, fit in fits(leadlag, out, files["train"], files["test"], BASE, lambda scores: pooled(scores, events["train"]), ["--history", "0"]):
        rows = (f"{part} {pooled(fit[key], events[part]):.4f}, {fit[key]['failed']} fail" for part, key in (("train", "per_drive"), ("test", "held_back")))
        print(f"{name} {BASE} {model}: RMSPE(s) {'; '.join(rows)}")


main()
