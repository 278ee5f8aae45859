"""Tables and pictures of docs/FINDINGS.md and docs/benchmark/findings.md from the results of scripts/findings.

    findings.py RESULTS DOCS      RESULTS holds the folders CAR_BASE; in DOCS the text between the two marks of each table is replaced
"""

import json
import re
import shutil
import sys
from pathlib import Path

results, docs = Path(sys.argv[1]), Path(sys.argv[2])
CARS = ["Tesla", "BMW", "Audi", "Mercedes"]
BASES = ["l-cth", "idm", "gipps"]
PAPER = {"040719_platoon5": "P1", "040719_platoon6": "P2", "040719_platoon7": "P3", "040719_platoon8": "P4", "040719_platoon9": "P5",
         "050719_platoon1": "P6", "050719_platoon2": "P7"}
reports = {(car, base): json.loads((results / f"{car}_{base}" / "diagnosis.json").read_text()) for car in CARS for base in BASES}


def paper(path: str) -> str:
    return PAPER[Path(path).stem.removeprefix("ASta_")]


def percent(share: float) -> str:
    return f"{100 * share:+.1f}"


def parameter(entry: dict) -> str:
    unit = "" if entry["unit"] == "-" else f" {entry['unit']}"
    interval = f" ({entry['interval'][0]:.3g} to {entry['interval'][1]:.3g})" if entry["interval"] else ""
    return f"{entry['name']} = {entry['value']:.3g}{unit}{interval}"


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def said(car: str, base: str) -> str:
    """The first sentence of the text of a diagnosis, without the descriptions of the causes."""
    lines = (results / f"{car}_{base}.txt").read_text().split("\n\n")[0].splitlines()[1:]
    sentences: list[str] = []
    for line in lines:
        if line.startswith("  "):
            sentences[-1] += line[1:]
        else:
            sentences.append(line)
    return re.sub(r" \(these data[^)]*\)", "", re.sub(r" \([^();]*; ", " (", sentences[0]))



def names() -> str:
    return table(["car", "base", "what the diagnosis says"], [[car, base, said(car, base)] for car, base in reports])


def recommended() -> str:
    rows = []
    for (car, base), report in reports.items():
        found = report["recommended"]
        if not found:
            rows.append([car, base, "nothing", "–", "–", "–"])
            continue
        causes = " + ".join(f"{cause['name']} {', '.join(map(parameter, cause['parameters']))}" for cause in found["causes"])
        gain = found["gain"]
        share = (gain["base"] - gain["extended"]) / gain["base"]
        low, high = (value / gain["base"] for value in gain["interval"])
        better = sum(drive["extended"] < drive["base"] for drive in found["per_drive"])
        collisions = found["collisions"]
        rows.append([car, base, causes, f"{percent(share)} [{percent(low)}, {percent(high)}]", f"{better} of {len(found['per_drive'])}",
                     f"{collisions['base']}, {collisions['extended']}"])
    return table(["car", "base", "recommended, with 95 % intervals", "gain [%]", "drives better", "collisions: base, extended"], rows)


def per_platoon() -> str:
    rows = []
    for (car, base), report in reports.items():
        if not report["recommended"]:
            continue
        drives = {paper(drive["path"]): drive for drive in report["recommended"]["per_drive"]}
        gains = [percent(1 - drives[p]["extended"] / drives[p]["base"]) if p in drives else "–" for p in PAPER.values()]
        rows.append([car, base, *gains])
    return table(["car", "base", *PAPER.values()], rows)


def laws() -> str:
    names = sorted({law["name"] for report in reports.values() for law in report["base_laws"]})
    rows = []
    for car in CARS:
        gains = {law["name"]: percent(law["gain"]) for law in reports[car, BASES[0]]["base_laws"]}
        rows.append([car, *(gains.get(name, "–") for name in names)])
    return table(["car", *names], rows)


def by_platoon(car: str, told) -> list[str]:
    """The findings of a car, platoon by platoon, as `told` words them."""
    cells = {name: [] for name in PAPER.values()}
    for finding in reports[car, BASES[0]]["data_findings"]:
        if text := told(finding):
            cells[paper(finding["file"])].append(text)
    return [car, *("; ".join(cells[name]) or "–" for name in PAPER.values())]


def stretches() -> str:
    def told(finding: dict) -> str:
        if finding["name"] != "not_followed":
            return ""
        begin, end = finding["when_s"][0]
        return f"{begin:.0f}–{end:.0f} s ({finding['value']:.1f})"

    return table(["car", *PAPER.values()], [by_platoon(car, told) for car in CARS])


def data() -> str:
    def told(finding: dict) -> str:
        value, name = finding["value"], finding["name"]
        return {"not_followed": "", "speed_scale": f"{100 * value:+.3f} %", "dropout": f"{finding['car']} {value:.1f} s"}.get(name, name)

    return table(["car", *PAPER.values()], [by_platoon(car, told) for car in CARS])


for name, tables in (("FINDINGS.md", [names, recommended]), ("benchmark/findings.md", [per_platoon, laws, stretches, data])):
    text = (docs / name).read_text()
    for make in tables:
        mark = re.compile(rf"(<!-- {make.__name__} -->\n).*?(<!-- end -->)", re.S)
        if not mark.search(text):
            sys.exit(f"{docs / name}: no place for the table {make.__name__}")
        text = mark.sub(lambda found: f"{found[1]}{make()}\n{found[2]}", text)
    (docs / name).write_text(text)
for car in CARS:
    shutil.copy(results / f"{car}_l-cth" / "missing_acceleration.svg", docs / "images" / f"findings_{car.lower()}.svg")
