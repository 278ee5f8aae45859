"""Studies and fleets on the workers of a Dask client.

    from distributed import Client
    import leadlag.study

    with Client("scheduler:8786") as client:
        merged = leadlag.study.run("plan.toml", client, "study")
        rows = leadlag.study.fleet("tracks.csv", ["idm", "gipps+delay"], client, columns="highd")

No shared folder is needed. Inputs go to the workers by their SHA-256. A worker computes batches of some seconds, each in a separate process with one
thread, and sends the results back. Another worker computes the batches of a lost one. Results have the same bytes as those of one process.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import json
import os
import pickle
import re
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _drives, _native
from ._api import SETTINGS, Drive, Model, ModelLike, Options, Settings, _are_drives, _bounds, _chosen, _settings, _several
from ._frames import table_like, text_of
from ._progress import Bar

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Largest part of an input that is sent at once [bytes]; Dask warns of more than 10 MB.
PIECE = 8 << 20
#: Batches per thread: one is computed, another waits.
AHEAD = 2
#: Items of a batch, before anything is known of their time.
FIRST = 4
#: Files that leadlag reads if they lie beside a given file.
COMPANIONS = ("Labels.csv", "Slope.csv", "mfc_*.csv")
#: Interval between counts of workers [s].
LOOK = 1.0

#: Files by their names in the folder where a batch is computed.
Files = dict[str, Path]
#: A task or a pair: the files that it needs, and the arguments of the function that computes it.
Item = tuple[Files, Any]


def run(
    plan: str | os.PathLike[str],
    client: Any,
    out: str | os.PathLike[str],
    *,
    data: str | os.PathLike[str] | None = None,
    batch_seconds: float = 10.0,
    retries: int = 10,
    progress: bool = True,
) -> Path:
    """Computes a study on the workers of a client and merges it; returns the folder of the tables.

    ``plan``: a plan file. ``out``: the folder of the study, which is created or continued. ``data``: the data folder, instead of the one that the
    plan names. It must contain all files that the plan reads. ``batch_seconds``: target time of a batch of tasks [s]. ``retries``: number of times
    that a task may be lost with its worker. ``progress``: whether a bar is shown.

    The tables have the same bytes as those of ``leadlag study plan``, ``run`` and ``merge``. A part is put into the folder whole or not at all. After
    an interruption the same call continues.

    Raises :class:`leadlag.UsageError` for an invalid plan. Raises :class:`leadlag.Error` where a task fails or a worker has another leadlag.
    """
    folder, inputs = Path(out), _Inputs()
    missing = _native.plan_study(plan, folder, data)
    inputs.add_study(folder)
    with Bar("study", progress) as tell:
        for _, files in _found(client, _study, [({}, task) for task in missing], inputs, tell, batch_seconds, retries):
            for name, content in files.items():
                _write_whole(folder, name, content)
    _native.merge_study(folder)
    return folder / "merged"


def fleet(
    pairs: Any,
    models: ModelLike | Sequence[ModelLike],
    client: Any,
    *,
    batch_seconds: float = 10.0,
    retries: int = 10,
    progress: bool = True,
    **options: Unpack[Options],
) -> Any:
    """:func:`leadlag.calibrate_all` on the workers of a client: the same rows in the same order.

    ``batch_seconds`` [s] and ``retries`` are as in :func:`run`. The rest is as in :func:`leadlag.calibrate_all`, and so are the errors.
    """
    settings, reading = _chosen(options, SETTINGS, _native.READING)
    several = _several(models)
    with tempfile.TemporaryDirectory() as scratch, Bar("calibrations", progress) as tell:
        inputs = _Inputs(scratch)
        function = functools.partial(_pairs, *inputs.choices(several, settings, reading))
        # Invalid requests are reported before anything is sent.
        each = [_settings(model, settings) for model in several]
        if _are_drives(pairs):
            items, unread = [inputs.drive(drive) for drive in _drives.some(pairs, reading)[0]], list[str]()
        else:
            items, unread = inputs.trajectories(_files_of(pairs, scratch), reading)
        # Twice, because an unreadable single file would be an error and not a warning. Without a pair there are columns, too.
        found = [_table(_native.pairs_of_files(unread * 2, None, reading), each)]
        batches = dict(_found(client, function, items, inputs, tell, batch_seconds, retries))
    found += itertools.chain(*(batches[start] for start in sorted(batches)))
    columns = _joined([table for table, _ in found])
    for name in ("file", "reason"):
        columns[name] = [text and inputs.told(text) for text in columns[name]]
    told = [text for _, texts in found for text in texts]
    for text in _together(told, int(columns["pair"].max(initial=0))):
        warnings.warn(inputs.told(text), stacklevel=2)
    return table_like(columns, pairs)


def _program() -> str:
    """The version of leadlag and the state of its search: with the same ones, a seed gives the same result."""
    return _native.PROGRAM


def _separately(folder: Path) -> None:
    """Runs the call of a folder in a process with one thread; raises its error. The process notices the end of this one, because its input then ends."""
    paths = [str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
    own = {"PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1", "RAYON_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "leadlag.study"]
    read, write = os.pipe()
    # In a separate session, because Ctrl-C is for the waiting process.
    options: dict[str, Any] = {"cwd": folder, "env": {**os.environ, **own}, "start_new_session": True}
    try:
        done = subprocess.run(command, stdin=read, stderr=subprocess.PIPE, text=True, check=False, **options)
    finally:
        os.close(read)
        os.close(write)
    if done.returncode != 0:
        kind = {1: _native.Error, 2: _native.UsageError}.get(done.returncode, RuntimeError)
        raise kind(done.stderr.strip() or f"leadlag ended with {done.returncode}")


class _Inputs:
    """The files that workers need. They have other names there, because their folders do not exist there."""

    def __init__(self, scratch: str = "") -> None:
        #: A folder for texts of drives and tables.
        self.scratch = scratch
        #: Files of every batch.
        self.common: Files = {}
        self._folders: dict[str, str] = {}
        self._beside = functools.cache(lambda folder: [path.name for one in COMPANIONS for path in folder.glob(one)])

    def files(self, path: Path, there: str) -> Files:
        """A file and its companions, in the layout of the folder ``there``."""
        names = [path.name, *self._beside(path.parent), *(_quoted(path) if path.suffix == ".toml" else ())]
        return {f"{there}/{name}": path.parent / name for name in names if (path.parent / name).is_file()}

    def place(self, path: str) -> tuple[str, Files]:
        """The name of a file there, and what :meth:`files` has for it."""
        name = os.path.basename(path)
        there = self._folders.setdefault(path[: len(path) - len(name)], f"folder-{len(self._folders)}-of-the-client")
        return f"{there}/{name}", self.files(Path(path), there)

    def option(self, value: Any) -> Any:
        """An option or a model with the names there. A file that it names, as ``FILE#NAME`` and ``FILE.wgsl+delay`` do, goes with every batch."""
        text = os.fspath(value) if isinstance(value, (str, os.PathLike)) else ""
        path = re.split(r"#|(?<=\.wgsl)(?=\+)", text)[0]
        if not (Path(path).suffix and os.path.isfile(path)):
            return value
        name, files = self.place(path)
        self.common |= files
        return name + text[len(path) :]

    def choices(self, models: Sequence[Model], settings: Settings, reading: dict[str, Any]) -> tuple[Any, ...]:
        """Models, settings and options of reading with the names there."""
        names, single = _bounds(settings.get("bounds"))
        bounds = [*map(self.option, names), {name: (lower, upper) for name, lower, upper in single}]
        own = [
            Model(one.base if isinstance(one.base, tuple) else self.option(one.base), map(self.option, one.extend))
            for one in models
        ]
        return own, {**settings, "bounds": bounds}, {name: self.option(value) for name, value in reading.items()}

    def add_study(self, folder: Path) -> None:
        """Adds the three files of a study, and its data below ``data``."""
        study = json.loads((folder / "study.json").read_text())
        data = Path(study["data_folder"])
        self.common |= {name: folder / name for name in ("plan.toml", "study.json", "tasks.jsonl")}
        # Extensions are in study.json.
        quoted = {name for name in _quoted(folder / "plan.toml") if (data / name).is_file() and not name.endswith(".wgsl")}
        for name in sorted(quoted | {drive["file"] for drive in study["drives"]}):
            if Path(name).is_absolute() or ".." in Path(name).parts:
                raise _native.UsageError(f"{name}: expected a file in the data folder {data}; workers have no other one")
            self.common |= self.files(data / name, Path("data", name).parent.as_posix())

    def drive(self, drive: Drive) -> Item:
        """A drive as it is pickled, but with its text in a file."""
        reduced: Any = drive.__reduce__()
        origin, name, follower, options = reduced[1]
        if name is not None:
            text = Path(self.scratch, hashlib.sha256(origin).hexdigest())
            text.write_bytes(origin)
            origin = text
        file, files = self.place(os.fspath(origin))
        return files, ("", 0, (file, name, follower, {key: self.option(value) for key, value in options.items()}))

    def trajectories(self, paths: Sequence[str], reading: dict[str, Any]) -> tuple[list[Item], list[str]]:
        """The trajectories of files that have ids, otherwise whole files; and files that cannot be read."""
        seen = dict(zip(paths, _native.trajectories(paths, reading)))
        ids: dict[str, list[str | None]] = {}
        for path, own in seen.items():
            apart = len(set(own)) == len(own) and all(id and "," not in id and id.strip() == id for id in own)
            if own:
                ids[path] = own if apart else [None]
        # With its number, a file that is given twice counts as two. If none can be read, a worker gives the reason.
        places = [(number, *self.place(path), ids.get(path, [] if ids else [None])) for number, path in enumerate(paths)]
        items: list[Item] = [(files, (file, number, id)) for number, file, files, own in places for id in own]
        return items, [path for path in paths if ids and path not in ids]

    def told(self, text: str) -> str:
        """A message of a worker, with the local names of files."""
        for folder, there in self._folders.items():
            text = text.replace(f"{there}/", folder)
        return text.replace(f"{self.scratch}/", "") if self.scratch else text


