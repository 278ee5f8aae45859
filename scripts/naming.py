"""Tables and pictures of docs/benchmark/diagnosis.md from the JSON of `leadlag bench diagnosis`.

    naming.py REPORT.json PAGE.md COMMAND      replaces the text between the two marks of the page, and the pictures in images beside it
"""

import datetime
import json
import sys
from collections import defaultdict
from html import escape
from pathlib import Path

source, page, command = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
report = json.loads(source.read_text())
BEGIN, END = "<!-- scripts/naming: what follows is written by it -->", "<!-- scripts/naming: end -->"
# The cases that could be made, each with its judgement and whether the data show its effects.
cases = [(outcome, *judged) for outcome, judged in zip(report["outcomes"], report["judged"]) if judged[0] != "failed"]
KINDS = {"none": "no effect", "coloured": "coloured noise only", "outside": "unmeasured road", "family": "another law"}
WORDS = {"right": "right", "in_set": "in the set", "half": "one of two", "silent": "silent", "wrong": "wrong"}
# Okabe and Ito: distinct with every kind of colour blindness.
PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"]
INK, PALE = "#222222", "#dddddd"
COLOURS = {"right": ("right", PALETTE[5]), "in_set": ("the truth in the set", PALETTE[2]), "silent": ("silent", PALE), "wrong": ("wrong", PALETTE[1])}


def table(head: list[str], rows: list[list]) -> str:
    head, *below = (f"| {' | '.join(map(str, line))} |".replace("|  |", "| |") for line in [head, *rows])
    return "\n".join([head, f"|{'---|' * head.count(' | ')}---|", *below])


def targets() -> str:
    rows = []
    for bar in report["bars"]:
        share = f"{100 * bar['count'] / bar['cases']:.0f} %" if bar["cases"] else "-"
        low, high = (100 * end for end in bar["interval"])
        wanted = f"{'≤' if bar['most'] else '≥'} {100 * bar['target']:g} %"
        met = {None: "no case", True: "met", False: "**missed**"}[bar["met"]]
        rows.append([bar["what"], f"{bar['count']} of {bar['cases']}", share, f"{low:.0f} to {high:.0f} %", wanted, met])
    return table(["target", "reached", "share", "95 % interval", "wanted", ""], rows)


def tallies() -> str:
    counts = ["cases", "right", "in_set", "half", "silent", "not_found", "wrong"]
    rows = [[of, *(tally[name] for name in counts)] for of, tally in report["tallies"].items() if tally["cases"]]
    return table(["planted", "cases", "right", "in the set", "one of two", "silent", "of these not found", "wrong"], rows)


def powers() -> str:
    rows = report["powers"] + report["powers_by_effect"]
    sizes = rows[0]["sizes"]
    counts = [[row["of"], *(f"{at['right']} of {at['cases']}" if at["cases"] else "–" for at in row["sizes"])] for row in rows]
    return table(["one effect, named right", *(f"{at['rms_mps']:g} m/s" for at in sizes)], counts) if sizes else ""


def pairs() -> str:
    rows = []
    for outcome, judged, shown in cases:
        task = outcome["task"]
        weak = ", and whether the data show it is not known" if outcome["unknown"] else "" if shown else ", not shown by the data"
        said = " + ".join(outcome["adopted"]) or outcome["verdict"]
        if task["kind"] == "pair":
            rows.append([task["seed"], task["base"], " + ".join(task["causes"]), said, WORDS[judged] + weak])
    return table(["pair", "base", "planted", "answer", ""], rows) if rows else ""


def silence() -> str:
    rows = [[row["of"], row["cases"], *(f"{row[name]:.2f}" for name in ("median", "one_in_twenty", "highest"))] for row in report["silence"]]
    return ("Drives without an effect: evidence of the likeliest cause, as a share of the threshold for a name (0 if none gains enough to be "
            "judged).\n\n" + table(["", "drives", "median", "one of 20 exceeds", "highest"], rows)) if rows else ""


