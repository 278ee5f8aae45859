#!/usr/bin/env python3
"""Rates of right and of false names in made-up fleets.

    fleets.py LEADLAG FOLDER [silent|effect [FIRST LAST [linear|idm]]]

Tables and results go to FOLDER, and results that are there are kept. The drivers follow the linear law or IDM for 30 s behind
a car that changes its speed; their parameters are log-normal with a standard deviation of a quarter, and they have sensor noise and an acceleration of
0.15 m/s² that lasts 1.5 s. `silent`: 60 drivers without an effect. `effect`: 200 drivers, of whom 30 % accelerate with a lag of 0.8 s.
"""

import json
import math
import pathlib
import random
import subprocess
import sys

from common import MAP

STEP, EVERY, SECONDS = 0.02, 5, 30.0
LAG_S, SHARE = 0.8, 0.3
LAWS = {"linear": "l-cth", "idm": "idm"}


def drive(rng, law, is_late):
    """Samples of one driver; None if the car comes too close."""

    def pick(median, spread):
        return median * math.exp(rng.gauss(0, spread))

    v_0, t_h, d_0, a_max, b, k_s, k_v = pick(31, 0.06), *(pick(m, 0.25) for m in (1.2, 2.2, 1.3, 1.8, 0.12, 0.5))
    v_l = target = rng.uniform(8, 27)
    v = v_l * rng.uniform(0.9, 1.05)
    s = max(6, d_0 + t_h * v) * rng.uniform(0.9, 1.3)
    gust = moved = change = 0
    pull, rows = 0.3, []
    for k in range(int(SECONDS / STEP) + 1):
        t = k * STEP
        if t >= change:
            target, pull, change = rng.uniform(2, 29), rng.uniform(0.1, 0.5), t + rng.uniform(6, 16)
        a_l = max(-3.5, min(2, pull * (target - v_l)))
        if k % EVERY == 0:
            rows.append((t, s + rng.gauss(0, 0.05), max(0, v + rng.gauss(0, 0.05)), max(0, v_l + rng.gauss(0, 0.05))))
        if law == "idm":
            wanted = d_0 + max(0, t_h * v + v * (v - v_l) / (2 * math.sqrt(a_max * b)))
            a = a_max * (1 - (v / v_0) ** 4 - (wanted / max(s, 0.3)) ** 2)
        else:
            a = k_s * (s - d_0 - t_h * v) + k_v * (v_l - v)
            a = min(max(-6, min(2.5, a)), 0.5 * (v_0 - v))
        moved += (a - moved) * STEP / LAG_S if is_late else a - moved
        gust += -gust * STEP / 1.5 + 0.15 * math.sqrt(2 * STEP / 1.5) * rng.gauss(0, 1)
        a, a_l = max(moved + gust, -v / STEP), max(a_l, -v_l / STEP)
        s += (v_l - v) * STEP + 0.5 * (a_l - a) * STEP**2
        v_l += a_l * STEP
        v += a * STEP
        if s < 1:
            return None
    return rows


def fleet(path, law, seed, drivers, share):
    rng, made = random.Random(seed), 0
    with open(path, "w") as table:
        table.write("event,time_s,spacing_m,speed_mps,lead_speed_mps\n")
        while made < drivers:
            rows = drive(rng, law, made < round(share * drivers))
            for t, s, v, v_l in rows or []:
                table.write(f"{made},{t:.1f},{s:.3f},{v:.3f},{v_l:.3f}\n")
            made += rows is not None


def main(leadlag, folder, kinds, seeds, laws):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "map.toml").write_text(MAP)
    print("| fleet | fleets | with a name | with a late answer | share of the drivers within its interval |")
    print("|---|---|---|---|---|")
    for kind in kinds:
        drivers, share = (60, 0) if kind == "silent" else (200, SHARE)
        for law in laws:
            named = late = within = 0
            for seed in seeds:
                out = folder / f"{kind}_{law}_{seed}"
                table = out.with_suffix(".csv")
                if not (out / "diagnosis.json").exists():
                    fleet(table, law, seed, drivers, share)
                    command = [leadlag, "diagnose", table, "--columns", folder / "map.toml", "--all", "--base", LAWS[law]]
                    more = ["--bounds", "human", "--effort", "quick", "--quiet", "--out", out]
                    subprocess.run([*command, *more], check=True, stdout=subprocess.DEVNULL)
                found = json.loads((out / "diagnosis.json").read_text())
                named += bool(found["causes"])
                late += any(cause["family"] == "phase" for cause in found["causes"])
                of = found["fleet"].get("share")
                within += bool(of) and of["interval"][0] <= share <= of["interval"][1]
            told = "–" if share == 0 else f"{within}"
            print(f"| {kind}, {law} | {len(seeds)} | {named} | {late} | {told} |")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    first, last = (int(word) for word in sys.argv[4:6] or ["1", "20"])
    main(sys.argv[1], sys.argv[2], sys.argv[3:4] or ["silent", "effect"], range(first, last + 1), sys.argv[6:7] or LAWS)