def _quoted(path: Path) -> list[str]:
    """The quoted strings in a TOML file, including the names of other files."""
    return [one or other for one, other in re.findall(r"\"([^\"\n]+)\"|'([^'\n]+)'", path.read_text(errors="replace"))]


def _write_whole(folder: Path, name: str, content: bytes) -> None:
    """Writes a file whole or not at all. The temporary one is not among the parts, where other runs would remove it."""
    temporary = folder / f"{os.urandom(8).hex()}.tmp"
    with temporary.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, folder / name)


def _files_of(pairs: Any, scratch: str) -> list[str]:
    """Files as they are given, those of folders, or a table as a file."""
    if isinstance(pairs, (str, os.PathLike)):
        pairs = [pairs]
    if not (isinstance(pairs, Sequence) and all(isinstance(one, (str, os.PathLike)) for one in pairs)):
        path = Path(scratch, "table")
        path.write_bytes(text_of(pairs))
        return [str(path)]
    files = []
    for given in map(os.fspath, pairs):
        inside = [os.path.join(given, name) for name in sorted(os.listdir(given))] if os.path.isdir(given) else []
        tables = [path for path in inside if path.lower().endswith((".csv", ".txt", ".gz", ".parquet")) and os.path.isfile(path)]
        files += [path for path in tables if os.path.basename(path) not in COMPANIONS] or [given]
    return files


