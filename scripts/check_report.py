"""Opens HTML reports in a headless Chromium and uses them as a reader would: loads, zooms, hovers, sorts, walks by keyboard, prints.

    check_report.py [--screenshots DIR] PAGE=TWIN.json...

TWIN.json is the result that the page must carry; PAGE= alone checks a page whose twin has no file. Every finding is printed; the exit
status is 1 if there was one.
"""

import argparse
import csv
import json
import shutil
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, sync_playwright

WIDTHS = (1440, 360)
SCHEMES = ("light", "dark")
# Chromium asks the user about more downloads of one page.
DOWNLOADS = 8
# One report must fit into a mail.
LARGEST = 5_000_000
AXE = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"]
# Colours depend on the scheme and not on the width, everything else the other way round; contrast is what takes axe long.
COLOURS = ["color-contrast"]

# Per canvas: pixels that are not transparent, and distinct colours among them; an empty frame has few of both.
PIXELS = """() => [...document.querySelectorAll('.chart canvas')].map((canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const colours = new Set();
    let ink = 0;
    for (let i = 0; i < data.length; i += 4) {
        if (data[i + 3]) { ink += 1; colours.add((data[i] << 16) + (data[i + 1] << 8) + data[i + 2]); }
    }
    return { ink, colours: colours.size, width: canvas.width };
})"""
# What the canvases of the chart under test show, as one number each.
IMAGES = """(chart) => [...chart.querySelectorAll('canvas')].map((canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const words = new Uint32Array(data.buffer);
    let sum = 7;
    for (let i = 0; i < words.length; i += 1) sum = (Math.imul(sum, 31) + words[i]) | 0;
    return sum;
})"""
# What Chromium says about this test's reading of pixels, not about the page.
OWN_WARNING = "willReadFrequently"
VALUES = "(chart) => [...chart.querySelectorAll('.u-legend .u-value')].map((cell) => cell.textContent)"
OVERFLOW = """() => [...document.querySelectorAll('body *')].filter((element) => {
    const { right, width } = element.getBoundingClientRect();
    return width > 0 && right > innerWidth + 1 && !element.closest('.table, .svg, pre, .u-hz');
}).map((element) => `${element.tagName}.${element.className} "${element.textContent.slice(0, 40)}"`).slice(0, 5)"""



def signals(chooser) -> int:
    """How many signals the chosen option draws."""
    return chooser.evaluate("s => s.value.split(', ').length")


