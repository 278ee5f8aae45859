#!/usr/bin/env python3
"""What a law lacks on a recording without a published best: a table of the causes that leadlag names, and of their gain on data that no fit has seen.

    recordings.py LEADLAG DATA COLUMNS OUT [OPTION]...

DATA: a file or a folder; COLUMNS: the name or file of its column map; OPTION: others of reading, such as --resample 0.2. `diagnose --all` judges causes on
left-out drivers. A file with fewer drivers than it needs is diagnosed follower by follower, with causes judged on the last third of the file.
"""
import pathlib
import sys

from common import run

BASE = "l-cth"
S_PER_MIN = 60


def percent(part):
    return str(round(100 * part))


def row(name, found):
    """The line of the table: drives, minutes, causes with their sizes, and the gain over whole drives with its 95 % interval."""
    seconds = sum(drive["window_s"][1] - drive["window_s"][0] for drive in found["data"])
    fleet = found.get("fleet", {"drives": len(found["data"]), "minutes": seconds / S_PER_MIN})
    causes, gain = [], ""
    for cause in found["causes"]:
        sizes = (f"{size['name']} = {size['value']:.2g} {size['unit']}".removesuffix(" -") for size in cause["parameters"])
        rivals = [f"or {rival['name']}" for rival in found["confounded_with"] if rival.get("instead_of", found["causes"][0]["name"]) == cause["name"]]
        causes.append(" ".join([cause["name"], *sizes, *rivals]))
    for trial in found["closed_loop"]["trials"]:
        if causes and trial["causes"] == [cause["name"] for cause in found["causes"]]:
            whole = next(horizon for horizon in trial["horizons"] if horizon["horizon_s"] is None)
            gain = f"{percent(whole['gain'])} % [{', '.join(map(percent, whole['interval']))}]"
    return f"| {name} | {fleet['drives']} | {fleet['minutes']:.0f} | {found['verdict']} | {'; '.join(causes)} | {gain} |"


def main():
    leadlag, data, columns, out = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4])
    words = ["diagnose", str(data), "--columns", columns, *sys.argv[5:], "--base", BASE, "--effort", "quick", "--json"]
    found = {data.stem: run(leadlag, *words, "--all", "--out", str(out / "all"))}
    whole = found[data.stem]
    if whole["verdict"] == "not_testable" and data.is_file():
        followers = [str(number) for number in range(1, whole["fleet"]["drivers"] + 1)]
        found = {f"follower {number}": run(leadlag, *words, "--follower", number, "--out", str(out / number)) for number in followers}
    print("| recording | drives | minutes | verdict | causes | gain on unseen data |\n|---|---|---|---|---|---|")
    for name, result in found.items():
        print(row(name, result))


main()