def _joined(tables: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Concatenated tables, with continuous numbers of pairs."""
    count = 0
    for table in tables:
        table["pair"] = table["pair"] + count
        count = int(table["pair"].max(initial=count))
    columns = {name: [table[name] for table in tables] for name in tables[0]}
    return {n: np.concatenate(p) if isinstance(p[0], np.ndarray) else [*itertools.chain(*p)] for n, p in columns.items()}


def _together(told: Sequence[str], pairs: int) -> list[str]:
    """Warnings, each once. The counts of doubtful pairs are added up."""
    form = re.compile(r"(\d+) of \d+ pairs have implausible signals: (.*?)(; the first: .*)", re.DOTALL)
    counts = [match for match in map(form.fullmatch, told) if match]
    doubtful = sum(int(match[1]) for match in counts)
    others = dict.fromkeys(text for text in told if not form.fullmatch(text))
    named = ", ".join(match[2] for match in counts)
    return [*others, *(f"{doubtful} of {pairs} pairs have implausible signals: {named}{match[3]}" for match in counts[:1])]


@dataclass
class _Batch:
    """Items that are computed together."""

    start: int
    items: Sequence[Item]
    files: Files
    worker: str = ""
    lost: int = 0


def _pieces(client: Any, path: Path) -> list[Any]:
    """A file on the cluster, in pieces by SHA-256. Dask brings them to the workers that need them, and makes lost ones again."""
    with path.open("rb") as file:
        pieces = iter(lambda: file.read(PIECE), b"")
        return [client.submit(bytes, piece, key=f"leadlag-{hashlib.sha256(piece).hexdigest()}") for piece in pieces]


def _found(
    client: Any,
    function: Callable[[list[Any]], Any],
    items: Sequence[Item],
    inputs: _Inputs,
    tell: Callable[[float, str], None] | None,
    batch_seconds: float,
    retries: int,
) -> Iterator[tuple[int, Any]]:
    """The results of a function for items, batch by batch in order of completion, each with the index of its first item."""
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise ImportError("leadlag.study needs Dask: `pip install distributed`, or leadlag[dask]") from error

    def compute(*words: Any) -> Any:
        # A function that is sent itself: the scheduler needs no leadlag, and a worker without it reports that.
        import leadlag.study

        return leadlag.study._compute(*words)

    waiting: list[_Batch] = []
    running: dict[Any, _Batch] = {}
    sent: dict[Path, list[Any]] = {}
    # Seconds per item, if known.
    taken, done, pace = 0, 0, batch_seconds / FIRST
    try:
        while taken < len(items) or waiting or running:
            client.wait_for_workers(1)
            threads = client.nthreads()
            room = AHEAD * sum(threads.values())
            while len(running) < room and (waiting or taken < len(items)):
                if not waiting:
                    # Few enough that all threads end at about the same time. But starting a process takes time, too.
                    most, share = batch_seconds / pace, (len(items) - taken) / room
                    own = items[taken : taken + max(1, round(min(most, max(share, most / 5))))]
                    files = {name: path for files, _ in own for name, path in files.items()}
                    waiting, taken = [_Batch(taken, own, {**inputs.common, **files})], taken + len(own)
                batch = waiting.pop()
                # Dask would place all batches beside the first input instead of spreading them over all workers.
                busy = Counter(other.worker for other in running.values())
                batch.worker = min(sorted(threads), key=lambda worker: busy[worker] / threads[worker])
                sent |= {path: _pieces(client, path) for path in batch.files.values() if path not in sent}
                pieces = {name: sent[path] for name, path in batch.files.items()}
                call = pickle.dumps(functools.partial(function, [one for _, one in batch.items]))
                where = {"workers": [batch.worker], "allow_other_workers": True}
                running[client.submit(compute, _program(), pieces, call, pure=False, **where)] = batch
            # The cluster keeps the data of batches under way.
            needed = {path for batch in running.values() for path in batch.files.values()}
            sent = {path: pieces for path, pieces in sent.items() if path in needed}
            look = time.monotonic() + LOOK
            while time.monotonic() < look and not any(future.done() for future in running):
                time.sleep(0.02)
            for future in [future for future in running if future.done()]:
                batch = running.pop(future)
                try:
                    answer, seconds = future.result()
                except _native.Error as error:
                    raise type(error)(inputs.told(str(error))) from error
                except ImportError as error:
                    raise _native.Error(f"worker {batch.worker} has no such leadlag as this process: {error}") from error
                except Exception as error:
                    # Dask drops a batch after several workers have died with it. A worker may end while its answer is fetched.
                    batch.lost += 1
                    if batch.lost > retries:
                        raise _native.Error(f"lost {batch.lost} times, lastly by {batch.worker}: {error!r}") from error
                    waiting.append(batch)
                    continue
                done += len(batch.items)
                pace = seconds / len(batch.items)
                yield batch.start, answer
            if tell is not None:
                tell(done / len(items), f"{done} of {len(items)}, {sum(threads.values())} threads")
    finally:
        client.cancel(list(running))


def _compute(program: str, files: dict[str, list[bytes]], call: bytes) -> tuple[Any, float]:
    """On a worker: runs a call in a separate process, in a folder with these files. Returns the answer, and the time [s]."""
    from distributed import get_worker

    began, worker = time.monotonic(), get_worker()
    if program != _program():
        text = f"worker {worker.address} has {_program()}, and this process has {program}"
        raise _native.Error(f"{text}: results may differ; install the same one")
    with tempfile.TemporaryDirectory(dir=worker.local_directory) as name:
        folder = Path(name)
        for path, pieces in {**files, "call": [call]}.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            with (folder / path).open("wb") as file:
                file.writelines(pieces)
        _separately(folder)
        return pickle.loads((folder / "answer").read_bytes()), time.monotonic() - began


def _study(tasks: Sequence[str]) -> dict[str, bytes]:
    """In that process: computes tasks of the study; returns parts and log by their names in the folder."""
    _native.run_study(".", "data", tasks)
    # Processes of two machines may have the same number.
    logs = {f"runs/{path.stem}-{os.urandom(4).hex()}.json": path.read_bytes() for path in Path("runs").glob("*.json")}
    return {**{f"parts/{task}.json": Path(f"parts/{task}.json").read_bytes() for task in tasks}, **logs}


def _pairs(models: Sequence[Model], settings: Settings, reading: dict[str, Any], items: Sequence[Any]) -> list[Any]:
    """In that process: calibrates drives or trajectories, as :class:`_Inputs` has them; returns tables with their warnings."""
    each = [_settings(model, settings) for model in models]
    again = getattr(_native, "_again")
    found = []
    for (file, _), some in itertools.groupby(items, lambda item: item[:2]):
        own = [one for _, _, one in some]
        if not file:
            drives = [again(file if name is None else Path(file).read_bytes(), name, *rest) for file, name, *rest in own]
            found.append(_table(_native.pairs_of_drives(drives), each))
        else:
            chosen = reading if own[0] is None else {**reading, "trajectory": ",".join(own)}
            found.append(_table(_native.pairs_of_files([file], None, chosen), each))
    return found


def _table(pairs: _native.Pairs, each: Sequence[_native.Calibration]) -> tuple[dict[str, Any], list[str]]:
    return _native.calibrate_pairs(pairs, each, None)[0], pairs.warnings


def _main() -> int:
    """That process: runs the call of the folder, and writes the answer there."""
    # The pipe closes with the worker, however the worker ends.
    threading.Thread(target=lambda: (os.read(0, 1), os._exit(1)), daemon=True).start()
    try:
        answer = pickle.loads(Path("call").read_bytes())()
    except _native.Error as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, _native.UsageError) else 1
    Path("answer").write_bytes(pickle.dumps(answer))
    return 0


if __name__ == "__main__":
    sys.exit(_main())
