"""How a study and a fleet scale with worker processes on this machine.

    python examples/scaling.py --workers 1,2,4

Drives are synthetic. The first row is the command line in one process with one thread; the others are Dask workers with one thread each. Times
are those of the computation: the cluster exists before they start. Needs distributed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import distributed

import leadlag as ll
import leadlag.study

PLAN = """schema_version = 1
[data]
folder = "data"
[[platoon]]
name = "S1"
file = "one/platoon.csv"
[[platoon]]
name = "S2"
file = "two/platoon.csv"
[calibration]
variants = ["idm", "idm+delay", "gipps", "gipps+delay", "l-cth", "l-cth+linear"]
replicates = {replicates}
max_evaluations = {evaluations}
"""


def program(*words: str) -> None:
    """The command line, with one thread."""
    subprocess.run([sys.executable, "-m", "leadlag._program", "--quiet", "--threads", "1", *words], check=True, stdout=subprocess.DEVNULL)


def merged(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def tasks(folder: Path) -> int:
    return len((folder / "tasks.jsonl").read_text().splitlines())


def cpu_seconds(folder: Path) -> float:
    return sum(float(json.loads(path.read_text())["cpu_s"]) for path in (folder / "runs").glob("*.json"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", default="1,2,4", help="numbers of worker processes [1,2,4]")
    parser.add_argument("--replicates", type=int, default=8, help="of each calibration of the study [8]")
    parser.add_argument("--evaluations", type=int, default=8000, help="simulations of a calibration [8000]")
    parser.add_argument("--copies", type=int, default=12, help="of each of eight pairs in the fleet [12]")
    parser.add_argument("--json", action="store_true", help="print JSON")
    asked = parser.parse_args()
    rows: list[dict[str, Any]] = []

    def row(what: str, workers: int, seconds: float, cpu: float | None) -> None:
        first = next((r for r in rows if r["what"] == what), {"seconds": seconds})
        faster = round(float(first["seconds"]) / seconds, 2)
        rows.append({"what": what, "workers": workers, "seconds": round(seconds, 1), "cpu_s": cpu, "faster": faster})
        if not asked.json:
            who = f"{workers} workers" if workers else "one process"
            used = "" if cpu is None else f"{cpu:7.1f} CPU s"
            print(f"{what:24} {who:12} {seconds:7.1f} s  {faster:5.2f} x  {used}", flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for one, seed in [("one", "1"), ("two", "2")]:
            program("synth", "--out", str(folder / "data" / one), "--seed", seed, "--duration", "300", "--pairs")
        plan = folder / "plan.toml"
        plan.write_text(PLAN.format(replicates=asked.replicates, evaluations=asked.evaluations))
        alone = folder / "alone"
        program("study", "plan", str(plan), "--out", str(alone))
        began = time.monotonic()
        program("study", "run", str(alone))
        program("study", "merge", str(alone))
        study = f"study of {tasks(alone)} tasks"
        row(study, 0, time.monotonic() - began, cpu_seconds(alone))
        files = sorted(str(path) for path in (folder / "data").glob("*/pair_*.csv")) * asked.copies
        fleet = f"fleet of {len(files)} pairs"
        os.environ["RAYON_NUM_THREADS"] = "1"
        began, cpu = time.monotonic(), time.process_time()
        expected = ll.calibrate_all(files, "idm", progress=False)
        row(fleet, 0, time.monotonic() - began, time.process_time() - cpu)
        for workers in map(int, asked.workers.split(",")):
            with (
                distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0") as cluster,
                distributed.Client(cluster) as client,
            ):
                client.wait_for_workers(workers)
                out = folder / f"workers{workers}"
                began = time.monotonic()
                found = leadlag.study.run(plan, client, out, progress=False)
                row(study, workers, time.monotonic() - began, cpu_seconds(out))
                if merged(found) != merged(alone / "merged"):
                    raise SystemExit("the tables differ")
                began = time.monotonic()
                rows_found = leadlag.study.fleet(files, "idm", client, progress=False)
                row(fleet, workers, time.monotonic() - began, None)
                if list(rows_found["score"]) != list(expected["score"]):
                    raise SystemExit("the rows differ")
    if asked.json:
        print(json.dumps(rows, indent=2))


if __name__ == "__main__":
    main()
