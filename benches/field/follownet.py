#!/usr/bin/env python3
"""FollowNet's benchmark: a law and the causes that leadlag chooses, fitted to the validation events, read once on the test events.

    follownet.py LEADLAG DATA OUT [Waymo|NGSIM_I_80]

DATA: the folder `data` of github.com/ZjGDP/follow_car_datasets; nothing of it is kept here (Waymo's terms allow evaluation only). Needs numpy.
An event is [spacing, speed, relative speed, speed ahead] every 0.1 s. The first second is history, as in the benchmark; the simulation
is free from there to 15 s. The score is the mean over events of the mean squared error of the spacing.
"""
import json
import pathlib
import subprocess
import sys

import numpy

BASE, LAST_S, HISTORY_S = "l-cth", 14.9, 1.0
MAP = """title = "FollowNet"
rows = "pairs"
[columns]
group = { name = "event" }
time = { name = "time_s", unit = "s" }
speed = { name = "speed_mps", unit = "m/s" }
lead_speed = { name = "lead_speed_mps", unit = "m/s" }
gap = { name = "spacing_m", unit = "m" }
"""


def table(source, target):
    with open(target, "w") as out:
        out.write("event,time_s,spacing_m,speed_mps,lead_speed_mps\n")
        for number, event in enumerate(numpy.load(source, allow_pickle=True), 1):
            spacing, speed, _, ahead = (numpy.asarray(signal, float) for signal in event)
            for i in range(len(spacing)):
                out.write(f"{number},{i * 0.1:.1f},{spacing[i]:.6g},{speed[i]:.6g},{ahead[i]:.6g}\n")


def run(leadlag, *words):
    done = subprocess.run([leadlag, *words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return json.loads(done.stdout)


def main():
    leadlag, data, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    name = sys.argv[4] if len(sys.argv) > 4 else "Waymo"
    out.mkdir(parents=True, exist_ok=True)
    columns, files = out / "map.toml", {part: out / f"{name}_{part}.csv" for part in ("val", "test")}
    columns.write_text(MAP)
    for part, file in files.items():
        table(data / f"{name}_{part}_data.npy", file)
    read = [str(files["val"]), "--columns", str(columns)]
    folder = str(out / "diagnosis")
    found = run(leadlag, "diagnose", *read, "--all", "--base", BASE, "--effort", "quick", "--out", folder, "--json")
    causes = [cause["name"] for cause in (found["recommended"] or {"causes": []})["causes"]]
    models = {"base": ["--bounds", "human"]}
    if causes:
        extend = [word for cause in causes for word in ("--extend", cause)]
        models[" + ".join(causes)] = [*extend, "--bounds", f"{folder}/bounds.toml"]
    for model, words in models.items():
        window = ["--from", str(HISTORY_S), "--to", str(LAST_S)]
        fit = run(leadlag, "calibrate", *read, "--joint", "--model", BASE, *words, "--gof", "rmse-s", *window, "--no-intervals",
                  "--holdout", str(files["test"]), "--out", str(out / model.replace(" ", "")), "--json")
        rows = (f"{part} {fit[key]['mse_s_m2']:.2f} m², {fit[key]['failed']} fail" for part, key in (("val", "per_drive"), ("test", "held_back")))
        print(f"{name} {BASE} {model}: {'; '.join(rows)}")


main()
