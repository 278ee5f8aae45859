"""The package as people use it: arrays in and out, copies, threads, errors, Ctrl-C."""

from __future__ import annotations

import copy
import os
import pickle
import signal
import threading
import time
import warnings
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import leadlag as ll

FEW = {"max_evaluations": 2000, "progress": False}


@pytest.fixture(scope="module")
def drive(pair: Path) -> ll.Drive:
    return ll.read(pair)


@pytest.fixture(scope="module")
def fit(drive: ll.Drive) -> ll.Fit:
    return ll.calibrate(drive, "idm", **FEW)


def test_a_fit_tells_what_it_found(fit: ll.Fit, drive: ll.Drive) -> None:
    assert list(fit.parameters) == ["delta", "v_0", "d_0", "t_h", "a_max", "a_min"]
    assert fit.units["t_h"] == "s"
    assert 0 < fit.score < 0.3
    assert all(low <= fit.parameters[name] <= high for name, (low, high) in fit.intervals.items())
    simulation = fit.simulate(drive)
    assert simulation.scores["nrmse_sva"] == pytest.approx(fit.score)
    assert len(simulation.time) == len(drive) == len(simulation.speed)
    assert simulation.ended is None
    assert "idm" in repr(fit) and "t_h" in fit._repr_html_()
    assert "svg" in fit._repr_html_()


def test_least_squares_find_what_a_calibration_finds(fit: ll.Fit, drive: ll.Drive) -> None:
    optimize = pytest.importorskip("scipy.optimize")
    evaluator = ll.Evaluator(drive, "idm")
    span = evaluator.upper - evaluator.lower
    best = np.array([fit.parameters[name] for name in evaluator.parameters])
    found = optimize.least_squares(
        lambda x: evaluator.residuals(x)[0],
        np.clip(best + 0.05 * span, evaluator.lower + 0.01 * span, evaluator.upper - 0.01 * span),
        bounds=(evaluator.lower, evaluator.upper),
        x_scale=span,
        max_nfev=200,
    )
    assert 2 * found.cost <= fit.score * (1 + 1e-4)


def test_normal_equations_lead_to_the_optimum(fit: ll.Fit, drive: ll.Drive) -> None:
    """Levenberg and Marquardt's method by hand, in shares of the ranges."""
    evaluator = ll.Evaluator(drive, "idm")
    span = evaluator.upper - evaluator.lower
    best = np.array([fit.parameters[name] for name in evaluator.parameters])
    x = np.clip(best + 0.05 * span, evaluator.lower, evaluator.upper)
    dampings = np.array([0.0, 1e-6, 1e-4, 1e-2, 1.0])
    score = np.inf
    for _ in range(60):
        (jtj,), (jtr,), (score,) = evaluator.normal_equations(x)
        scaled, slope = jtj * np.outer(span, span), jtr * span
        free = ~((x >= evaluator.upper) & (slope < 0) | (x <= evaluator.lower) & (slope > 0))
        trials = []
        for damping in dampings:
            step = np.zeros_like(x)
            damped = scaled + damping * np.diag(np.diag(scaled)) + 1e-12 * np.trace(scaled) * np.eye(len(x))
            step[free] = -np.linalg.solve(damped[np.ix_(free, free)], slope[free])
            trials += [np.clip(x + share * span * step, evaluator.lower, evaluator.upper) for share in (1.0, 2.0)]
        costs = (evaluator.residuals(trials) ** 2).sum(axis=1)
        if costs.min() >= score * (1 - 1e-9):
            break
        x = trials[int(costs.argmin())]
    assert score <= fit.score * (1 + 1e-3)


def test_residuals_and_normal_equations_belong_to_the_scores(drive: ll.Drive) -> None:
    evaluator = ll.Evaluator([drive, drive[0:30]], "idm", precision="f64")
    middle = (evaluator.lower + evaluator.upper) / 2
    impossible = middle.copy()
    impossible[evaluator.parameters.index("t_h")] = -1.2
    many = np.array([middle, impossible, 0.9 * middle])
    scores, residuals = evaluator(many), evaluator.residuals(many)
    assert residuals.shape == (3, 3 * (len(drive) + len(drive[0:30])))
    assert np.allclose((residuals**2).sum(axis=1)[[0, 2]], scores[[0, 2]], rtol=1e-9)
    assert np.isinf(residuals[1]).all()
    jtj, jtr, rtr = evaluator.normal_equations(many)
    p = len(middle)
    assert jtj.shape == (3, p, p) and jtr.shape == (3, p)
    assert np.allclose(rtr[[0, 2]], scores[[0, 2]], rtol=1e-9)
    assert rtr[1] == np.inf and np.isnan(jtj[1]).all() and np.isnan(jtr[1]).all()
    steps = 1e-5 * (evaluator.upper - evaluator.lower)
    rows = np.concatenate([middle + np.diag(steps), middle - np.diag(steps)])
    jacobian = np.subtract(*np.split(evaluator.residuals(rows), 2)) / (2 * steps[:, None])
    scale = np.sqrt(np.outer(np.diag(jtj[0]), np.diag(jtj[0])))
    assert np.abs((jacobian @ jacobian.T - jtj[0]) / scale).max() < 1e-3
    assert np.abs((jacobian @ residuals[0] - jtr[0]) / np.sqrt(np.diag(jtj[0]))).max() < 1e-3
    with pytest.raises(ll.UsageError, match="u-sva has no residuals"):
        ll.Evaluator(drive, "idm", gof="u-sva").residuals(middle)
    with pytest.raises(ll.UsageError, match=r"expected an array of shape \(n, 6\)"):
        evaluator.normal_equations(middle[1:])