def part() -> str:
    done, planned, failed, (cpu, simulations) = len(report["outcomes"]), report["planned"], report["failed"], report["cost"]
    number = f"all {done} cases" if done == planned else f"{done} of {planned} cases, which are shuffled"
    lost = f", of which {failed} could not be generated" if failed else ""
    program = ", ".join(sorted({outcome["program"] for outcome in report["outcomes"]}))
    (close, estimated), gains = report["close_estimates"], report["gains"]
    last = f"Of the cases named right, {close} of {estimated} have all parameters within 10 % or three standard errors of the planted ones."
    if gains:
        last += (f"\nExtended models reach {100 * gains['median']:.0f} % of the gain of the truth on the hold-out (NRMSE(s,v,a)) in the median, "
                 f"and at least 80 % in {gains['most']} of {gains['cases']} cases.")
    parts = [
        f"`{command}`: {number}{lost}. {program}, {report['machine']}, written {datetime.date.today()}. A case takes {cpu:.0f} s of CPU in the "
        f"median, and {simulations:.0f} simulated candidates.",
        targets(),
        "*Shown*: the truth, fitted from its own values, gains more than the threshold, each of two effects beside the other.",
        tallies(),
        "*Not found*: the truth, fitted from its own values, would have been named; the other silent ones lack evidence.",
        "![Planted effects, and their names](images/diagnosis_names.svg)",
        "![Share named by size of the effect](images/diagnosis_power.svg)",
        powers(), pairs(), silence(), last,
    ]
    return "\n\n".join(text for text in parts if text)


def text(x: float, y: float, words: str, size: float = 12, anchor: str = "start", fill: str = INK, turn: str = "") -> str:
    turn = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" text-anchor="{anchor}" fill="{fill}"{turn}>{escape(words, quote=False)}</text>'


def line(x: float, y: float, to_x: float, to_y: float, width: float, colour: str) -> str:
    return f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}" stroke="{colour}" stroke-width="{width}"/>'


def bar(x: float, y: float, width: float, height: float, fill: str) -> str:
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}"/>'


def group(words: str, shapes: list[str]) -> list[str]:
    """Shapes with one tooltip."""
    return [f"<g><title>{escape(words, quote=False)}</title>", *shapes, "</g>"]


def legend(entries: list[tuple[str, str]]) -> list[str]:
    shapes, x = [], 16.0
    for name, colour in entries:
        shapes += [bar(x, 63, 10, 10, colour), text(x + 15, 72, name, 12.5)]
        x += 34 + 7.2 * len(name)
    return shapes


def picture(width: float, height: float, title: str, below: str, shapes: list[str]) -> str:
    head = [text(16, 28, title, 18), text(16, 48, below, 12.5, fill="#555555")]
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" viewBox="0 0 {width:g} {height:g}" '
        f'font-family="sans-serif">', f'<rect width="{width:g}" height="{height:g}" fill="white"/>', *head, *shapes, "</svg>\n"])


