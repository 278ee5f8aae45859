"""Python and the command line give the same results, to the bit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import run

import leadlag as ll

FEW = {"max_evaluations": 3000, "progress": False}


def results(text: str) -> dict[str, Any]:
    """A result without the source of the data."""
    result = json.loads(text)
    for data in result["data"]:
        del data["path"], data["sha256"]
    return result


@pytest.mark.parametrize("model", ["idm", "gipps+delay+linear"])
def test_a_calibration(pair: Path, tmp_path: Path, model: str) -> None:
    words = ["calibrate", str(pair), "--model", model, "--seed", "3", "--max-evaluations", "3000", "--out", str(tmp_path)]
    run(*words)
    told = (tmp_path / "result.json").read_text()
    fit = ll.calibrate(ll.read(pair), model, seed=3, **FEW)
    assert fit.to_json() == told
    frames = pytest.importorskip("pandas")
    frame = frames.read_csv(pair)
    assert results(ll.calibrate(ll.Drive(frame), model, seed=3, **FEW).to_json()) == results(told)
    arrays = {name: frame[name].to_numpy() for name in frame.columns}
    assert results(ll.calibrate(ll.Drive(arrays), model, seed=3, **FEW).to_json()) == results(told)
    fit.save(tmp_path / "saved")
    for name in ("result.json", "simulation.csv", "plot.svg"):
        assert (tmp_path / "saved" / name).read_bytes() == (tmp_path / name).read_bytes(), name


LAW = """struct Parameters {
    v_0: f32,
    d_0: f32,
    t_h: f32,
    /// gain for the spacing [1/s2], 0.01 to 1
    gain: f32,
}

fn mine_law(own: Parameters, x: Perceived) -> f32 {
    return min(own.gain * (x.s - own.d_0 - own.t_h * x.v_f) + 0.5 * (x.v_l - x.v_f), own.v_0 - x.v_f);
}
"""


def test_a_law_of_ones_own(pair: Path, tmp_path: Path) -> None:
    file = tmp_path / "mine.wgsl"
    file.write_text(LAW)
    words = ["--model", f"{file}+delay", "--max-evaluations", "3000", "--out", str(tmp_path / "out")]
    run("calibrate", str(pair), *words)
    told = (tmp_path / "out" / "result.json").read_text()
    drive = ll.read(pair)
    assert ll.calibrate(drive, ll.Model(LAW, parts="delay"), **FEW).to_json() == told
    assert ll.calibrate(drive, f"{file}+delay", **FEW).to_json() == told
    assert list(ll.Evaluator(drive, ll.Model(LAW)).parameters) == ["v_0", "d_0", "t_h", "gain"]
    assert repr(ll.Model(LAW, parts="delay")) == "Model(mine+delay)"
    with pytest.raises(ll.UsageError, match="no function NAME_law"):
        ll.Model("fn mine_command(a: f32) -> f32 {\n    return a;\n}")
    findings = ll.diagnose(drive, base=ll.Model(LAW), effort="quick", progress=False)
    assert "mine" in findings.to_json()


def test_polars_and_arrow(pair: Path) -> None:
    polars = pytest.importorskip("polars")
    frame = polars.read_csv(pair)
    drives = [ll.Drive(frame)]
    try:
        drives.append(ll.Drive(frame.to_arrow()))
    except ModuleNotFoundError:
        pass
    for drive in drives:
        assert np.array_equal(drive.speed, ll.read(pair).speed)
        assert np.array_equal(drive.time, ll.read(pair).time)


def test_several_drives_and_bounds(folder: Path, tmp_path: Path) -> None:
    files = [str(folder / f"drive{seed}" / "pair_follower2.csv") for seed in (1, 2)]
    run("calibrate", *files, "--joint", "--model", "idm", "--bounds", "human", "--fix", "delta=4", "--max-evaluations",
        "3000", "--no-intervals", "--out", str(tmp_path))  # fmt: skip
    drives = [ll.read(file) for file in files]
    fit = ll.calibrate(drives, "idm", bounds="human", fix={"delta": 4}, intervals=False, **FEW)
    assert fit.to_json() == (tmp_path / "result.json").read_text()
    assert fit.intervals == {}


def test_a_fleet(folder: Path, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    run("calibrate", str(folder / "drive1"), "--all", "--model", "idm", "--model", "gipps", "--out", str(tmp_path))
    told = pandas.read_csv(tmp_path / "parameters.csv", float_precision="round_trip")
    found = ll.calibrate_all(folder / "drive1", ["idm", "gipps"], progress=False)
    assert list(found.columns) == list(told.columns)
    for name in told.columns:
        same = [(a == b) or (a != a or a is None) and (b != b or b is None) for a, b in zip(found[name], told[name])]
        assert all(same), name
    drives = [ll.read(path) for path in sorted((folder / "drive1").glob("pair_*.csv"))]
    own = ll.calibrate_all(drives, ["idm", "gipps"], progress=False)
    assert np.array_equal(own["score"], [s for s, file in zip(found["score"], found["file"]) if "pair_" in file])


def test_a_diagnosis(folder: Path, tmp_path: Path) -> None:
    files = [str(tmp_path / f"{seed}.csv") for seed in (1, 2)]
    for seed, file in zip((1, 2), files):
        lines = [line.split(",") for line in (folder / f"drive{seed}" / "pair_follower1.csv").read_text().splitlines()]
        grade = lines[0].index("sin_grade")
        Path(file).write_text("".join(",".join(cells[:grade] + cells[grade + 1 :]) + "\n" for cells in lines))
    out = run("diagnose", *files, "--base", "l-cth", "--effort", "quick", "--json")
    assert "give --grade FILE" in out, "an option in a text of the file"
    findings = ll.diagnose([ll.read(file) for file in files], base="l-cth", effort="quick", progress=False)
    assert findings.to_json() == out
    assert findings.verdict == json.loads(out)["verdict"]
    page = findings.report(tmp_path / "page.html")
    assert page.read_text().startswith("<!doctype html>")


def test_a_diagnosis_of_a_fleet() -> None:
    drives = [ll.synthetic(seed, 40) for seed in range(12)]
    findings = ll.diagnose_all(drives, base="l-cth", effort="quick", progress=False)
    fleet = json.loads(findings.to_json())["fleet"]
    assert (fleet["drivers"], fleet["drives"], fleet["unusable"]) == (12, 12, [])
    assert findings.verdict in ("named", "ambiguous", "nothing", "unexplained")
    few = ll.diagnose_all(drives[:3], base="l-cth", effort="quick", progress=False)
    assert few.verdict == "not_testable" and "found 3" in few.reason