def on_a_gpu(drive: ll.Drive) -> ll.Evaluator:
    if "LEADLAG_NO_GPU" in os.environ:
        pytest.skip("LEADLAG_NO_GPU is set")
    try:
        return ll.Evaluator(drive, "idm", device="gpu")
    except ll.Error as error:
        pytest.skip(f"no GPU, not even a software one: {error}")


def test_normal_equations_of_a_gpu(drive: ll.Drive) -> None:
    gpu = on_a_gpu(drive)
    exact = ll.Evaluator(drive, "idm")
    middle = (gpu.lower + gpu.upper) / 2
    (found, slope, score), expected = gpu.normal_equations(middle), exact.normal_equations(middle)
    sizes = np.sqrt(np.diag(expected[0][0]))
    assert np.abs((found[0] - expected[0][0]) / np.outer(sizes, sizes)).max() < 0.03
    assert np.abs((slope[0] - expected[1][0]) / sizes).max() < 0.01 * np.sqrt(score[0])
    assert score == pytest.approx(expected[2], rel=1e-4)


def test_tables_of_simulations(fit: ll.Fit, drive: ll.Drive) -> None:
    pytest.importorskip("pandas")
    frame = fit.simulate(drive).to_pandas()
    assert list(frame.columns) == ["time_s", "spacing_m", "speed_mps", "acceleration_mps2"]
    assert len(frame) == len(drive)


def test_an_evaluator_scores_what_a_calibration_finds(fit: ll.Fit, drive: ll.Drive) -> None:
    evaluator = ll.Evaluator(drive, "idm", precision="f64")
    best = np.array([fit.parameters[name] for name in evaluator.parameters])
    scores = evaluator(np.vstack([best, evaluator.lower, evaluator.upper]))
    assert scores.shape == (3,)
    assert scores[0] == pytest.approx(fit.score, rel=1e-9)
    assert (scores[1:] >= scores[0]).all()
    spacing, speed, acceleration = evaluator.simulate(best)
    assert spacing.shape == speed.shape == acceleration.shape == (1, len(drive))
    assert np.array_equal(spacing[0], fit.simulate(drive).spacing)
    # Neither layout nor type of the array changes anything.
    many = evaluator.lower + np.random.default_rng(1).random((50, 6)) * (evaluator.upper - evaluator.lower)
    assert np.array_equal(evaluator(many), evaluator(np.asfortranarray(many)))
    assert np.array_equal(evaluator(many), evaluator(many.tolist()))


def test_a_gpu_gives_the_bits_of_the_cpu(drive: ll.Drive) -> None:
    gpu = on_a_gpu(drive)
    lanes = ll.Evaluator(drive, "idm", device="lanes")
    many = lanes.lower + np.random.default_rng(3).random((100, 6)) * (lanes.upper - lanes.lower)
    found = gpu(many)
    if "llvmpipe" in gpu.device:
        assert np.array_equal(found, lanes(many))
    else:
        assert np.allclose(found, lanes(many), rtol=1e-4)


def test_fixed_parameters_are_no_columns(drive: ll.Drive) -> None:
    same = ll.Evaluator(drive, "idm", bounds={"delta": 4, "v_0": (20, 40)})
    assert same.parameters == ["v_0", "d_0", "t_h", "a_max", "a_min"] and same.lower[0] == 20
    assert "fixed" in repr(ll.calibrate(drive, "idm", bounds={"delta": 4}, **FEW))
    evaluator = ll.Evaluator(drive, "idm", fix={"delta": 4})
    assert evaluator.parameters == ["v_0", "d_0", "t_h", "a_max", "a_min"]
    assert evaluator.lower.shape == (5,)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies(fit: ll.Fit, drive: ll.Drive, again) -> None:
    assert np.array_equal(again(drive).speed, drive.speed)
    table = {"time_s": drive.time, "lead_speed_mps": drive.lead_speed, "speed_mps": drive.speed, "spacing_m": drive.spacing}
    assert np.array_equal(again(ll.Drive(table, max_gap=2)).spacing, drive.spacing)
    other = again(fit)
    assert other.to_json() == fit.to_json() and len(other.drives) == 1
    evaluator = ll.Evaluator(drive, "idm")
    assert np.array_equal(again(evaluator)(evaluator.upper), evaluator(evaluator.upper))


def test_other_processes(drive: ll.Drive) -> None:
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        scores = list(pool.map(_score, [drive, drive]))
    assert scores == [_score(drive)] * 2


def _score(drive: ll.Drive) -> float:
    return ll.calibrate(drive, "idm", **FEW, intervals=False).score


