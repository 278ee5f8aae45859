"""Processes that fork, and Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leadlag as ll

#: A pool that forks while its parent has threads; the limit of the process ends a hanging one.
POOL = """
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
import numpy as np
import leadlag as ll

FEW = {{"max_evaluations": 1000, "progress": False, "intervals": False}}
fork = multiprocessing.get_context("fork")
drive = ll.read({pair!r})
evaluator = ll.Evaluator(drive, "idm", device="lanes")
middle = (evaluator.lower + evaluator.upper) / 2

def calibrated(seed):
    return ll.calibrate(drive, "idm", seed=seed, **FEW).score

def scored(seed):
    return evaluator(np.vstack([middle] * 40))[0], len(evaluator.simulate(middle)[0][0])

def rows(seed):
    return list(ll.calibrate_all([drive, drive], "idm", seed=seed, **FEW)["score"])

def fleet(seed):
    own = ll.Fleet({pair!r}, ["idm", "gipps"], seed=seed, holdout=0.3, **FEW)
    again = pickle.loads(pickle.dumps(own))
    one = own.drivers[0]
    scores = own.score({pair!r})["score"], again.score({pair!r})["score"]
    assert list(scores[0]) == list(scores[1])
    # A score that is missing is not equal to itself.
    return own.to_pandas()["heldout_score"].map(str).tolist(), own.fit(one, "idm").score, list(scores[0])

def nested(seed):
    here = calibrated(seed)
    with ProcessPoolExecutor(1, mp_context=fork) as pool:
        return here, *pool.map(calibrated, [seed])

work = {work}
before = [work(seed) for seed in (1, 2)] if {used} else None
with ProcessPoolExecutor(2, mp_context=fork) as pool:
    found = list(pool.map(work, (1, 2)))
assert before is None or found == before, (found, before)
print("done")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.parametrize("used", [True, False])
@pytest.mark.parametrize("work", ["calibrated", "scored", "rows", "fleet", "nested"])
def test_a_pool_that_forks_works(pair: Path, work: str, used: bool) -> None:
    words = [sys.executable, "-W", "ignore", "-c", POOL.format(pair=str(pair), work=work, used=used)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout == "done\n", done.stderr


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_is_told_that_it_has_no_gpu(pair: Path) -> None:
    program = f"""
    import multiprocessing
    import leadlag as ll
    drive = ll.read({str(pair)!r})
    ll.calibrate(drive, "idm", max_evaluations=100, intervals=False, progress=False)
    def fails(seed):
        try:
            ll.calibrate(drive, "idm", device="gpu", progress=False)
        except ll.UsageError as error:
            return str(error)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        print(pool.map(fails, [1])[0])
    """
    words = [sys.executable, "-W", "ignore", "-c", textwrap.dedent(program)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert "spawn" in done.stdout and "lanes" in done.stdout, done.stdout + done.stderr


def seconds_after_ctrl_c(call: Callable[[], Any], after: float = 0.4) -> float:
    """How long a call continues after Ctrl-C."""
    pressed: list[float] = []

    def press() -> None:
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, press)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
            # A process that ends before is too short to show anything.
            assert pressed, "the call ended before Ctrl-C"
            time.sleep(1)
    finally:
        timer.join()
    return time.monotonic() - pressed[0]


@pytest.fixture(scope="module")
def long() -> ll.Drive:
    return ll.synthetic(duration=3600)


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("device", ["lanes", "reference"])
def test_ctrl_c_ends_an_evaluator(long: ll.Drive, device: str) -> None:
    evaluator = ll.Evaluator(long, "idm", device=device)
    many = np.tile((evaluator.lower + evaluator.upper) / 2, (200_000, 1))
    assert seconds_after_ctrl_c(lambda: evaluator(many)) < 1
    assert seconds_after_ctrl_c(lambda: evaluator.simulate(many)) < 1
    # It continues as if nothing had happened.
    assert np.isfinite(evaluator(many[:3])).all()


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_ends_what_cannot_be_stopped(long: ll.Drive, tmp_path: Path) -> None:
    assert seconds_after_ctrl_c(lambda: ll.diagnose(long, base="l-cth", effort="thorough", progress=False)) < 1
    path = tmp_path / "long.csv"
    path.write_bytes(ll._frames.text_of(ll.synthetic(duration=600).to_pandas()))
    table = path.read_text().partition("\n")
    lines = table[2].splitlines()
    with path.open("w") as file:
        file.write("time_s,lead_speed_mps,speed_mps,spacing_m\n")
        for again in range(300):
            file.writelines(f"{again * 6000 + k}{line[line.index(','):]}\n" for k, line in enumerate(lines[:-1]))
    assert seconds_after_ctrl_c(lambda: ll.read(path), 0.2) < 1


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(
    "options", [{}, {"optimizer": "ga"}, {"device": "reference", "replicates": 20}], ids=["auto", "ga", "reference"]
)
def test_ctrl_c_ends_one_of_a_thousand_replicates(long: ll.Drive, options: dict[str, Any]) -> None:
    def calibrate() -> None:
        with pytest.warns(UserWarning, match="interrupted"):
            assert ll.calibrate(long, "idm", progress=False, **{"replicates": 1000, **options}).score > 0
        raise KeyboardInterrupt

    assert seconds_after_ctrl_c(calibrate) < 1


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_ends_what_goes_before_a_joint_search() -> None:
    # The test for one driver takes as long as many searches, so there is no result by then.
    drives = [ll.synthetic(seed=seed, duration=600) for seed in range(1, 11)]
    assert seconds_after_ctrl_c(lambda: ll.calibrate(drives, "idm", progress=False), 1) < 1


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_parts_of_a_population_change_nothing(long: ll.Drive) -> None:
    evaluator = ll.Evaluator(long, "idm")
    many = evaluator.lower + np.random.default_rng(1).random((700, 6)) * (evaluator.upper - evaluator.lower)
    together = evaluator(many)
    assert np.array_equal(together, np.concatenate([evaluator(many[:1]), evaluator(many[1:300]), evaluator(many[300:])]))
