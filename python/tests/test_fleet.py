"""Many drivers: their fits, their scores on other drives, and comparisons of fits."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leadlag as ll

pandas = pytest.importorskip("pandas")

QUIET: dict[str, Any] = {"progress": False}
ROLES = {"time": "t", "speed": ("v", "km/h"), "lead_speed": "lead_speed_mps", "gap": "spacing_m", "group": "driver"}


@pytest.fixture(scope="module")
def drives(folder: Path) -> list[ll.Drive]:
    paths = [folder / f"drive{seed}" / f"pair_follower{k}.csv" for seed in (1, 2) for k in (1, 2)]
    return [ll.Drive(pandas.read_csv(path), name=f"D{k}") for k, path in enumerate(paths)]


@pytest.fixture(scope="module")
def table(drives: list[ll.Drive]) -> Any:
    """The same as one table with names and units of its own."""
    frames = [drive.to_pandas().assign(driver=drive.name) for drive in drives[:2]]
    whole = pandas.concat(frames, ignore_index=True).rename(columns={"time_s": "t"})
    return whole.assign(v=3.6 * whole["speed_mps"]).drop(columns="speed_mps")


@pytest.fixture(scope="module")
def fleet(drives: list[ll.Drive]) -> ll.Fleet:
    return ll.Fleet(drives, "idm", **QUIET)


def test_a_driver_has_the_fit_of_his_row(fleet: ll.Fleet, drives: list[ll.Drive]) -> None:
    assert list(fleet) == fleet.drivers == ["D0", "D1", "D2", "D3"] and len(fleet) == 4 and fleet.models == ["idm"]
    rows = fleet.to_pandas()
    assert rows.equals(ll.calibrate_all(drives, "idm", **QUIET))
    for driver, (_, row) in zip(fleet, rows.iterrows()):
        fit = fleet[driver]
        assert fit.score == row["score"] and fit.parameters["t_h"] == row["t_h_s"]
        assert fit.intervals.get("t_h", (np.nan, np.nan)) == pytest.approx((row["t_h_s_low"], row["t_h_s_high"]), nan_ok=True)
    assert fleet["D1"] is fleet.fit("D1", "idm")
    assert "<table" in fleet._repr_html_() and repr(fleet) == "<Fleet: 4 drivers, idm>"
    for wrong in ("D9", "idm"):
        with pytest.raises(ll.UsageError, match="expected one of D0, D1, D2, D3, found"):
            fleet[wrong]
    with pytest.raises(ll.UsageError, match="model: expected one of idm, found gipps"):
        fleet.fit("D1", "gipps")


def test_drivers_are_scored_on_other_drives(fleet: ll.Fleet, drives: list[ll.Drive]) -> None:
    own = fleet.score(drives)
    assert list(own.columns) == ["driver", "model", "score"] and list(own["driver"]) == fleet.drivers
    assert np.allclose(own["score"], fleet.to_pandas()["score"], rtol=1e-9)
    other = ll.Drive(drives[2].to_pandas(), name="D0")
    assert fleet.score(other)["score"][0] == pytest.approx(fleet["D0"].simulate(other).scores["nrmse_sva"], rel=1e-9)
    with pytest.raises(ll.UsageError, match="expected one of D0, D1, D2, D3, found 'follower'"):
        fleet.score(drives[0].to_pandas())


@pytest.mark.parametrize("kind", ["table", "file", "folder"])
def test_a_fleet_of_a_table_or_of_files(table: Any, folder: Path, tmp_path: Path, kind: str) -> None:
    options: dict[str, Any] = {"columns": ROLES, "bounds": "human", "max_evaluations": 3000}
    pairs, expected = table, ["D0", "D1"]
    if kind == "file":
        pairs = tmp_path / "pairs.csv"
        table.to_csv(pairs, index=False)
    if kind == "folder":
        pairs, expected = [folder / "drive1" / f"pair_follower{k}.csv" for k in (1, 2)], ["pair_follower1", "pair_follower2"]
        del options["columns"]
    fleet = ll.Fleet(pairs, ["idm", "idm+delay"], holdout=0.3, **options, **QUIET)
    assert fleet.drivers == expected and fleet.models == ["idm", "idm+delay"]
    rows = fleet.to_pandas().set_index("model").loc["idm+delay"]
    fit = fleet.fit(expected[1], "idm+delay")
    assert fit.score == rows["score"].iloc[1] and len(fit.drives[0]) == rows["samples"].iloc[1]
    with pytest.raises(ll.UsageError, match="model: expected one of idm, idm.delay, found none"):
        fleet[expected[1]]
    if kind == "folder":
        # Files of the same names in another folder are of the same drivers.
        others = fleet.score([folder / "drive2" / f"pair_follower{k}.csv" for k in (1, 2)], "idm")
        assert list(others["driver"]) == expected and np.isfinite(others["score"]).all()


def test_a_picture_of_a_fleet(fleet: ll.Fleet) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    figure = fleet.plot()
    labels = [axis.get_xlabel() for axis in figure.axes]
    assert sorted(labels) == ["a_max_mps2", "a_min_mps2", "d_0_m", "delta", "t_h_s", "v_0_mps"]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == fleet.drivers


def test_fits_are_compared_on_what_they_have_not_seen(drives: list[ll.Drive]) -> None:
    train, test = drives[0].split(at=80)
    fits = [ll.calibrate(train, model, max_evaluations=2000, intervals=False, **QUIET) for model in ("idm", "gipps")]
    rows = ll.compare(fits, on=[test, drives[1]])
    assert list(rows["fit"]) == ["idm", "gipps"] * 2 and list(rows["drive"]) == [d.label for d in (test, drives[1]) for _ in fits]
    expected = fits[1].simulate(drives[1]).scores
    assert all(rows[name][3] == expected[name] for name in ("nrmse_sva", "nrmse_s", "rmse_s", "rmse_a"))
    named = ll.compare({"first": fits[0]}, on=test)
    assert list(named["fit"]) == ["first"] and named["ended"][0] is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ll.compare(fits, on=test)
        with pytest.raises(UserWarning, match="idm: calibrated on .*, which favours it"):
            ll.compare(fits, on=drives[0])


def test_signals_as_datasets(drives: list[ll.Drive], fleet: ll.Fleet) -> None:
    pytest.importorskip("xarray")
    signals = drives[0].to_xarray()
    assert np.array_equal(signals["spacing_m"], drives[0].spacing) and signals["time_s"].attrs["units"] == "s"
    simulated = fleet["D0"].simulate(drives[0]).to_xarray()
    assert simulated["acceleration_mps2"].attrs["units"] == "m/s2" and simulated.sizes == {"time_s": len(drives[0])}
