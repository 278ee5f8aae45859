"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  // Height of what is drawn; the last panel has numbers and a name below it, too.
  const HEIGHT = 150, NUMBERS = 32, NAME = 20;

  // One plot per panel; those of one chart share cursor and zoom.
  function draw(place, chart, number) {
    place.textContent = "";
    const axis = () => ({ stroke: colour("ink"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line") } });
    const plots = [];
    let zooming = false;
    const zoomAll = (from, min, max) => {
      if (zooming) return;
      zooming = true;
      plots.filter((plot) => plot !== from).forEach((plot) => plot.setScale("x", { min, max }));
      zooming = false;
    };
    chart.panels.forEach((panel, k) => {
      const last = k + 1 === chart.panels.length;
      const options = {
        width: Math.max(place.clientWidth, 200),
        height: HEIGHT + (last ? NUMBERS + NAME : 10),
        scales: { x: { time: false } },
        cursor: { sync: { key: "chart" + number }, drag: { x: true, y: false }, ...(chart.points ? { dataIdx: nearest } : {}) },
        axes: [
          last ? { ...axis(), label: chart.x_label, labelSize: NAME, size: NUMBERS } : { ...axis(), values: () => [], size: 10 },
          { ...axis(), label: panel.label, labelSize: 20, size: 56 },
        ],
        series: [{ label: chart.x_label, value: (_, x) => (x === null ? "–" : String(+x.toPrecision(6))) }].concat(panel.lines.map((line) => ({
          label: line.name, stroke: colour(line.role), width: line.role === "context" ? 1 : 1.5,
          points: chart.points ? { show: true, size: 5, fill: colour(line.role) } : { show: false },
          value: (_, y) => (y === null || y === undefined ? "–" : String(+y.toPrecision(4))),
        }))),
        hooks: { setScale: [(plot, key) => { if (key === "x") zoomAll(plot, plot.scales.x.min, plot.scales.x.max); }] },
      };
      plots.push(new uPlot(options, [chart.x].concat(panel.lines.map((line) => line.values)), place));
    });
    const [first, end] = [chart.x[0], chart.x[chart.x.length - 1]];
    const show = (middle, half) => plots[0].setScale("x", { min: Math.max(first, middle - half), max: Math.min(end, middle + half) });
    touch(place, plots[0], show);
    // Keys: left and right move, plus and minus zoom, 0 shows all.
    place.onkeydown = (event) => {
      const { min, max } = plots[0].scales.x;
      const [middle, half] = [(min + max) / 2, (max - min) / 2];
      const keys = {
        ArrowLeft: () => show(Math.max(first + half, middle - half / 2), half),
        ArrowRight: () => show(Math.min(end - half, middle + half / 2), half),
        "+": () => show(middle, half / 2), "-": () => show(middle, half * 2), 0: () => show((first + end) / 2, (end - first) / 2),
      };
      if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
    };
    return plots;
  }

  // The class beside the pointer, where the one under it has no values.
  function nearest(plot, series, index) {
    const values = plot.data[Math.max(series, 1)];
    for (let away = 0; away < values.length; away += 1) {
      const found = [index - away, index + away].find((i) => values[i] !== null && values[i] !== undefined);
      if (found !== undefined) return found;
    }
    return index;
  }

  // Two fingers: what is under each of them stays there.
  function touch(place, plot, show) {
    const fingers = new Map();
    let held = null;
    const at = (x) => plot.posToVal(x - plot.over.getBoundingClientRect().left, "x");
    const span = () => [...fingers.values()].sort((a, b) => a - b);
    place.onpointerdown = (event) => {
      if (event.pointerType !== "touch") return;
      fingers.set(event.pointerId, event.clientX);
      held = fingers.size === 2 ? span().map(at) : null;
    };
    place.onpointermove = (event) => {
      if (!fingers.has(event.pointerId)) return;
      fingers.set(event.pointerId, event.clientX);
      const [left, right] = span();
      if (!held || right - left < 20) return;
      const { left: edge, width } = plot.over.getBoundingClientRect();
      const size = (held[1] - held[0]) / (right - left);
      const min = held[0] - (left - edge) * size;
      show(min + (width * size) / 2, (width * size) / 2);
    };
    place.onpointerup = place.onpointercancel = (event) => {
      fingers.delete(event.pointerId);
      held = null;
    };
  }

  const charts = read("charts");
  const places = [...document.querySelectorAll(".chart")];
  let drawn = [];
  const all = () => {
    drawn.flat().forEach((plot) => plot.destroy());
    drawn = places.map((place) => draw(place, charts[Number(place.dataset.chart)], place.dataset.chart));
  };
  all();
  let waiting = 0;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => drawn.forEach((plots, i) => plots.forEach((plot) =>
      plot.setSize({ width: Math.max(places[i].clientWidth, 200), height: plot.height }))), 100);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", all);
  // Paper is narrower and white: what is printed is drawn again for it.
  matchMedia("print").addEventListener("change", all);

  // A click on a heading sorts its table.
  const key = (cell) => {
    const number = parseFloat(cell.textContent.replace("−", "-").replace(/^\(/, ""));
    return Number.isNaN(number) ? cell.textContent : number;
  };
  const order = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b)));
  document.querySelectorAll("th button").forEach((button) => button.addEventListener("click", () => {
    const head = button.parentElement;
    const rising = head.getAttribute("aria-sort") !== "ascending";
    [...head.parentElement.children].forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", rising ? "ascending" : "descending");
    const [column, body] = [head.cellIndex, head.closest("table").tBodies[0]];
    const rows = [...body.rows].sort((a, b) => order(key(a.cells[column]), key(b.cells[column])) * (rising ? 1 : -1));
    body.append(...rows);
  }));

  // Long tables show only the rows that have all the words asked for, and none with a minus before it.
  document.querySelectorAll(".table.long").forEach((box) => {
    const table = box.querySelector("table");
    const rows = [...table.tBodies[0].rows];
    const label = document.createElement("label");
    label.innerHTML = '<span>rows with</span> <input type="search" placeholder="words, -without"> <output></output>';
    table.caption.append(label);
    const texts = rows.map((row) => row.textContent.toLowerCase());
    const fits = (text) => (word) => (word.length > 1 && word[0] === "-" ? !text.includes(word.slice(1)) : text.includes(word));
    label.querySelector("input").addEventListener("input", (event) => {
      const words = event.target.value.toLowerCase().split(/\s+/);
      rows.forEach((row, i) => { row.hidden = !words.every(fits(texts[i])); });
      const shown = rows.filter((row) => !row.hidden).length;
      label.querySelector("output").textContent = shown < rows.length ? shown + " of " + rows.length : "";
    });
  });

  // What a part of a picture says about itself: at once, and on touch screens, too; without scripts the browser shows it after a while.
  const tip = document.createElement("div");
  tip.id = "tip";
  tip.hidden = true;
  document.body.append(tip);
  document.querySelectorAll(".svg g > title").forEach((title) => {
    const part = title.parentElement;
    part.setAttribute("aria-label", title.textContent);
    part.setAttribute("role", "img");
    title.remove();
    const show = (event) => {
      tip.textContent = part.getAttribute("aria-label");
      tip.hidden = false;
      const { offsetWidth: width, offsetHeight: height } = tip;
      tip.style.left = Math.max(4, Math.min(event.clientX + 12, innerWidth - width - 8)) + "px";
      tip.style.top = (event.clientY > height + 24 ? event.clientY - height - 12 : event.clientY + 16) + "px";
    };
    part.addEventListener("pointermove", show);
    part.addEventListener("pointerdown", show);
    part.addEventListener("pointerleave", () => { tip.hidden = true; });
  });

  document.getElementById("save").addEventListener("click", () => {
    const text = document.getElementById("result").textContent;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    link.download = "result.json";
    link.click();
    URL.revokeObjectURL(link.href);
  });
})();