def names() -> str:
    """A row per effect planted alone and per kind of drive without one, a column per name; a case with two names counts in both."""
    cells, sizes = defaultdict(list), defaultdict(int)
    for outcome, judged, _ in cases:
        task = outcome["task"]
        if task["kind"] == "pair":
            continue
        row = " + ".join(task["causes"]) or f"({KINDS.get(task['kind'], task['kind'])})"
        sizes[row] += 1
        for said in outcome["adopted"] or ["no name"]:
            cells[row, said].append(judged)
    rows = sorted(sizes, key=lambda row: (row.startswith("("), row))
    columns = sorted({said for _, said in cells}, key=lambda said: (said == "no name", said))
    cell, high, left, top = 26.0, 21.0, 190.0, 236.0
    x, y = (lambda column: left + 30 + cell * column), (lambda row: top + high * row)
    shapes = legend(list(COLOURS.values()))
    for j, said in enumerate(columns):
        shapes += [text(x(j) + 0.6 * cell, top - 8, said, turn="-60"), line(x(j), top, x(j), y(len(rows)), 0.6, PALE)]
    for i, row in enumerate(rows):
        shapes += [text(left, y(i) + 15, row, anchor="end"), text(left + 24, y(i) + 15, str(sizes[row]), anchor="end", fill="#777777"),
                   line(left + 30, y(i), x(len(columns)), y(i), 0.6, PALE)]
        for j, said in enumerate(columns):
            if not (all_judged := cells.get((row, said))):
                continue
            inside, at = [], x(j) + 1
            for kind, (_, colour) in COLOURS.items():
                if share := all_judged.count(kind) / len(all_judged):
                    inside.append(bar(at, y(i) + 1, share * (cell - 2), high - 2, colour))
                    at += share * (cell - 2)
            inside.append(text(x(j) + 0.5 * cell, y(i) + 15, str(len(all_judged)), anchor="middle"))
            shapes += group(f"{row} planted, {said}: {len(all_judged)} of {sizes[row]}", inside)
    below = "single effects and drives without any; rows: planted effects with their numbers of cases, columns: names"
    return picture(max(left + cell * len(columns) + 60, 760), top + high * len(rows) + 20, "Planted effects, and their names", below, shapes)


def power() -> str:
    """Share of single effects named right over their change of speed, for each base and all of them."""
    rows, (left, right), (top, bottom) = report["powers"], (76, 740), (92, 316)
    sizes = rows[0]["sizes"]
    height = lambda share: bottom - share * (bottom - top)
    middle = lambda k: left + (right - left) * (k + 0.5) / len(sizes)
    shapes = legend([(row["of"], colour) for row, colour in zip(rows, PALETTE)])
    for percent in range(0, 101, 20):
        shapes += [line(left, height(percent / 100), right, height(percent / 100), 0.8, PALE),
                   text(left - 6, height(percent / 100) + 4, str(percent), 11.5, "end")]
    shapes += [text(left - 44, (top + bottom) / 2, "named right [%]", 12.5, "middle", turn="-90"), line(left, bottom, right, bottom, 1, INK)]
    shapes += [text(middle(k), 334, f"{at['rms_mps']:g}", anchor="middle") for k, at in enumerate(sizes)]
    shapes.append(text((left + right) / 2, 352, "change of speed [m/s]", 12.5, "middle"))
    for i, (row, colour) in enumerate(zip(rows, PALETTE)):
        shown = [(middle(k) + 12 * (i - (len(rows) - 1) / 2), at) for k, at in enumerate(row["sizes"]) if at["cases"]]
        points = [(x, height(at["right"] / at["cases"])) for x, at in shown]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        shapes.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.4" stroke-linejoin="round"/>')
        for (x, y), (_, at) in zip(points, shown):
            ends = [height(end) for end in at["interval"]]
            shapes += group(f"{row['of']}, {at['rms_mps']:g} m/s: {at['right']} of {at['cases']}",
                            [line(x, ends[0], x, ends[1], 1.4, colour), f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.4" fill="{colour}"/>'])
    below = "single effects; root mean square change of the follower's speed [m/s]; bars: 95 % intervals"
    return picture(760, 360, "Share of effects that are named right, by their size", below, shapes)


old = page.read_text()
if not (old.count(BEGIN) == old.count(END) == 1 and old.index(BEGIN) < old.index(END)):
    sys.exit(f"{page}: expected the line {BEGIN} once, and the line {END} once below it; put both where the results belong")
images = page.parent / "images"
images.mkdir(exist_ok=True)
(images / "diagnosis_names.svg").write_text(names())
(images / "diagnosis_power.svg").write_text(power())
page.write_text(f"{old[:old.index(BEGIN)]}{BEGIN}\n\n{part()}\n\n{old[old.index(END):]}")