class Report:
    """One page at one width and scheme; findings are collected, not raised."""

    def __init__(self, browser, path: Path, width: int, scheme: str):
        self.name = f"{path.name} at {width} px, {scheme}"
        self.findings: list[str] = []
        self.context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce",
                                           has_touch=width == WIDTHS[-1])
        self.page: Page = self.context.new_page()
        # As in a Chromium of the locale C.
        self.page.add_init_script("Object.defineProperty(navigator, 'language', { value: 'en-US@posix', configurable: true })")
        address = path.resolve().as_uri()
        self.page.on("console", lambda m: self.said(m.type, m.text))
        self.page.on("pageerror", lambda e: self.found(f"error of a script: {e}"))
        outside = lambda url: url != address and not url.startswith(("data:", "blob:"))
        self.page.on("request", lambda r: outside(r.url.split("#")[0]) and self.found(f"asks for {r.url}"))
        self.page.goto(address)

    def said(self, kind: str, text: str) -> None:
        if kind in ("error", "warning") and OWN_WARNING not in text:
            self.found(f"console {kind}: {text}")

    def found(self, text: str) -> None:
        self.findings.append(f"{self.name}: {text}")

    def expect(self, good: bool, text: str) -> None:
        if not good:
            self.found(text)

    def drawn(self) -> None:
        charts = self.page.query_selector_all(".chart")
        pixels = self.page.evaluate(PIXELS)
        expected = sum(signals(self.choosers(chart)[1]) for chart in charts)
        self.expect(len(pixels) == expected, f"{expected} panels expected, {len(pixels)} are drawn")
        self.expect(self.page.query_selector(".chart.live") is None, "a legend shows values before the pointer is on it")
        for number, panel in enumerate(pixels):
            self.expect(panel["ink"] > 2000 and panel["colours"] > 5, f"panel {number} is empty: {panel}")

    def fits(self) -> None:
        wide, window = self.page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
        self.expect(wide <= window, f"is {wide} px wide; too far right: {self.page.evaluate(OVERFLOW)}")

    def zooms(self, every: bool) -> None:
        """Every chart, or the first one."""
        charts = self.page.query_selector_all(".chart")
        for number, chart in enumerate(charts if every else charts[:1]):
            name = self.name
            self.name = f"{name}, chart {number}"
            self.zooms_in(chart)
            self.name = name

    def zooms_in(self, chart) -> None:
        """Drag, double-click, keys: the chart follows."""
        over = chart.query_selector(".u-over")
        over.evaluate("area => area.scrollIntoView({ block: 'center' })")
        before = chart.evaluate(IMAGES)
        box = over.bounding_box()
        y = box["y"] + box["height"] / 2
        at = lambda share: box["x"] + share * box["width"]
        self.page.mouse.move(at(0.3), y)
        self.page.wait_for_timeout(60)
        values = chart.evaluate(VALUES)
        self.expect(all(v not in ("", "--", "–") for v in values), f"hovering shows no values: {values}")
        self.page.mouse.down()
        self.page.mouse.move(at(0.6), y, steps=4)
        self.page.mouse.up()
        self.page.wait_for_timeout(60)
        near = chart.evaluate(IMAGES)
        self.expect(all(a != b for a, b in zip(before, near)), "a drag does not zoom")
        self.page.mouse.dblclick(at(0.5), y)
        self.page.wait_for_timeout(60)
        self.expect(chart.evaluate(IMAGES) == before, "a double-click does not show all again")
        chart.focus()
        for keys, changed in (("+", True), ("ArrowRight", True), ("0", False)):
            self.page.keyboard.press(keys)
            self.page.wait_for_timeout(60)
            images = chart.evaluate(IMAGES)
            moved = all(a != b for a, b in zip(before, images)) if changed else images != before
            self.expect(moved == changed, f"key {keys}: panels {'did not follow' if changed else 'did not come back'}")

    def choosers(self, chart):
        """Those of the drive and of the signal."""
        return chart.evaluate_handle("chart => chart.parentElement").as_element().query_selector_all("select")

    def chooses(self) -> None:
        """Every drive and every signal of every chart is drawn."""
        for chart in self.page.query_selector_all(".chart"):
            drive, signal = self.choosers(chart)
            for d in range(drive.evaluate("s => s.options.length")):
                drive.evaluate("(s, k) => { s.selectedIndex = k; s.onchange(); }", d)
                for k in range(signal.evaluate("s => s.options.length")):
                    signal.evaluate("(s, k) => { s.selectedIndex = k; s.onchange(); }", k)
                    label = signal.evaluate("s => s.value")
                    shown = chart.evaluate("c => c.querySelectorAll('canvas').length")
                    self.expect(shown == signals(signal), f"choosing {label} draws {shown} panels")
            for select in (signal, drive):
                select.evaluate("s => { s.selectedIndex = 0; s.onchange(); }")

    def pinches(self) -> None:
        """Two fingers that part zoom the first chart."""
        chart = self.page.query_selector(".chart")
        if chart is None:
            return
        over = chart.query_selector(".u-over")
        over.evaluate("area => area.scrollIntoView({ block: 'center' })")
        before = chart.evaluate(IMAGES)
        box = over.bounding_box()
        y = box["y"] + box["height"] / 2
        session = self.context.new_cdp_session(self.page)
        fingers = lambda left, right: [{"x": box["x"] + share * box["width"], "y": y} for share in (left, right)]
        for kind, points in (("touchStart", fingers(0.4, 0.6)), ("touchMove", fingers(0.3, 0.7)), ("touchMove", fingers(0.2, 0.8)), ("touchEnd", [])):
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        self.page.wait_for_timeout(60)
        near = chart.evaluate(IMAGES)
        self.expect(all(a != b for a, b in zip(before, near)), "two fingers do not zoom every panel")
        chart.focus()
        self.page.keyboard.press("0")
        self.page.wait_for_timeout(60)
        self.expect(chart.evaluate(IMAGES) == before, "after two fingers, key 0 does not show all again")

    def sorts(self) -> None:
        """Every table, by its last column of numbers: rising, then falling."""
        for number, table in enumerate(self.page.query_selector_all("table")):
            rows = table.query_selector_all("tbody tr")
            buttons = table.query_selector_all("th button")
            if len(rows) < 2 or not buttons:
                continue
            column = len(buttons) - 1
            script = f"(t) => [...t.tBodies[0].rows].map((row) => row.cells[{column}].textContent)"
            orders = []
            for order in ("ascending", "descending"):
                buttons[column].click()
                head = buttons[column].evaluate("b => b.parentElement.getAttribute('aria-sort')")
                self.expect(head == order, f"table {number}: aria-sort is {head}, expected {order}")
                orders.append(table.evaluate(script))
            self.expect(sorted(orders[0]) == sorted(orders[1]), f"table {number}: sorting loses cells")
            if len(set(orders[0])) > 1:
                self.expect(orders[0] != orders[1], f"table {number}: the two orders are the same")
            if all(is_number(cell) for cell in orders[0]):
                values = [float(cell) for cell in orders[0]]
                self.expect(values == sorted(values), f"table {number}: numbers are not sorted as numbers: {values}")

    def filters(self) -> None:
        """Every long table: the rows with the first word of its last row, those without it, and all again."""
        for number, table in enumerate(self.page.query_selector_all(".table.long table")):
            field = table.query_selector("input[type=search]")
            if field is None:
                self.found(f"long table {number} has no filter")
                continue
            texts = table.evaluate("(t) => [...t.tBodies[0].rows].map((row) => row.textContent.toLowerCase())")
            word = texts[-1].split()[0][:6]
            expected = sum(word in text for text in texts)
            for typed, rows in ((word, expected), (f"-{word}", len(texts) - expected), ("", len(texts))):
                field.fill(typed)
                shown = table.evaluate("(t) => [...t.tBodies[0].rows].filter((row) => row.offsetHeight > 0).length")
                self.expect(shown == rows, f"long table {number}: `{typed}` shows {shown} rows, expected {rows}")

    def walks(self) -> None:
        """The Tab key reaches every chart, button and link of a page that was just loaded, and ends."""
        wanted = self.page.evaluate("document.querySelectorAll('.chart, button, summary, a[href]').length")
        script = """() => { const e = document.activeElement;
            if (!e || e === document.body) return null;
            const first = !e.dataset.reached; e.dataset.reached = 1;
            return first && e.matches('.chart, button, summary, a[href]') ? 1 : 0; }"""
        reached = 0
        for _ in range(3 * wanted + 50):
            self.page.keyboard.press("Tab")
            step = self.page.evaluate(script)
            if step is None:
                break
            reached += step
        self.expect(reached == wanted, f"Tab reaches {reached} of {wanted} charts, buttons and links")

    def tells(self) -> None:
        """Parts of pictures say what they are when pointed at."""
        part = self.page.query_selector(".svg g[aria-label]")
        if part is None:
            return
        # The middle of a box with an outlier is empty.
        shape = part.query_selector("rect, circle, path") or part
        shape.scroll_into_view_if_needed()
        shape.hover(force=True)
        tip = self.page.query_selector("#tip")
        self.expect(tip.is_visible() and tip.text_content() == part.get_attribute("aria-label"), "pointing at a picture tells nothing")
        self.page.mouse.move(1, 1)
        self.expect(not tip.is_visible(), "the text of a picture does not go away")

    def twin(self, expected: Path | None) -> None:
        carried = json.loads(self.page.text_content("#result"))
        if expected is not None:
            self.expect(carried == json.loads(expected.read_text()), f"does not carry {expected}")
        with self.page.expect_download() as download:
            self.page.click("#save")
        saved = json.loads(Path(download.value.path()).read_text())
        self.expect(saved == carried, "the saved JSON is not the one it carries")

    def saves(self) -> None:
        """Every picture, chart and table is saved as what its button says."""
        for number in range(len(self.page.query_selector_all(".files button"))):
            if number % DOWNLOADS == 0:
                self.page.reload()
            button = self.page.query_selector_all(".files button")[number]
            kind = button.text_content()
            what = button.get_attribute("aria-label")
            with self.page.expect_download() as download:
                button.click()
            content = Path(download.value.path()).read_bytes()
            self.expect(download.value.suggested_filename.endswith(f".{kind.lower()}"), f"{what}: is called {download.value.suggested_filename}")
            if kind == "SVG":
                root = ElementTree.fromstring(content)
                self.expect(root.tag.endswith("}svg") and len(root) > 1, f"{what}: the picture is empty")
            elif kind == "PNG":
                self.expect(content.startswith(b"\x89PNG") and len(content) > 2000, f"{what}: {len(content)} bytes are no picture")
            else:
                rows = list(csv.reader(content.decode().splitlines()))
                self.expect(len(rows) > 1 and len({len(row) for row in rows}) == 1, f"{what}: rows of different lengths, or none")
        tables = len(self.page.query_selector_all(".table table"))
        offered = len(self.page.query_selector_all("caption .files button"))
        self.expect(offered == tables, f"{offered} of {tables} tables can be saved")
        figures = len(self.page.query_selector_all("figure > .chart, figure > .svg"))
        offered = len(self.page.query_selector_all("figure > .files button"))
        self.expect(offered == 2 * figures, f"{offered} buttons under {figures} charts and pictures, expected two each")

    def accessible(self, axe: Axe, options: dict) -> None:
        for violation in axe.run(self.page, options=options).response["violations"]:
            nodes = violation["nodes"]
            where = "; ".join(f"{' '.join(map(str, n['target']))}: {n.get('failureSummary', '').splitlines()[-1].strip()}" for n in nodes[:3])
            self.found(f"axe {violation['id']} ({violation['impact']}, {len(nodes)} places): {where}")

    def prints(self) -> None:
        self.page.emulate_media(media="print")
        self.page.set_viewport_size({"width": 700, "height": 900})
        self.page.wait_for_timeout(250)
        wide = self.page.evaluate("document.documentElement.scrollWidth")
        self.expect(wide <= 700, f"is {wide} px wide on paper of 700 px")
        self.drawn()


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def check(browser, axe: Axe, path: Path, twin: Path | None, screenshots: Path | None) -> list[str]:
    findings = []
    size = path.stat().st_size
    if size > LARGEST:
        findings.append(f"{path.name}: {size} bytes, more than {LARGEST}")
    for scheme in SCHEMES:
        for width in WIDTHS:
            report = Report(browser, path, width, scheme)
            first = (scheme, width) == (SCHEMES[0], WIDTHS[0])
            report.drawn()
            report.fits()
            if screenshots is not None:
                report.page.screenshot(path=screenshots / f"{path.stem}_{width}_{scheme}.png", full_page=True)
                if first:
                    report.page.pdf(path=screenshots / f"{path.stem}.pdf", format="A4")
            if first:
                report.walks()
            if first:
                report.accessible(axe, {"runOnly": AXE})
            elif scheme == SCHEMES[0]:
                report.accessible(axe, {"runOnly": AXE, "rules": {rule: {"enabled": False} for rule in COLOURS}})
            elif width == WIDTHS[0]:
                report.accessible(axe, {"runOnly": {"type": "rule", "values": COLOURS}})
            if scheme == SCHEMES[0]:
                report.chooses()
                report.zooms(every=first)
                if width == WIDTHS[-1]:
                    report.pinches()
            if first:
                report.sorts()
                report.filters()
                report.tells()
                report.twin(twin)
                report.saves()
                report.prints()
            report.context.close()
            findings += report.findings
    return findings


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--screenshots", type=Path, metavar="DIR")
    parser.add_argument("pages", nargs="+", metavar="PAGE=TWIN.json")
    arguments = parser.parse_args()
    if arguments.screenshots is not None:
        arguments.screenshots.mkdir(parents=True, exist_ok=True)
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next((path for path in map(shutil.which, names) if path), None)
    if program is None:
        print(f"no browser found: looked for {', '.join(names)}", file=sys.stderr)
        return 1
    findings = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program)
        print(f"{program} {browser.version}")
        axe = Axe()
        for page in arguments.pages:
            path, _, twin = page.partition("=")
            started = time.monotonic()
            own = check(browser, axe, Path(path), Path(twin) if twin else None, arguments.screenshots)
            took = time.monotonic() - started
            print(f"{path}: {len(own)} findings ({len(SCHEMES) * len(WIDTHS)} views, {took:.1f} s)")
            findings += own
        browser.close()
    for finding in findings:
        print(f"FOUND {finding}")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
