"""Tables of docs/FINDINGS.md from what scripts/findings made."""

import json
import sys
from pathlib import Path

work = Path(sys.argv[1])
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

print("\n### Diagnoses\n\n| held out | car | base | verdict | adopted (evidence / threshold) | NRMSE(s,v,a) base, extended | "
      "difference, 95 % | missing acceleration, rms [m/s²] | repeats by place |\n|---|---|---|---|---|---|---|---|---|")
for path in sorted(work.glob("hold*/diagnosis.json")):
    report = json.loads(path.read_text())
    held, base, follower, *noise = path.parent.name.split("_")
    causes = "; ".join(
        f"{c['name']} " + ", ".join(f"{p['name']} = {short(p['value'])} {p['unit']}" for p in c["parameters"])
        + f" ({c['evidence']:.0f} / {c['threshold']:.0f})" for c in report["causes"]) or "–"
    gain = report["gain"]
    scores, difference = "–", "–"
    if gain and gain["base"] is not None and gain["extended"] is not None:
        scores = f"{gain['base']:.3f}, {gain['extended']:.3f}"
        difference = f"{gain['base'] - gain['extended']:+.3f} [{gain['interval'][0]:+.3f}, {gain['interval'][1]:+.3f}]"
    missing = report["missing"]
    repeats = missing.get("repeats_by_place") if missing else None
    print(f"| platoon{held[4:]} | {CARS[int(follower[-1])]}{', ' + noise[0] if noise else ''} | {base} | {report['verdict']} | {causes} | {scores} | {difference} | "
          f"{short(missing['rms']) if missing else '–'} | {short(repeats) if repeats is not None else '–'} |")
    print(f"<!-- {report['reason']} -->")
