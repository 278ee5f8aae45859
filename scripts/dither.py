"""Pair files of the processed AstaZero platoons with the noise of a sensor put back: the published signals are smoothed so far that no noise
is left by which to tell a better model from a worse one.

    scripts/dither.py PLATOON.csv Slope.csv FOLLOWER SEED > pair.csv

White noise of 0.02 m/s on both speeds and 0.02 m on the gap, the sensor's stated precision; the grade is looked up at the unchanged position.
"""

import bisect
import csv
import random
import sys

NOISE = 0.02
platoon, slope, follower, seed = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
with open(slope, newline="", encoding="utf-8-sig") as file:
    nodes = [(float(row["X"]), float(row["Y"])) for row in csv.DictReader(file)]
xs = [x for x, _ in nodes]


def sin_grade(x: float) -> float:
    x %= xs[-1]
    k = min(max(bisect.bisect_right(xs, x), 1), len(xs) - 1)
    (a, ya), (b, yb) = nodes[k - 1], nodes[k]
    return ya + (yb - ya) * (x - a) / (b - a)


draw = random.Random(seed)
out = csv.writer(sys.stdout, lineterminator="\n")
ahead, own = follower, follower + 1
second = follower > 1
out.writerow(["time_s", "lead_speed_mps", "speed_mps", "spacing_m", "sin_grade", "lead_position_m"]
             + ["lead2_speed_mps", "lead2_spacing_m"] * second)
with open(platoon, newline="", encoding="utf-8-sig") as file:
    for row in csv.DictReader(file):
        def speed(car: int) -> str:
            return f"{abs(float(row[f'SpeedDoppler{car}']) + draw.gauss(0, NOISE)):.6f}"

        def gap(car: int) -> str:
            return f"{float(row[f'Spacing{car}']) + draw.gauss(0, NOISE):.5f}"

        values = [row["Time"], speed(ahead), speed(own), gap(own), f"{sin_grade(float(row[f'X{own}'])):.7f}", row[f"X{ahead}"]]
        out.writerow(values + ([speed(ahead - 1), gap(ahead)] if second else []))
