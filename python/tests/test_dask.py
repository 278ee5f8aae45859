"""Dask workers give the same results as one process, to the byte, even if some are killed."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import run

import leadlag as ll

distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install distributed")

import leadlag.study  # noqa: E402

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")

PLAN = """schema_version = 1
[data]
folder = "data"
[[platoon]]
name = "S1"
file = "one/platoon.csv"
followers = [1, 2]
[[platoon]]
name = "S2"
file = "two/platoon.csv"
followers = [1, 2]
[calibration]
variants = ["idm", "gipps+delay", "l-cth+linear"]
replicates = 2
max_evaluations = 4000
"""


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Four worker processes of one thread each, which come back when they are killed."""
    with (
        distributed.LocalCluster(n_workers=4, threads_per_worker=1, dashboard_address=":0") as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    for name, seed in [("one", "1"), ("two", "2")]:
        run("synth", "--out", str(folder / "data" / name), "--seed", seed, "--duration", "60")
    path = folder / "plan.toml"
    path.write_text(PLAN)
    return path


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def kill_some(client: Any, ended: threading.Event, killed: list[int]) -> None:
    """Kills a worker every second or so, three in all."""
    rng = random.Random(1)
    while len(killed) < 3 and not ended.wait(rng.uniform(0.5, 1.5)):
        pids = list(client.run(os.getpid, on_error="ignore").values())
        if pids:
            killed.append(rng.choice(pids))
            os.kill(killed[-1], signal.SIGKILL)


def children() -> list[str]:
    """The processes of this environment that compute for workers."""
    found = subprocess.run(["ps", "-e", "-o", "args"], capture_output=True, text=True, check=True)
    return [line for line in found.stdout.splitlines() if line == f"{sys.executable} -m leadlag.study"]


def test_a_study_whose_workers_are_killed(client: Any, plan: Path, tmp_path: Path) -> None:
    one = tmp_path / "one"
    run("study", "plan", str(plan), "--out", str(one))
    run("study", "run", str(one))
    run("study", "merge", str(one))
    expected = bytes_of(one / "merged")
    ended, killed = threading.Event(), list[int]()
    killer = threading.Thread(target=kill_some, args=(client, ended, killed))
    killer.start()
    try:
        merged = leadlag.study.run(plan, client, tmp_path / "many", batch_seconds=1, progress=False)
    finally:
        ended.set()
        killer.join()
    assert len(killed) >= 2, "the study was over before workers were killed"
    assert bytes_of(merged) == expected
    assert not list((tmp_path / "many").rglob("*.tmp"))
    assert tasks_of(tmp_path / "many") >= 24, "the folder says what the workers did"
    # Again: no work is left, and the result is the same.
    assert bytes_of(leadlag.study.run(plan, client, tmp_path / "many", progress=False)) == expected
    deadline = time.monotonic() + 10
    while children() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not children(), "a process outlives its worker"


def tasks_of(folder: Path) -> int:
    """Tasks that the runs of a folder have recorded."""
    return sum(json.loads(path.read_text())["tasks"] for path in (folder / "runs").glob("*.json"))


def same(found: Any, expected: Any) -> None:
    assert list(found) == list(expected)
    for name in expected:
        a, b = np.asarray(found[name]), np.asarray(expected[name])
        assert a.dtype == b.dtype and len(a) == len(b), name
        assert all(x == y or (x != x and y != y) for x, y in zip(a.tolist(), b.tolist())), name


def test_a_fleet_whose_workers_are_killed(client: Any, folder: Path) -> None:
    files = sorted(str(path) for path in folder.glob("drive1/p*.csv"))
    models = ["idm", ll.Model("gipps+delay", extend=["actuation_lag"])]
    settings: dict[str, Any] = {"seed": 2, "max_evaluations": 3000, "intervals": False, "progress": False}
    expected = ll.calibrate_all(files, models, **settings)
    ended, killed = threading.Event(), list[int]()
    killer = threading.Thread(target=kill_some, args=(client, ended, killed))
    killer.start()
    try:
        found = leadlag.study.fleet(files, models, client, batch_seconds=2, **settings)
    finally:
        ended.set()
        killer.join()
    assert killed
    same(found, expected)


def test_a_fleet_of_drives_and_of_a_table(client: Any, folder: Path, tmp_path: Path) -> None:
    settings: dict[str, Any] = {"max_evaluations": 500, "intervals": False, "progress": False}
    files = sorted((folder / "drive1").glob("pair_*.csv"))
    frames = pytest.importorskip("pandas")
    tables = [frames.read_csv(path) for path in files]
    drives = [ll.read(files[0]), *(ll.Drive(table, name=f"drive {k}") for k, table in enumerate(tables))]
    same(leadlag.study.fleet(drives, "idm", client, **settings), ll.calibrate_all(drives, "idm", **settings))
    # One table of many pairs, by a column map from a file; bounds from a file.
    columns = tmp_path / "own.toml"
    columns.write_text(COLUMNS)
    bounds = tmp_path / "bounds.toml"
    bounds.write_text("v_0 = [20, 60]\n")
    table = frames.concat([table.assign(run=10 - k) for k, table in enumerate(tables)], ignore_index=True)
    settings |= {"columns": str(columns), "bounds": ["human", bounds]}
    expected = ll.calibrate_all(table, ["idm", "l-cth"], **settings)
    assert len(set(expected["trajectory"])) == len(tables) > 2
    same(leadlag.study.fleet(table, ["idm", "l-cth"], client, batch_seconds=1, **settings), expected)
    path = tmp_path / "table.csv"
    table.to_csv(path, index=False)
    same(leadlag.study.fleet(path, "idm", client, **settings), ll.calibrate_all(path, "idm", **settings))


COLUMNS = """title = "pairs below each other"
rows = "pairs"
lead_length = 5

[columns]
time = { name = "time_s", unit = "s" }
group = { name = "run" }
gap = { name = "spacing_m", unit = "m" }
speed = { name = "speed_mps", unit = "m/s" }
lead_speed = { name = "lead_speed_mps", unit = "m/s" }
"""


def test_what_is_doubtful_or_unreadable_is_told_as_by_one_process(client: Any, folder: Path, tmp_path: Path) -> None:
    frames = pytest.importorskip("pandas")
    for path in sorted((folder / "drive1").glob("pair_*.csv")):
        table = frames.read_csv(path)
        table.to_csv(tmp_path / path.name, index=False)
        table.assign(speed_mps=3 * table["speed_mps"]).to_csv(tmp_path / f"fast_{path.name}", index=False)
    (tmp_path / "broken.csv").write_text("a,b\n1,2\n")
    settings: dict[str, Any] = {"max_evaluations": 500, "intervals": False, "progress": False}
    with pytest.warns(UserWarning) as expected_said:
        expected = ll.calibrate_all(tmp_path, "idm", **settings)
    with pytest.warns(UserWarning) as said:
        same(leadlag.study.fleet(tmp_path, "idm", client, batch_seconds=1, **settings), expected)
    assert [str(one.message) for one in said] == [str(one.message) for one in expected_said]
    assert len(said) == 2 and "implausible" in str(said[1].message)
    with pytest.raises(ll.Error, match="broken.csv"):
        leadlag.study.fleet(tmp_path / "broken.csv", "idm", client, **settings)


def test_what_cannot_be_is_told(client: Any, plan: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(PLAN.replace('"idm"', '"idn"'))
    with pytest.raises(ll.UsageError, match="idn"):
        leadlag.study.run(bad, client, tmp_path / "bad")
    with pytest.raises(ll.UsageError):
        leadlag.study.fleet([], "idn", client)
    outside = plan.parent / "outside.toml"
    outside.write_text(PLAN.replace('"one/platoon.csv"', '"../data/one/platoon.csv"'))
    with pytest.raises(ll.UsageError, match="data folder"):
        leadlag.study.run(outside, client, tmp_path / "outside")


def test_a_worker_of_another_version_is_refused(client: Any, plan: Path, tmp_path: Path) -> None:
    worker = sorted(client.nthreads())[0]
    here = leadlag.study._program()

    def says(program: str) -> None:
        import leadlag._native

        leadlag._native.PROGRAM = program

    # The same version, whose search is in another state.
    client.run(says, f"leadlag {ll.__version__}+search0", workers=[worker])
    refused = re.escape(f"worker {worker} has leadlag {ll.__version__}+search0, and this process has {here}: ")
    try:
        with pytest.raises(ll.Error, match=refused):
            leadlag.study.run(plan, client, tmp_path / "refused", progress=False)
        with pytest.raises(ll.Error, match=refused):
            leadlag.study.fleet([ll.synthetic(k, 60) for k in range(4)], "idm", client, progress=False)
    finally:
        client.run(says, here, workers=[worker])


def test_a_worker_without_leadlag_is_named(client: Any) -> None:
    worker = sorted(client.nthreads())[0]

    def lacks(yes: bool) -> None:
        sys.modules.pop("leadlag.study", None)
        if yes:
            sys.modules["leadlag.study"] = None  # type: ignore[assignment]

    client.run(lacks, True, workers=[worker])
    try:
        with pytest.raises(ll.Error, match=f"worker {worker} has no such leadlag"):
            leadlag.study.fleet([ll.synthetic(k, 60) for k in range(4)], "idm", client, progress=False)
    finally:
        client.run(lacks, False, workers=[worker])


def test_without_dask_it_says_so() -> None:
    code = "import sys; sys.modules['distributed'] = None; import leadlag.study as s; s.fleet([], 'idm', None)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "ImportError: leadlag.study needs Dask" in done.stderr and "pip install distributed" in done.stderr
