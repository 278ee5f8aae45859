#!/usr/bin/env python3
"""A negative control on measured drives: behind the car ahead of another drive, no cause may be named.

    shuffled.py LEADLAG DATA OUT [Waymo|NGSIM_I_80 [FLEETS]]

DATA as for follownet.py. Each fleet has 60 of the validation events, each behind the car ahead of another one, started at a spacing that stays above 2 m.
"""
import pathlib
import random
import sys

import numpy
from common import MAP, run, table

BASE, DRIVERS, STEP_S, LEAST_M = "l-cth", 60, 0.1, 2.0


def behind(speed, ahead):
    """The drive of a follower behind another car ahead: spacing, speed and speed ahead, as long as both last."""
    samples = min(len(speed), len(ahead))
    speed, ahead = speed[:samples], ahead[:samples]
    spacing = numpy.concatenate([[0.0], numpy.cumsum(0.5 * STEP_S * ((ahead - speed)[1:] + (ahead - speed)[:-1]))])
    return spacing - spacing.min() + LEAST_M, speed, ahead


def main():
    leadlag, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    name, fleets = (sys.argv[4:] + ["Waymo"])[0], int(sys.argv[5]) if len(sys.argv) > 5 else 20
    out.mkdir(parents=True, exist_ok=True)
    (out / "map.toml").write_text(MAP)
    events = list(numpy.load(data / f"{name}_val_data.npy", allow_pickle=True))
    named = 0
    for seed in range(1, fleets + 1):
        chosen = random.Random(seed).sample(events, DRIVERS)
        pairs = zip(chosen, chosen[1:] + chosen[:1])
        file = out / f"{name}_{seed}.csv"
        table((behind(numpy.asarray(one[1], float), numpy.asarray(other[3], float)) for one, other in pairs), file, STEP_S)
        found = run(leadlag, "diagnose", str(file), "--columns", str(out / "map.toml"), "--all", "--base", BASE, "--bounds", "human", "--effort", "quick", "--json")
        causes = [cause["name"] for cause in found["causes"]]
        named += bool(causes)
        print(f"{name} {seed}: {found['verdict']} {' '.join(causes)}", flush=True)
    print(f"{name}: {named} of {fleets} fleets with a name")


main()
