"""What can be done with a drive, a fit and findings."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leadlag as ll

FEW: dict[str, Any] = {"max_evaluations": 3000, "progress": False}


@pytest.fixture(scope="module")
def drive(pair: Path) -> ll.Drive:
    return ll.read(pair)


@pytest.fixture(scope="module")
def fit(drive: ll.Drive) -> ll.Fit:
    return ll.calibrate(drive, "idm", fix={"delta": 4}, **FEW)


def test_a_summary_has_a_row_per_parameter(fit: ll.Fit) -> None:
    pytest.importorskip("pandas")
    summary = fit.summary()
    assert list(summary.index) == list(fit.parameters)
    assert list(summary.columns) == ["value", "unit", "low", "high", "at_bound", "determined"]
    assert dict(summary["value"]) == fit.parameters and dict(summary["unit"]) == fit.units
    for name, row in summary.iterrows():
        assert (row["low"], row["high"]) == fit.intervals.get(name, (row["low"], row["high"]))
        assert np.isnan(row["low"]) == (name not in fit.intervals)
        assert row["at_bound"] == (name in fit.at_bound)
    assert summary["determined"]["delta"] is None or np.isnan(summary["determined"]["delta"])
    assert bool(summary["determined"]["t_h"]) == ("t_h" in fit.intervals)


def test_numbers_of_a_fit(fit: ll.Fit, drive: ll.Drive) -> None:
    pytest.importorskip("pandas")
    result = fit.to_dict()
    assert result["parameters"] == fit.parameters and result["schema_version"] >= 1
    assert 0 < fit.evaluations == result["evaluations"] <= 3000
    scores = fit.simulate(drive).scores
    assert fit.rmse == pytest.approx({signal: scores[f"rmse_{signal}"] for signal in "sva"})
    correlation, covariance = fit.correlation, fit.covariance
    assert list(correlation.index) == list(correlation.columns) and "delta" not in correlation
    assert np.allclose(np.diag(correlation), 1) and np.allclose(correlation, correlation.T)
    for name in covariance:
        low, high = fit.intervals.get(name, (np.nan, np.nan))
        assert np.isclose(covariance[name][name], ((high - low) / 3.92) ** 2, equal_nan=True)
    none = ll.calibrate(drive, "idm", intervals=False, **FEW)
    assert none.correlation is None and none.covariance is None and none.summary()["determined"].isna().all()
    assert fit.predict(drive).scores == scores
    assert ll.Fit(fit.to_json()).parameters == fit.parameters


def test_a_drive_as_a_table(drive: ll.Drive) -> None:
    pytest.importorskip("pandas")
    frame = drive.to_pandas()
    assert list(frame.columns) == ["time_s", "lead_speed_mps", "speed_mps", "spacing_m"]
    assert np.array_equal(ll.Drive(frame).spacing, drive.spacing)


def test_a_drive_is_sliced_by_time(drive: ll.Drive) -> None:
    part = drive[20:80]
    inside = (drive.time >= 20) & (drive.time <= 80)
    assert np.array_equal(part.time, drive.time[inside]) and np.array_equal(part.speed, drive.speed[inside])
    assert np.allclose(part.spacing, drive.spacing[inside], atol=0.1)
    again = pickle.loads(pickle.dumps(part))
    assert np.array_equal(again.spacing, part.spacing) and len(again) == len(part)
    assert len(drive[:]) == len(drive) and drive[:50].time[-1] <= 50 <= drive[50:].time[0]
    assert np.array_equal(drive[20:80][30:60].time, drive[30:60].time)
    assert len(drive[-1000:10_000]) == len(drive)
    for wrong in (3, slice(10, 60, 2), "a"):
        with pytest.raises(TypeError, match=r"drive\[10:60\]"):
            drive[wrong]  # type: ignore[index]
    with pytest.raises(ll.Error):
        drive[60:10]
    with pytest.raises(ll.Error):
        drive[500:600]


def test_a_drive_is_split(drive: ll.Drive) -> None:
    first, second = drive.split(at=80)
    assert np.array_equal(np.concatenate([first.time, second.time]), drive.time) and second.time[0] == 80
    parts = drive.split(at=[40, 80])
    assert np.array_equal(np.concatenate([part.time for part in parts]), drive.time) and len(parts) == 3
    fit = ll.calibrate(first, "idm", intervals=False, **FEW)
    assert fit.simulate(second).scores["nrmse_sva"] > 0
    for wrong in (drive.time[0], drive.time[-1] + 1, float("nan")):
        with pytest.raises(ll.UsageError, match="at: expected times"):
            drive.split(at=wrong)


def test_parts_of_one_of_many_trajectories(folder: Path) -> None:
    pandas = pytest.importorskip("pandas")
    tables = [pandas.read_csv(folder / f"drive{seed}" / "pair_follower1.csv").assign(run=str(seed)) for seed in (1, 2)]
    roles = {"time": "time_s", "speed": "speed_mps", "lead_speed": "lead_speed_mps", "gap": "spacing_m", "group": "run"}
    drive = ll.Drive(pandas.concat([tables[0], tables[1][:900]]), columns=roles, max_gap=2)
    part = drive[20:60]
    again = pickle.loads(pickle.dumps(part))
    assert np.array_equal(part.speed, again.speed) and np.array_equal(part.speed, drive.speed[(drive.time >= 20) & (drive.time <= 60)])


def test_a_picture_of_a_drive(drive: ll.Drive) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert len(drive.plot().axes) == 2


def test_findings_are_shown_and_applied(folder: Path) -> None:
    drives = [ll.read(folder / f"drive{seed}" / "pair_follower1.csv") for seed in (1, 2)]
    own = "//! c\nstruct Parameters {\n    /// share [-], 0 to 0.9, neutral 0\n    lost: f32,\n}\n\nfn soft_command(own: Parameters, a_cmd: f32) -> f32 {\n    return (1.0 - own.lost) * a_cmd;\n}\n"
    base = ll.Model("l-cth", ["actuation_lag"])
    findings = ll.diagnose(drives, base=base, effort="quick", causes=[("soft", own)], progress=False)
    shown = findings._repr_html_()
    assert findings.verdict in shown and "<script" not in shown
    model = findings.apply()
    causes = findings.recommended or findings.causes
    names = [one[0] if isinstance(one, tuple) else one for one in model.extend]
    assert (model.base, names) == ("l-cth", ["actuation_lag", *causes])
    assert set(ll.calibrate(drives[0], model, intervals=False, **FEW).parameters) >= {"ta"}
    extended = ll._api.extended(base, ["soft", "grade"], [("soft", own)])
    assert extended.extend == ["actuation_lag", ("soft", own), "grade"] and base.extend == ["actuation_lag"]
