"""Pictures and pages: nothing here is needed to compute."""

from __future__ import annotations

import base64
import html
import tempfile
from pathlib import Path
from typing import Any

from . import _native


class Page:
    """A page that a notebook shows in a frame."""

    def __init__(self, text: str) -> None:
        self.text = text

    def _repr_html_(self) -> str:
        whole = html.escape(self.text, quote=True)
        return f'<iframe srcdoc="{whole}" style="width:100%;height:40rem;border:1px solid #ccc"></iframe>'

    def __repr__(self) -> str:
        return f"<page of {len(self.text) // 1000} kB; give a path to write it to a file>"


def report(what: Any, main: str, path: Path | None) -> Page | Path:
    """The page of a fit or of findings."""
    with tempfile.TemporaryDirectory() as folder:
        what.save(folder)
        text = _native.page(Path(folder) / main)
    if path is None:
        return Page(text)
    path = Path(path)
    path.write_text(text, encoding="utf-8")
    return path


def fit_html(fit: _native.Fit) -> str:
    """Parameters as a table, and the picture of the first drive."""
    rows = []
    for name, value in fit.parameters.items():
        interval = fit.intervals.get(name)
        known = f"{interval[0]:.4g} to {interval[1]:.4g}" if interval else ""
        bound = "at bound" if name in fit.at_bound else ""
        cells = (name, f"{value:.4g}", fit.units.get(name, ""), known, bound)
        rows.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
    picture = fit._picture()
    image = ""
    if picture is not None:
        data = base64.b64encode(picture.encode()).decode()
        title = f"spacing, speed and acceleration, measured and simulated by {fit.model}"
        image = f'<img alt="{html.escape(title)}" style="max-width:100%" src="data:image/svg+xml;base64,{data}">'
    head = "".join(f"<th>{name}</th>" for name in ("parameter", "value", "unit", "95 % interval", ""))
    return (
        f"<p><b>{html.escape(fit.model)}</b>, score {fit.score:.4f}</p>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>{image}"
    )


def findings_html(findings: _native.Findings) -> str:
    """The verdict with its reason, what is recommended, and the whole answer to unfold."""
    recommended = ", ".join(findings.recommended) or "nothing"
    return (
        f"<p><b>{html.escape(findings.verdict)}</b>: {html.escape(findings.reason)}</p>"
        f"<p>recommended: {html.escape(recommended)}</p>"
        f"<details><summary>the whole answer</summary><pre>{html.escape(findings.text)}</pre></details>"
    )


def drive_plot(drive: _native.Drive) -> Any:
    """Spacing and both speeds over time; a matplotlib figure."""
    import matplotlib.pyplot as plt

    figure, (spacing, speed) = plt.subplots(2, 1, sharex=True, figsize=(6.4, 4.8), layout="constrained")
    spacing.plot(drive.time, drive.spacing, color="black", linewidth=1.2)
    spacing.set_ylabel("spacing [m]")
    spacing.set_title(drive.label)
    speed.plot(drive.time, drive.lead_speed, color="#0072b2", linewidth=1, label="vehicle ahead")
    speed.plot(drive.time, drive.speed, color="black", linewidth=1.2, label="follower")
    speed.set_ylabel("speed [m/s]")
    speed.set_xlabel("time [s]")
    speed.legend()
    return figure


def plot(fit: _native.Fit) -> Any:
    """Spacing, speed and acceleration of every drive of the fit, measured and simulated; a matplotlib figure."""
    import matplotlib.pyplot as plt
    import numpy as np

    drives = fit.drives
    size = (6.4 * len(drives), 6.4)
    figure, axes = plt.subplots(3, len(drives), sharex="col", squeeze=False, figsize=size, layout="constrained")
    for column, drive in enumerate(drives):
        simulation = fit.simulate(drive)
        measured = (drive.spacing, drive.speed, np.gradient(drive.speed, drive.time_step))
        simulated = (simulation.spacing, simulation.speed, simulation.acceleration)
        for row, label in enumerate(("spacing [m]", "speed [m/s]", "acceleration [m/s²]")):
            axis = axes[row][column]
            axis.plot(drive.time, measured[row], color="black", linewidth=1.2, label="measured")
            axis.plot(simulation.time, simulated[row], color="#d55e00", linewidth=1, label=fit.model)
            axis.set_ylabel(label)
        axes[0][column].set_title(drive.label)
        axes[2][column].set_xlabel("time [s]")
    axes[0][0].legend()
    return figure


def forest(drivers: list[str], parameters: dict[str, tuple[Any, Any, Any]], title: str) -> Any:
    """A panel per parameter with a row per driver: value and ends of the interval; a matplotlib figure."""
    import matplotlib.pyplot as plt
    import numpy as np

    size = (2.2 * max(len(parameters), 1), 1.2 + 0.2 * len(drivers))
    figure, axes = plt.subplots(1, max(len(parameters), 1), sharey=True, squeeze=False, figsize=size, layout="constrained")
    rows = np.arange(len(drivers))
    for axis, (name, of) in zip(axes[0], parameters.items()):
        value, low, high = (np.asarray(each, float) for each in of)
        known = np.isfinite(low) & np.isfinite(high)
        axis.hlines(rows[known], low[known], high[known], color="#0072b2", linewidth=1.5)
        axis.plot(value[known], rows[known], "o", color="#0072b2", markersize=4)
        axis.plot(value[~known], rows[~known], "o", color="#0072b2", markersize=4, fillstyle="none")
        axis.set_xlabel(name)
    axes[0][0].set_yticks(rows, drivers)
    axes[0][0].invert_yaxis()
    figure.suptitle(title)
    return figure
