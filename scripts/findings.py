"""Tables of docs/FINDINGS.md from what scripts/findings made.

    findings.py WORK RESULTS      RESULTS is the folder of the diagnoses of one effort
"""

import csv
import json
import sys
from pathlib import Path

work, results = Path(sys.argv[1]), Path(sys.argv[2])
PAPER = {"040719_platoon5": "P1", "040719_platoon6": "P2", "040719_platoon7": "P3", "040719_platoon8": "P4", "040719_platoon9": "P5",
         "050719_platoon1": "P6", "050719_platoon2": "P7"}


# The followers of P3, P4 and P5.
CARS = {1: "Tesla 3", 2: "BMW X5", 3: "Audi A6", 4: "Mercedes A"}


def short(value: float) -> str:
    return f"{value:.3g}"


def size(finding: dict) -> str:
    if finding["name"] == "speed_scale":
        low, high = finding["interval"]
        return f"{100 * finding['value']:+.3f} % ({100 * low:+.3f} to {100 * high:+.3f})"
    return f"{short(finding['value'])} {finding['unit']}"


for kind in ("astazero_rebuilt", "astazero_c2art"):
    print(f"\n### {kind}\n\n| platoon | follower | gap against speeds, rms over 1 s [m/s] | findings |\n|---|---|---|---|")
    for path in sorted((work / "data").glob(f"{kind}_*.json")):
        report = json.loads(path.read_text())
        data = report["data"][0]
        stem = Path(data["path"]).stem.removeprefix("ASta_")
        found = "; ".join(f"{f['name']} ({f['car']}, {f['signal']}): {size(f)}" for f in report["data_findings"]) or "none"
        rms = data["gap_rate_rms_mps"]
        print(f"| {PAPER[stem]} | {data['follower']} {data['name']} | {short(rms)} | {found} |")



def causes(report: dict) -> str:
    return "; ".join(
        f"{c['name']} " + ", ".join(f"{p['name']} = {short(p['value'])} {p['unit']}" for p in c["parameters"])
        + f" ({c['evidence']:.0f} / {c['threshold']:.0f})" for c in report["causes"]) or report["reason"].split(";")[0]


def gains(report: dict) -> tuple[str, str]:
    """NRMSE(s,v,a) of both models on the hold-out, and their difference."""
    gain = report["gain"]
    if not gain:
        return "–", "–"
    scores = ", ".join("runs into the leader" if gain[model] is None else f"{gain[model]:.3f}" for model in ("base", "extended"))
    if gain["interval"] is None or gain["base"] is None or gain["extended"] is None:
        return scores, "–"
    low, high = gain["interval"]
    return scores, f"{gain['base'] - gain['extended']:+.3f} [{low:+.3f}, {high:+.3f}]"


def rms(missing: dict | None) -> str:
    return f"{missing['rms']:.3f}" if missing else "–"


def slope_on_grade(missing: dict | None) -> str:
    """How the missing acceleration changes with the sine of the grade [m/s²]: a line through the means of the classes, weighted by their errors."""
    profiles = [profile for profile in missing["profiles"] if "grade" in profile["name"]] if missing else []
    if not profiles:
        return "–"
    classes = profiles[0]["classes"]
    weights = [1 / max(c["error"], 1e-3) ** 2 for c in classes]
    total = sum(weights)
    at = sum(w * c["at"] for w, c in zip(weights, classes)) / total
    mean = sum(w * c["mean"] for w, c in zip(weights, classes)) / total
    spread = sum(w * (c["at"] - at) ** 2 for w, c in zip(weights, classes))
    slope = sum(w * (c["at"] - at) * (c["mean"] - mean) for w, c in zip(weights, classes)) / spread
    return f"{slope:+.1f} ± {spread**-0.5:.1f}"


# By car, then base, then what was held out.
def order(path: Path) -> tuple:
    held, base, follower, *noise = path.parent.name.split("_")
    return follower, bool(noise), ["l-cth", "idm", "gipps"].index(base), held


done = sorted(results.glob("hold*/diagnosis.json"), key=order)
for noise, title in (("dithered", "with the noise of a sensor put back"), (None, "as published")):
    for follower, car in CARS.items():
        mine = [path for path in done if order(path)[:2] == (f"follower{follower}", noise is not None)]
        if not mine:
            continue
        print(f"\n### {car}, {title}\n\n| base | held out | verdict | adopted (evidence / threshold [nats]), or why not | NRMSE(s,v,a) base, extended | "
              "difference, 95 % | missing acceleration, rms [m/s²]: base, extended | its slope on the sine of the grade, base [m/s²] |\n|---|---|---|---|---|---|---|---|")
        for path in mine:
            report = json.loads(path.read_text())
            held, base, *_ = path.parent.name.split("_")
            scores, difference = gains(report)
            print(f"| {base} | {PAPER['040719_platoon' + held[4:]]} | {report['verdict']} | {causes(report)} | {scores} | {difference} | "
                  f"{rms(report['missing'])}, {rms(report['missing_left'])} | {slope_on_grade(report['missing'])} |")

print("\n### Largest acceleration over a second [m/s²], in the first minute and after it\n\n| car | P3 | P4 | P5 |\n|---|---|---|---|")
for follower, car in CARS.items():
    cells = []
    for platoon in (7, 8, 9):
        rows = list(csv.DictReader((work / "dithered" / f"platoon{platoon}_follower{follower}.csv").open()))
        speeds = [(float(row["time_s"]), float(row["speed_mps"])) for row in rows]
        gained = [(t, later - now) for (t, now), (_, later) in zip(speeds, speeds[10:])]
        cells.append(", ".join(f"{max(a for t, a in gained if (t < 60.0) == first):.2f}" for first in (True, False)))
    print(f"| {car} | {' | '.join(cells)} |")
