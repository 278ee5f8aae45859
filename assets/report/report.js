"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  // Of a signal by itself, and of several one below the other.
  const [HEIGHT, BELOW] = [340, 210];
  // So many signals are drawn together: spacing, speed and acceleration, or their errors.
  const TOGETHER = 3;
  const height = (count) => (count > 1 ? BELOW : HEIGHT);

  // Signals of one chart, one below the other, with one cursor and one span of time; what is zoomed to stays where it is.
  function draw(place, chart, panels, zoomed) {
    place.textContent = "";
    const plots = [];
    const show = (min, max) => plots.forEach((plot) => plot.setScale("x", { min, max }));
    // A scale that changes is that of the others, too; one that is the same already ends it.
    const follow = ({ scales: { x: { min, max } } }, scale) => {
      if (scale === "x" && plots.some(({ scales: { x } }) => x.min !== min || x.max !== max)) show(min, max);
    };
    const key = uPlot.sync(place.dataset.chart).key;
    panels.forEach((panel, i) => plots.push(one(place, chart, panel, height(panels.length), i === panels.length - 1, key, follow)));
    const [first, end] = [chart.x[0], chart.x[chart.x.length - 1]];
    const around = (middle, half) => show(Math.max(first, middle - half), Math.min(end, middle + half));
    if (zoomed) show(zoomed.min, zoomed.max);
    touch(place, plots, around);
    // Keys: left and right move, plus and minus zoom, 0 shows all.
    place.onkeydown = (event) => {
      const { min, max } = plots[0].scales.x;
      const [middle, half] = [(min + max) / 2, (max - min) / 2];
      const keys = {
        ArrowLeft: () => around(Math.max(first + half, middle - half / 2), half),
        ArrowRight: () => around(Math.min(end - half, middle + half / 2), half),
        "+": () => around(middle, half / 2), "-": () => around(middle, half * 2), 0: () => show(first, end),
      };
      if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
    };
    return plots;
  }

  // One signal.
  function one(place, chart, panel, height, last, key, follow) {
    const axis = () => ({ stroke: colour("ink"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line") } });
    const options = {
      class: chart.points ? "points" : "lines",
      width: Math.max(place.clientWidth, 200),
      height,
      scales: { x: { time: false } },
      cursor: { drag: { x: true, y: false }, sync: { key, scales: ["x", null] }, ...(chart.points ? { dataIdx: nearest } : {}) },
      axes: [{ ...axis(), label: last ? chart.x_label : null, labelSize: 20, size: 32 }, { ...axis(), label: panel.label, labelSize: 20, size: 56 }],
      series: [{ label: chart.x_label, value: (_, x) => (x === null ? "" : String(+x.toPrecision(6))) }].concat(panel.lines.map((line) => ({
        label: line.name, stroke: colour(line.role), width: line.role === "context" ? 1 : 1.5,
        points: chart.points ? { show: true, size: 5, fill: colour(line.role) } : { show: false },
        value: (_, y) => (y === null || y === undefined ? "" : String(+y.toPrecision(4))),
      }))),
      // Until the pointer is on the chart its legend has names only.
      hooks: {
        setCursor: [(plot) => place.classList.toggle("live", plot.cursor.idx !== null && plot.cursor.left >= 0)],
        setScale: [follow],
      },
    };
    return new uPlot(options, [chart.x].concat(panel.lines.map((line) => line.values)), place);
  }

  // A place with its choosers: which drive or the like, which signal.
  function figure(place) {
    const mine = place.dataset.chart.split(" ").map((number) => charts[Number(number)]);
    const bar = place.parentElement.querySelector(".choose");
    const [drive, signal] = [bar.dataset.of, "signal"].map((name) => {
      const label = document.createElement("label");
      const select = document.createElement("select");
      label.append(name + " ", select);
      bar.append(label);
      return select;
    });
    const fill = (select, names) => {
      const kept = Math.min(Math.max(select.selectedIndex, 0), names.length - 1);
      select.replaceChildren(...names.map((name) => new Option(name)));
      select.selectedIndex = kept;
      select.parentElement.hidden = names.length < 2;
    };
    const own = { plots: [], shown: () => mine[drive.selectedIndex] };
    // What can be chosen of a chart: signals together, where there are enough, and each by itself.
    const choices = (chart) => {
      const sets = [];
      for (let i = 0; i + TOGETHER <= chart.panels.length; i += TOGETHER) sets.push(chart.panels.slice(i, i + TOGETHER));
      return sets.concat(chart.panels.map((panel) => [panel]));
    };
    const named = (panels) => panels.map((panel) => panel.label).join(", ");
    own.draw = (zoomed) => {
      own.plots.forEach((plot) => plot.destroy());
      const chart = mine[drive.selectedIndex];
      own.plots = draw(place, chart, choices(chart)[signal.selectedIndex], zoomed);
    };
    const chosen = () => fill(signal, choices(mine[drive.selectedIndex]).map(named));
    fill(drive, mine.map((chart) => chart.title));
    chosen();
    drive.onchange = () => { chosen(); own.draw(); };
    signal.onchange = () => { const { min, max } = own.plots[0].scales.x; own.draw({ min, max }); };
    own.draw();
    return own;
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
  function touch(place, plots, show) {
    const fingers = new Map();
    let held = null;
    const [plot] = plots;
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
  const figures = places.map(figure);
  const again = () => figures.forEach((own) => own.draw());
  let waiting = 0;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => figures.forEach((own, i) => own.plots.forEach((plot) =>
      plot.setSize({ width: Math.max(places[i].clientWidth, 200), height: height(own.plots.length) }))), 100);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  // Paper is narrower and white: what is printed is drawn again for it.
  matchMedia("print").addEventListener("change", again);

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

  function save(name, blob) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    // A browser may begin to read it after the click.
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  // Buttons that save a picture, chart or table; `files` has a function per ending, which makes the content or a promise of it.
  function offer(place, title, files) {
    const bar = document.createElement("span");
    bar.className = "files";
    Object.entries(files).forEach(([ending, content]) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = ending.toUpperCase();
      button.setAttribute("aria-label", `save as ${button.textContent}: ${title}`);
      const name = title.toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^_|_$/g, "") || "picture";
      button.addEventListener("click", async () => save(`${name}.${ending}`, new Blob([await content()])));
      bar.append(button);
    });
    place.append(bar);
  }
  const csv = (rows) => rows.map((row) => row.map((cell) => (/[",\n]/.test(cell) ? `"${String(cell).replaceAll('"', '""')}"` : cell ?? "")).join(",") + "\n").join("");
  const png = (canvas) => new Promise((done) => canvas.toBlob(done));
  // A canvas of this size on paper, for saved pictures are put into documents.
  function paper(width, height) {
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    const context = canvas.getContext("2d");
    context.fillStyle = colour("paper");
    context.fillRect(0, 0, width, height);
    return [canvas, context];
  }
  document.querySelectorAll("figure > .svg").forEach((box) => {
    const picture = box.querySelector("svg");
    const text = () => new XMLSerializer().serializeToString(picture);
    // Twice the size, so that it is sharp in print.
    const drawn = async () => {
      const image = new Image();
      image.src = "data:image/svg+xml," + encodeURIComponent(text());
      await image.decode();
      const { width, height } = picture.viewBox.baseVal;
      const [canvas, context] = paper(2 * width, 2 * height);
      context.drawImage(image, 0, 0, canvas.width, canvas.height);
      return png(canvas);
    };
    offer(box.parentElement, box.getAttribute("aria-label"), { svg: text, png: drawn });
  });
  places.forEach((place, i) => {
    const own = figures[i];
    const drawn = () => {
      const parts = own.plots.map((plot) => plot.ctx.canvas);
      const [canvas, context] = paper(Math.max(...parts.map((part) => part.width)), parts.reduce((sum, part) => sum + part.height, 0));
      let top = 0;
      parts.forEach((part) => { context.drawImage(part, 0, top); top += part.height; });
      return png(canvas);
    };
    const values = () => {
      const { x_label: time, x, panels } = own.shown();
      const lines = panels.flatMap((panel) => panel.lines.map((line) => [`${panel.label}: ${line.name}`, line.values]));
      return csv([[time, ...lines.map(([name]) => name)], ...x.map((at, row) => [at, ...lines.map(([, of]) => of[row])])]);
    };
    offer(place.parentElement, place.getAttribute("aria-label"), { png: drawn, csv: values });
  });
  document.querySelectorAll(".table table").forEach((table) => {
    const cells = (row) => [...row.cells].map((cell) => cell.textContent);
    offer(table.caption, table.caption.textContent, { csv: () => csv([...table.rows].map(cells)) });
  });

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

  // What scrolls fades out at the side where more follows.
  document.querySelectorAll(".table, .svg").forEach((box) => {
    const tell = () => {
      box.classList.toggle("more-right", box.scrollLeft + box.clientWidth < box.scrollWidth - 2);
      box.classList.toggle("more-below", box.scrollTop + box.clientHeight < box.scrollHeight - 2);
    };
    box.addEventListener("scroll", tell, { passive: true });
    new ResizeObserver(tell).observe(box);
    tell();
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

  document.getElementById("save").addEventListener("click", () =>
    save("result.json", new Blob([document.getElementById("result").textContent], { type: "application/json" })));
})();