def test_threads_work_side_by_side(drive: ll.Drive) -> None:
    evaluator = ll.Evaluator(drive, "idm")
    many = evaluator.lower + np.random.default_rng(2).random((200, 6)) * (evaluator.upper - evaluator.lower)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(evaluator, [many] * 8))
        fits = list(pool.map(lambda seed: ll.calibrate(drive, "idm", seed=seed, **FEW).score, [1, 1, 2]))
    assert all(np.array_equal(scores, found[0]) for scores in found)
    assert fits[0] == fits[1]


def test_extensions_by_name_and_text(drive: ll.Drive) -> None:
    text = """//! The car brakes less than commanded.
struct Parameters {
    /// share of the braking that is lost [-], 0 to 0.9, neutral 0
    lost: f32,
}

fn soft_command(own: Parameters, a_cmd: f32) -> f32 {
    return select(a_cmd, (1.0 - own.lost) * a_cmd, a_cmd < 0.0);
}
"""
    fit = ll.calibrate(drive, ll.Model("idm", [("soft", text), "actuation_lag"]), **FEW, intervals=False)
    assert {"lost", "tau_lag"} & set(fit.parameters)
    assert pickle.loads(pickle.dumps(fit)).simulate(drive).scores == fit.simulate(drive).scores


def test_errors_say_what_to_do(drive: ll.Drive, tmp_path: Path) -> None:
    with pytest.raises(ll.UsageError, match="did you mean"):
        ll.calibrate(drive, "idn")
    with pytest.raises(ll.UsageError, match="has the parameters"):
        ll.calibrate(drive, "idm", fix={"T": 1})
    with pytest.raises(ll.UsageError, match="different lengths"):
        ll.Drive({"time_s": [0.0, 0.1], "speed_mps": [1.0]})
    with pytest.raises(ll.Error, match="spacing_m"):
        ll.Drive({"time_s": [0.0, 0.1], "lead_speed_mps": [1.0, 1.0], "speed_mps": [1.0, 1.0]})
    with pytest.raises(ll.Error, match="no.csv"):
        ll.read(tmp_path / "no.csv")
    with pytest.raises(ll.UsageError, match="unknown option"):
        ll.read(tmp_path / "no.csv", folower=2)
    with pytest.raises(ll.UsageError, match=r"shape \(n, 6\)"):
        ll.Evaluator(drive, "idm")(np.zeros((3, 5)))
    with pytest.raises(ll.UsageError, match="did you mean replicates"):
        ll.calibrate(drive, "idm", replicate=2)  # type: ignore[call-arg]
    with pytest.raises(ll.UsageError, match="read already"):
        ll.calibrate_all([drive], "idm", columns="highd")
    table = {"time_s": drive.time, "lead_speed_mps": drive.lead_speed, "speed_mps": drive.speed, "spacing_m": drive.spacing}
    with pytest.raises(ll.UsageError, match="`segment` 9") as error:
        ll.Drive(table, segment=9)
    assert "--" not in str(error.value)
    with pytest.raises(TypeError, match="expected a leadlag.Drive"):
        ll.calibrate(3, "idm")
    with pytest.raises(ll.Error, match="platoon.csv"):
        ll.calibrate("platoon.csv", "idm")
    with pytest.raises(ll.UsageError, match="at least one drive"):
        ll.calibrate([], "idm")


def test_doubts_are_warnings(drive: ll.Drive) -> None:
    slow = {"time_s": drive.time, "lead_speed_mps": drive.lead_speed / 3, "speed_mps": drive.speed / 3, "spacing_m": drive.spacing}
    with pytest.warns(UserWarning, match="v_0"):
        ll.calibrate(ll.Drive(slow, reconcile="gap"), "idm", **FEW, intervals=False)


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_keeps_what_was_found(drive: ll.Drive) -> None:
    threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    started = time.monotonic()
    with pytest.warns(UserWarning, match="interrupted"):
        fit = ll.calibrate(drive, "idm", replicates=1000, progress=False)
    assert time.monotonic() - started < 10
    assert fit.score < 1 and fit.intervals == {}


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_ends_a_diagnosis(drive: ll.Drive) -> None:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        ll.diagnose(drive, base="l-cth", effort="normal", progress=False)


def test_progress_is_told_and_may_stop(drive: ll.Drive) -> None:
    settings = ll._api._settings("idm", {"replicates": 300})
    told: list[tuple[float, str]] = []
    _, interrupted = settings.run([drive], lambda done, text: told.append((done, text)) or (1 / 0 if len(told) > 2 else None))
    assert isinstance(interrupted, ZeroDivisionError)
    assert all(0 <= done <= 1 for done, _ in told) and "simulations" in told[0][1]


def test_pages(fit: ll.Fit, tmp_path: Path) -> None:
    path = fit.report(tmp_path / "fit.html")
    assert path.read_text().startswith("<!doctype html>")
    assert "iframe" in fit.report()._repr_html_()


def test_pictures(fit: ll.Fit) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert len(fit.plot().axes) == 3


def test_no_warning_without_a_reason(drive: ll.Drive) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ll.calibrate(drive, "idm", **FEW, intervals=False)
