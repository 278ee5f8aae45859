"""Accepted and refused arguments of the functions."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leadlag as ll

FEW: dict[str, Any] = {"max_evaluations": 1000, "progress": False, "intervals": False}
SIGNALS = ("time_s", "lead_speed_mps", "speed_mps", "spacing_m")


@pytest.fixture(scope="module")
def drive(pair: Path) -> ll.Drive:
    return ll.read(pair)


def arrays(drive: ll.Drive) -> dict[str, Any]:
    return dict(zip(SIGNALS, (drive.time, drive.lead_speed, drive.speed, drive.spacing)))


def same(one: ll.Fit, other: ll.Fit) -> bool:
    return one.parameters == other.parameters and one.score == other.score


def test_every_verb_takes_what_a_drive_takes(pair: Path, drive: ll.Drive) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(pair)
    expected = ll.calibrate(drive, "idm", **FEW)
    kinds = [frame, {name: frame[name].to_numpy() for name in frame}, str(pair), pair]
    polars = pytest.importorskip("polars")
    kinds.append(polars.read_csv(pair))
    for kind in kinds:
        assert same(ll.calibrate(kind, "idm", **FEW), expected), type(kind)
    halves = [frame[: len(frame) // 2], frame[len(frame) // 2 :]]
    assert same(ll.calibrate(halves, "idm", **FEW), ll.calibrate([ll.Drive(half) for half in halves], "idm", **FEW))
    folds = ll.calibrate(halves, "idm", folds=2, history=1.0, **FEW).to_dict()
    for own in ("t_h", ["t_h"]):
        with pytest.raises(ll.UsageError, match="`own` t_h: a distribution needs at least 10 drivers, found"):
            ll.calibrate(halves, "idm", own=own, **FEW)
    assert folds["held_back"]["folds"] == 2 and len(folds["held_back"]["drives"]) == 2 and folds["history_s"] == 1.0
    evaluator, other = ll.Evaluator(frame, "idm"), ll.Evaluator(drive, "idm")
    assert np.array_equal(evaluator(other.upper), other(other.upper))
    assert expected.simulate(frame).scores == expected.predict(pair).scores == expected.simulate(drive).scores
    rows = ll.calibrate_all([frame, drive], "idm", **FEW)
    assert rows["score"][0] == rows["score"][1]
    with pytest.raises(ll.Error, match="expected a stretch of 30 s"):
        ll.diagnose(frame[:30], base="idm", progress=False)


def test_models_are_compared_by_what_was_held_back(pair: Path, drive: ll.Drive) -> None:
    rows = ll.calibrate_all([drive], ["idm", "idm+delay"], holdout=0.3, **FEW)
    assert all(score > 0 for score in rows["heldout_score"]) and "expected_score" not in rows
    assert list(rows["samples"]) == [round(0.7 * len(drive.time))] * 2
    assert list(ll.calibrate_all(pair, ["idm", "idm+delay"], holdout=0.3, **FEW)["heldout_score"]) == list(rows["heldout_score"])
    with pytest.raises(ll.UsageError, match="expected a share above 0 and below 1"):
        ll.calibrate_all([drive], "idm", holdout=1.5, **FEW)


@pytest.mark.parametrize("kind", ["mapping", "whole", "file"])
def test_columns_are_an_argument_everywhere(drive: ll.Drive, tmp_path: Path, kind: str) -> None:
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"t": drive.time, "v": 3.6 * drive.speed, "v_lead": drive.lead_speed, "gap": drive.spacing})
    roles = {"time": "t", "speed": ("v", "km/h"), "lead_speed": "v_lead", "gap": "gap"}
    columns: Any = roles
    if kind == "whole":
        columns = {"rows": "pairs", "missing": ["lost"], "columns": {**roles, "time": {"name": ["t", "Time"], "unit": "s"}}}
    if kind == "file":
        columns = tmp_path / "own.toml"
        columns.write_text(ll._frames.map_text(roles))
    made = ll.Drive(table, columns=columns)
    assert np.allclose(made.speed, drive.speed)
    fit = ll.calibrate(table, "idm", columns=columns, **FEW)
    assert same(fit, ll.calibrate(made, "idm", **FEW))
    assert ll.Evaluator(table, "idm", columns=columns).parameters == list(fit.parameters)
    assert fit.simulate(table, columns=columns).scores == fit.simulate(made).scores
    rows = ll.calibrate_all(table, "idm", columns=columns, **FEW)
    assert rows["score"][0] == pytest.approx(fit.score, rel=0.5)
    path = tmp_path / "table.csv"
    table.to_csv(path, index=False)
    assert np.allclose(ll.read(path, columns=columns).speed, drive.speed)
    with pytest.raises(ll.Error):
        ll.diagnose(table[:30], base="idm", columns=columns, progress=False)
    import pickle

    assert np.array_equal(pickle.loads(pickle.dumps(made)).speed, made.speed)


def test_a_built_in_map_goes_by_its_name(drive: ll.Drive) -> None:
    with pytest.raises(ll.Error, match="highd"):
        ll.calibrate(arrays(drive), "idm", columns="highd")
    with pytest.raises(ll.UsageError, match="did you mean"):
        ll.calibrate(arrays(drive), "idm", columns="high")
    with pytest.raises(ll.UsageError, match="columns: drives are read already"):
        ll.calibrate(drive, "idm", columns="highd")
    with pytest.raises(ll.UsageError, match="did you mean columns"):
        ll.calibrate(drive, "idm", column="highd")  # type: ignore[call-arg]


def test_masked_values_are_missing(drive: ll.Drive) -> None:
    table = arrays(drive)
    mask = np.zeros(len(drive), bool)
    mask[100:105] = True
    wrong = np.where(mask, 999.0, table["spacing_m"])
    missing = ll.Drive({**table, "spacing_m": np.where(mask, np.nan, wrong)})
    masked = ll.Drive({**table, "spacing_m": np.ma.MaskedArray(wrong, mask)})
    assert masked.spacing.max() < 900 and np.array_equal(masked.spacing, missing.spacing)
    whole = {name: np.ma.MaskedArray((10 * values).astype(int), mask) for name, values in table.items()}
    text = ll._frames.text_of(whole).decode().splitlines()
    assert text[101] == ",,," and ",," not in text[100]
    times = np.ma.MaskedArray(np.arange(3).astype("datetime64[s]"), [False, True, False])
    assert ll._frames.text_of({"t": times, "x": [1, 2, 3]}) == b"t,x\n0.0,1\n,2\n2.0,3\n"
    words = np.ma.MaskedArray(["a", "b"], [True, False])
    assert ll._frames.text_of({"t": words, "x": [1, 2]}) == b"t,x\n,1\nb,2\n"


def test_missing_values_of_pandas(drive: ll.Drive) -> None:
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame(arrays(drive)).convert_dtypes()
    table.loc[100:104, "spacing_m"] = pandas.NA
    assert np.isfinite(ll.Drive(table).spacing).all()


@pytest.mark.parametrize(
    "bounds, expected",
    [
        ({"zz": (1, 2)}, "bounds of zz: variant idm has the parameters"),
        ({"v_O": (25, 40)}, "did you mean `?v_0"),
        ({"v_0": -5}, "v_0: expected"),
        ({"t_h": 0}, "t_h: expected"),
        ({"v_0": (40, 20)}, "the lower one not above the upper one"),
        ({"v_0": (float("nan"), 40)}, "v_0: expected"),
        ({"v_0": (20, float("inf"))}, "v_0: expected"),
        ({"v_0": (1, 2, 3)}, "bounds of v_0: expected .lower, upper. or one number"),
        ({"v_0": "fast"}, "bounds of v_0: expected .lower, upper. or one number"),
    ],
)
def test_bounds_that_cannot_be(drive: ll.Drive, bounds: Any, expected: str) -> None:
    for verb in (
        lambda: ll.calibrate(drive, "idm", bounds=bounds, **FEW),
        lambda: ll.calibrate_all([drive], "idm", bounds=bounds, **FEW),
        lambda: ll.Evaluator(drive, "idm", bounds=bounds),
        lambda: ll.diagnose(drive, base="idm", effort="quick", bounds=bounds, progress=False),
    ):
        with pytest.raises(ll.UsageError, match=expected):
            verb()


def test_a_fixed_value_lies_within_its_bounds(drive: ll.Drive) -> None:
    with pytest.raises(ll.UsageError, match=r"v_0.*50.*\[25, 40\]"):
        ll.calibrate(drive, "idm", bounds={"v_0": (25, 40)}, fix={"v_0": 50}, **FEW)
    with pytest.raises(ll.UsageError, match="v_0"):
        ll.Evaluator(drive, "idm", bounds=["human", {"v_0": (25, 40)}], fix={"v_0": 50})
    assert ll.calibrate(drive, "idm", bounds={"v_0": (25, 40)}, fix={"v_0": 30}, **FEW).parameters["v_0"] == 30
    # A set of bounds is the range of a search; fixed values may lie outside.
    assert ll.calibrate(drive, "idm", bounds="human", fix={"delta": 4}, **FEW).parameters["delta"] == 4


@pytest.mark.parametrize(
    "option, expected",
    [
        ({"smooth": 1}, "smooth: expected True or False"),
        ({"smooth": "yes"}, "smooth: expected True or False"),
        ({"segment": 0}, "segment: expected a whole number from 1 on"),
        ({"segment": -1}, "segment: expected a whole number from 1 on"),
        ({"segment": 1.5}, "segment: expected a whole number from 1 on"),
        ({"segment": 2**40}, "segment: expected a whole number from 1 on"),
        ({"start": True}, "start: expected a number"),
        ({"max_gap": float("nan")}, "max gap: expected 0 to 60 s"),
        ({"max_gap": -1}, "max gap: expected 0 to 60 s"),
        ({"resample": 0}, "resample"),
        ({"trajectory": 5_000_000_000}, "trajectory"),
        ({"layout": 3}, "layout"),
        ({"name": 3}, "name"),
    ],
)
def test_options_of_reading_that_cannot_be(pair: Path, option: dict[str, Any], expected: str) -> None:
    with pytest.raises((ll.Error, TypeError), match=expected):
        ll.read(pair, **option)


def test_smoothing_that_is_asked_for_is_done(pair: Path) -> None:
    assert not np.array_equal(ll.read(pair, smooth=True).speed, ll.read(pair).speed)
    assert np.array_equal(ll.read(pair, smooth=False).speed, ll.read(pair).speed)


@pytest.mark.parametrize("parameter, value", [("t_h", -1.2), ("delta", -4), ("a_min", 1), ("v_0", float("nan"))])
def test_a_candidate_that_cannot_be_simulated_scores_infinite(drive: ll.Drive, parameter: str, value: float) -> None:
    for device in ("lanes", "reference"):
        evaluator = ll.Evaluator(drive, "idm", device=device)
        many = np.tile((evaluator.lower + evaluator.upper) / 2, (3, 1))
        expected = evaluator(many)
        many[1, evaluator.parameters.index(parameter)] = value
        found = evaluator(many)
        assert found[1] == np.inf and found[0] == expected[0] and found[2] == expected[2]
        assert (evaluator(many[1]) == np.inf).all()
        with pytest.raises(ll.UsageError, match=f"candidate 1: {parameter}: expected"):
            evaluator.simulate(many)


def test_an_optimiser_that_steps_out_of_bounds_goes_on(drive: ll.Drive) -> None:
    optimize = pytest.importorskip("scipy.optimize")
    evaluator = ll.Evaluator(drive, "idm")
    start = (evaluator.lower + evaluator.upper) / 2
    start[evaluator.parameters.index("t_h")] = 0.05
    found = optimize.minimize(lambda x: evaluator(x)[0], start, method="Nelder-Mead", options={"maxfev": 200})
    assert np.isfinite(found.fun)


def noisy(drive: ll.Drive, size: float) -> dict[str, Any]:
    """A drive whose acceleration is noise."""
    table, rng = arrays(drive), np.random.default_rng(1)
    table["lead_speed_mps"] = 5 + table["lead_speed_mps"]
    return {**table, "speed_mps": 5 + table["speed_mps"] + size * rng.standard_normal(len(drive))}


def test_one_warning_per_fault(drive: ll.Drive) -> None:
    tables = [noisy(drive, factor) for factor in (0.3, 0.33, 0.36, 0.4, 0.45, 0.5)]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("default")
        drives = [ll.Drive(table, name=f"D{k}") for k, table in enumerate(tables)]
    assert drives[0].warnings
    texts = [str(one.message) for one in told]
    assert len(texts) == len(set(texts)) == len(drives[0].warnings), texts
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        ll.calibrate_all(tables, "idm", **FEW)
    texts = [str(one.message) for one in told]
    assert len(texts) == len(drives[0].warnings) and "5 more" in texts[0], texts


def test_warnings_speak_python(drive: ll.Drive) -> None:
    slow = {name: values / (1 if name == "time_s" else 3) for name, values in arrays(drive).items()}
    with pytest.warns(UserWarning) as told:
        ll.calibrate(slow, "idm", **FEW)
    assert all("--" not in str(one.message) for one in told)
    with pytest.warns(UserWarning, match="`gof` nrmse-s"):
        rough = ll.Drive(noisy(drive, 0.3))
    assert rough.warnings and all("--" not in text for text in rough.warnings)


def test_names_stay_as_given(drive: ll.Drive) -> None:
    table = arrays(drive)
    named = [ll.Drive(table, name=name) for name in ("D03", "D07")]
    assert [one.name for one in named] == ["D03", "D07"]
    rows = ll.calibrate_all(named, "idm", **FEW)
    assert list(rows["name"]) == ["D03", "D07"]
    import pickle

    assert pickle.loads(pickle.dumps(named[0])).name == "D03"
    assert ll.calibrate(table, "idm", name="D03", **FEW).drives[0].name == "D03"
    assert named[0][20:80].name == "D03"
    assert ll.Drive(table).name == "follower"
