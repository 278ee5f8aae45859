"""Studies and fleets on the workers of a Dask client.

    from distributed import Client
    import leadlag.study

    with Client("scheduler:8786") as client:
        merged = leadlag.study.run("plan.toml", client, "study")
        rows = leadlag.study.fleet("tracks.csv", ["idm", "gipps+delay"], client, reading={"columns": "highd"})

No folder need be common. A worker gets each input once, by its SHA-256, into the folder that Dask gives it. It computes batches of some seconds,
each in a process of its own with one thread, and sends back what was found. What a lost worker had is computed by another. Results have the same
bytes as those of one process.
"""

from __future__ import annotations

import contextlib
import hashlib
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
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from . import _native
from ._api import Drive, Model, ModelLike, Settings, _many, _settings
from ._frames import table_like, text_of
from ._progress import Bar

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Bytes of an input that are sent at a time.
PIECE = 16 << 20
#: Batches per thread: one is computed, another waits.
AHEAD = 2
#: Items of the first batches, before anything is known of their time.
FIRST = 4
#: Files that leadlag reads where they lie beside one that it is given.
COMPANIONS = ("Labels.csv", "Slope.csv", "mfc_*.csv")
#: Files that one command looks at.
AT_ONCE = 100
#: Larger tables name no other files.
SMALL = 1 << 20

Job = dict[str, Any]
Manifest = dict[str, str]


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
    """Computes a study on the workers of a client, and merges it; returns the folder of the tables.

    ``plan``: a plan file. ``out``: the folder of the study, which is made, or gone on with. ``data``: the folder of the data, in place of the one that
    the plan names; files must lie in it. ``batch_seconds``: what a batch of tasks should take. ``retries``: how often a task may be lost with its
    worker.

    The tables have the same bytes as those of ``leadlag study plan``, ``run`` and ``merge``. A part is put into the folder whole or not at all. After
    an interruption the same call goes on.

    Raises :class:`leadlag.UsageError` for a plan that cannot be, :class:`leadlag.Error` where a task fails or a worker has another version.
    """
    _distributed()
    folder = Path(out)
    planned = ["study", "plan", os.fspath(plan), "--out", os.fspath(folder)]
    _program([*planned, *([] if data is None else ["--data", os.fspath(data)])])
    missing: list[str] = json.loads(_program(["study", "status", os.fspath(folder), "--json"]))["missing"]
    if missing:
        inputs = _Inputs()
        manifest = _study_inputs(folder, inputs)

        def job(ids: Sequence[str]) -> Job:
            return {"kind": "study", "place": manifest, "ids": list(ids)}

        def keep(answer: Job, _: Sequence[str]) -> None:
            for name, content in answer["parts"].items():
                _write_part(folder, name, content)
            for name, content in answer["logs"].items():
                _write_whole(folder, folder / "runs" / name, content)

        with Bar("study", progress) as tell:
            _Crew(client, inputs, batch_seconds, retries).work(missing, job, keep, tell, "tasks")
    _program(["study", "merge", os.fspath(folder)])
    return folder / "merged"


def fleet(
    pairs: Any,
    models: ModelLike | Sequence[ModelLike],
    client: Any,
    *,
    batch_seconds: float = 10.0,
    retries: int = 10,
    progress: bool = True,
    reading: dict[str, Any] | None = None,
    **settings: Unpack[Settings],
) -> Any:
    """:func:`leadlag.calibrate_all` on the workers of a client: the same rows in the same order.

    ``batch_seconds`` and ``retries`` are as of :func:`run`; the rest is as of :func:`leadlag.calibrate_all`.
    """
    _distributed()
    several = [models] if isinstance(models, (str, int, Model)) else list(models)
    for model in several:
        # What cannot be is told before anything is sent.
        _settings(model, settings)
    inputs = _Inputs()
    sent: Job = {**settings}
    bounds = settings.get("bounds")
    if bounds is not None:
        each = [bounds] if isinstance(bounds, (str, os.PathLike, dict)) else list(bounds)
        sent["bounds"] = [one if isinstance(one, dict) else inputs.named(one) for one in each]
    common: Job = {"kind": "fleet", "models": [_portable(model) for model in several], "settings": sent}
    told: list[str] = []
    if isinstance(pairs, Drive) or (isinstance(pairs, Sequence) and pairs and all(isinstance(p, Drive) for p in pairs)):
        items = [inputs.drive(drive) for drive in _many(pairs)]
    else:
        options = {name: inputs.named(value) for name, value in (reading or {}).items() if value is not None}
        common["reading"] = options
        items, told = _pairs_of(pairs, reading or {}, inputs)
    found: dict[int, tuple[list[Job], list[str]]] = {}

    def job(chosen: Sequence[int]) -> Job:
        return {**common, "items": [items[k] for k in chosen]}

    def keep(answer: Job, chosen: Sequence[int]) -> None:
        found[chosen[0]] = (answer["tables"], answer["told"])

    with Bar("calibrations", progress) as tell:
        _Crew(client, inputs, batch_seconds, retries).work(range(len(items)), job, keep, tell, "pairs")
    tables = [table for k in sorted(found) for table in found[k][0]]
    told += [text for k in sorted(found) for text in found[k][1]]
    for text in _together(told):
        warnings.warn(text, stacklevel=2)
    return table_like(_joined(tables), pairs)


# The machine that has the client.


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise ImportError(
            "leadlag.study needs Dask, which is not installed: `pip install distributed`, or leadlag[dask]"
        ) from error
    return distributed


def _environment() -> dict[str, str]:
    """The environment in which another process finds this package."""
    paths = [str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1"}


def _program(words: Sequence[str]) -> str:
    """What the command line prints."""
    command = [sys.executable, "-m", "leadlag._program", "--quiet", *words]
    done = subprocess.run(command, capture_output=True, text=True, env=_environment(), check=False)
    if done.returncode != 0:
        kind = _native.UsageError if done.returncode == 2 else _native.Error
        raise kind(done.stderr.strip().removeprefix("error: ") or f"leadlag {words[0]} ended with {done.returncode}")
    return done.stdout


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


class _Inputs:
    """The inputs of a job by SHA-256, and where they are."""

    def __init__(self) -> None:
        self.content: dict[str, bytes | Path] = {}
        self._known: dict[Path, str] = {}
        self._places: dict[Path, Manifest] = {}

    def text(self, content: bytes) -> str:
        digest = _digest(content)
        self.content.setdefault(digest, content)
        return digest

    def file(self, path: Path) -> str:
        if path not in self._known:
            with path.open("rb") as file:
                sum_ = hashlib.sha256()
                while piece := file.read(PIECE):
                    sum_.update(piece)
            self._known[path] = sum_.hexdigest()
            self.content.setdefault(sum_.hexdigest(), path)
        return self._known[path]

    def place(self, path: Path) -> Manifest:
        """A file with those that are read beside it."""
        if path not in self._places:
            beside = [other for pattern in COMPANIONS for other in sorted(path.parent.glob(pattern)) if other.is_file()]
            self._places[path] = {one.name: self.file(one) for one in [path, *beside, *_mentioned(path)]}
        return self._places[path]

    def named(self, value: Any) -> Any:
        """The value of an option; one that names a file here, such as ``FILE#NAME``, says where a worker finds it."""
        if not isinstance(value, (str, os.PathLike)):
            return value
        name, mark, rest = os.fspath(value).partition("#")
        path = Path(name)
        if not path.is_file():
            return value
        return {"place": self.place(path), "name": path.name, "rest": mark + rest}

    def drive(self, drive: Drive) -> Job:
        """A drive as it is made again on a worker."""
        again: Any = drive.__reduce__()
        origin, name, follower, options = again[1]
        item: Job = {"follower": follower, "name": name}
        item["options"] = {key: self.named(value) for key, value in options.items()}
        if name is None:
            item["file"] = {"place": self.place(Path(origin)), "name": Path(origin).name, "given": str(origin)}
        else:
            item["text"] = self.text(bytes(origin))
        return item

    def pieces(self, digest: str) -> Iterator[tuple[int, bytes, bool]]:
        """The bytes of an input: where they begin, and whether they are the last."""
        content = self.content[digest]
        if isinstance(content, bytes):
            for start in range(0, max(len(content), 1), PIECE):
                yield start, content[start : start + PIECE], start + PIECE >= len(content)
            return
        with content.open("rb") as file:
            start, piece = 0, file.read(PIECE)
            while True:
                following = file.read(PIECE)
                yield start, piece, not following
                if not following:
                    return
                start, piece = start + len(piece), following


def _mentioned(path: Path) -> list[Path]:
    """Files of the same folder that a small table names, as a vehicle table names its curves."""
    if path.suffix.lower() != ".csv" or path.stat().st_size > SMALL:
        return []
    words = {word for word in re.split(r"[,;\t\r\n\"]+", path.read_text(errors="replace")) if word.endswith(".csv")}
    return sorted(path.parent / word for word in words if Path(word).name == word and (path.parent / word).is_file())


def _study_inputs(folder: Path, inputs: _Inputs) -> Manifest:
    """What a worker needs of a study: its three files, and the data below ``data/``."""
    study = json.loads((folder / "study.json").read_text())
    manifest = {name: inputs.file(folder / name) for name in ("plan.toml", "study.json", "tasks.jsonl")}
    data = Path(study["data_folder"])
    named = {drive["file"] for drive in study["drives"]}
    # Vehicle tables, grades and column maps are named in the plan as well.
    quoted = re.findall(r"\"([^\"\n]*)\"|'([^'\n]*)'", (folder / "plan.toml").read_text())
    named |= {text for pair in quoted for text in pair if text and (data / text).is_file()}
    for name in sorted(named):
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise _native.UsageError(
                f"{name}: expected a file in the data folder {data}, by its name from there on; workers have no other folder"
            )
        for beside, digest in inputs.place(data / name).items():
            manifest[(Path("data") / name).with_name(beside).as_posix()] = digest
    return manifest


def _write_whole(folder: Path, path: Path, content: bytes) -> None:
    """Writes a file whole or not at all. The temporary one is not among the parts, where other runs would tidy it up."""
    path.parent.mkdir(exist_ok=True)
    temporary = folder / f"{path.stem}.{os.getpid()}-{os.urandom(8).hex()}.tmp"
    try:
        with temporary.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _write_part(folder: Path, name: str, content: bytes) -> None:
    line, _, rest = content.partition(b"\n")
    if rest.decode(errors="replace") != _digest(line) + "\n" or json.loads(line)["id"] != name:
        raise _native.Error(f"task {name}: what a worker sent is no whole part")
    _write_whole(folder, folder / "parts" / f"{name}.json", content)


def _portable(model: ModelLike) -> tuple[str, list[Any]]:
    """A model whose extensions are texts."""
    asked = model if isinstance(model, Model) else Model(model)
    extend: list[Any] = []
    for one in asked.extend:
        is_file = isinstance(one, str) and Path(one).is_file()
        extend.append((Path(one).stem, Path(one).read_text()) if is_file and isinstance(one, str) else one)
    return asked.base, extend


def _pairs_of(pairs: Any, reading: dict[str, Any], inputs: _Inputs) -> tuple[list[Job], list[str]]:
    """The pairs of files or of a table: an item for each trajectory that has an id, else for each file. Beside them, why files cannot be read."""
    if isinstance(pairs, (str, os.PathLike)):
        pairs = [pairs]
    elif not (isinstance(pairs, Sequence) and pairs and all(isinstance(p, (str, Path)) for p in pairs)):
        text = text_of(pairs)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "table.csv"
            path.write_bytes(text)
            (ids,), told = _ids([path], reading)
        if ids is None:
            raise _native.Error(told[0].replace(str(path), "table"))
        item: Job = {"text": inputs.text(text)}
        return [{**item, "ids": one} for one in ids], []
    files: list[Path] = []
    for given in map(Path, pairs):
        endings = (".csv", ".txt", ".gz", ".parquet")
        inside = sorted(p for p in given.iterdir() if p.is_file() and p.suffix.lower() in endings) if given.is_dir() else [given]
        if not inside:
            raise _native.Error(f"{given}: the folder has no tables ({', '.join(endings)})")
        files += inside
    found, told = _ids(files, reading)
    if len(files) == 1 and found[0] is None:
        raise _native.Error(told[0])
    items: list[Job] = []
    for path, ids in zip(files, found):
        if ids is not None:
            file = {"place": inputs.place(path), "name": path.name, "given": str(path)}
            items += [{"file": file, "ids": one} for one in ids]
    return items, told


def _ids(files: Sequence[Path], reading: dict[str, Any]) -> tuple[list[list[str | None] | None], list[str]]:
    """The ids of the trajectories of each file, [None] where they have none, or None where it cannot be read; and why not."""
    flags: list[str] = []
    for option, flag in [("layout", "--layout"), ("columns", "--columns"), ("trajectory", "--trajectory"), ("lead_length", "--lead-length")]:
        if reading.get(option) is not None:
            flags += [flag, str(reading[option])]
    found: list[list[str | None] | None] = []
    told: list[str] = []

    def look(some: Sequence[Path]) -> None:
        try:
            seen = json.loads(_program(["inspect", *map(os.fspath, some), "--json", *flags]))
        except _native.Error as error:
            if len(some) == 1:
                found.append(None)
                told.append(str(error))
                return
            # One of them cannot be read: which?
            for one in some:
                look([one])
            return
        for file in [seen] if len(some) == 1 else seen:
            ids = [platoon.get("id") for platoon in file["platoons"]]
            whole = len(set(ids)) < len(ids) or any(one is None or "," in one or one.strip() != one for one in ids)
            found.append([None] if whole else ids)

    for start in range(0, len(files), AT_ONCE):
        look(files[start : start + AT_ONCE])
    return found, told


def _joined(tables: Sequence[Job]) -> Job:
    """Tables below each other; pairs are numbered on."""
    columns: Job = {}
    before = 0
    for table in tables:
        table["pair"] = np.asarray(table["pair"]) + before
        before = int(table["pair"][-1])
    for name in tables[0] if tables else ():
        parts = [table[name] for table in tables]
        arrays = all(isinstance(part, np.ndarray) for part in parts)
        columns[name] = np.concatenate(parts) if arrays else [value for part in parts for value in part]
    return columns


def _together(told: Iterable[str]) -> list[str]:
    """The warnings of all batches, each once; counts of doubtful pairs are added up."""
    form = re.compile(r"(\d+) of (\d+) (pairs have implausible signals; the first: .*)", re.DOTALL)
    texts: dict[str, None] = {}
    doubtful, whole, first = 0, 0, ""
    for text in told:
        if match := form.fullmatch(text):
            doubtful, whole, first = doubtful + int(match[1]), whole + int(match[2]), first or match[3]
        else:
            texts[text] = None
    return [*texts, *([f"{doubtful} of {whole} {first}"] if doubtful else [])]


class _Crew:
    """The workers of a client: gives them inputs and batches, and takes back what they found."""

    def __init__(self, client: Any, inputs: _Inputs, batch_seconds: float, retries: int) -> None:
        self.client = client
        self.inputs = inputs
        self.batch_seconds = batch_seconds
        self.retries = retries
        #: Seconds per item, as far as they are known.
        self.pace: float | None = None

    def work(
        self,
        items: Sequence[Any],
        job: Callable[[Sequence[Any]], Job],
        keep: Callable[[Job, Sequence[Any]], None],
        tell: Callable[[float, str], None] | None,
        what: str,
    ) -> None:
        """Has all items computed. ``keep`` is given each answer with its items, once."""
        distributed = _distributed()
        self.client.wait_for_workers(1)
        self._greet()
        # Ranges of items, so that the order of what is found is known by the first one.
        waiting: deque[Sequence[Any]] = deque([items]) if items else deque()
        running: dict[Any, Sequence[Any]] = {}
        lost: Counter[Any] = Counter()
        done = 0
        try:
            while waiting or running:
                threads = max(1, sum(self.client.nthreads().values()))
                while waiting and len(running) < AHEAD * threads:
                    chosen = self._batch(waiting, threads)
                    running[self._submit(job(chosen))] = chosen
                with contextlib.suppress(TimeoutError, distributed.TimeoutError):
                    distributed.wait(list(running), timeout=1.0, return_when="FIRST_COMPLETED")
                for future in [future for future in running if future.done()]:
                    chosen = running.pop(future)
                    answer = self._answer(future, chosen, lost)
                    if answer is None:
                        waiting.appendleft(chosen)
                    elif "lacks" in answer:
                        lost["inputs", chosen[0]] += 1
                        if lost["inputs", chosen[0]] > self.retries:
                            raise _native.Error("inputs do not arrive as they were read: a file changes, or a disk is full")
                        self._give(answer["lacks"], [answer["worker"]])
                        running[self._submit(job(chosen), answer["worker"])] = chosen
                    else:
                        keep(answer, chosen)
                        done += len(chosen)
                        pace = answer["seconds"] / len(chosen)
                        self.pace = pace if self.pace is None else 0.7 * self.pace + 0.3 * pace
                if tell is not None:
                    tell(done / len(items), f"{done} of {len(items)} {what}, {threads} threads")
        finally:
            self.client.cancel(list(running))

    def _batch(self, waiting: deque[Sequence[Any]], threads: int) -> Sequence[Any]:
        """The next items: of some seconds, and few enough that all threads end at about the same time; but starting a process takes time, too."""
        range_ = waiting.popleft()
        left = len(range_) + sum(map(len, waiting))
        share = -(-left // (AHEAD * threads))
        size = min(FIRST, share)
        if self.pace is not None:
            most = self.batch_seconds / max(self.pace, 1e-6)
            size = int(min(most, max(share, most / 5)))
        size = max(1, size)
        if len(range_) > size:
            waiting.appendleft(range_[size:])
        return range_[:size]

    def _submit(self, job: Job, worker: str | None = None) -> Any:
        where: Job = {} if worker is None else {"workers": [worker], "allow_other_workers": True}
        return self.client.submit(_batch, {**job, "version": _native.__version__}, pure=False, retries=self.retries, **where)

    def _answer(self, future: Any, chosen: Sequence[Any], lost: Counter[Any]) -> Job | None:
        """What a batch has found; None if it was lost."""
        try:
            answer: Job = future.result()
        except _native.Error:
            raise
        except Exception as error:
            # Dask gives up a task after some workers died with it, whatever the reason; a worker may end while its answer is fetched.
            first = chosen[0]
            lost[first] += 1
            if lost[first] > self.retries:
                raise _native.Error(f"{first}: lost {lost[first]} times, the last time: {error!r}") from error
            return None
        if "error" in answer:
            raise _native.Error(f"worker {answer['worker']}: {answer['error']}")
        return answer

    def _greet(self) -> None:
        """Looks whether all workers have this version, and gives them what they lack."""
        digests = list(self.inputs.content)
        try:
            states = self.client.run(_state, digests, on_error="return")
        except ModuleNotFoundError as error:
            raise _native.Error(f"the scheduler or a worker cannot import leadlag: {error}") from error
        lacking: dict[str, list[str]] = {}
        for worker, state in states.items():
            if isinstance(state, ModuleNotFoundError):
                raise _native.Error(f"worker {worker} cannot import leadlag: {state}; install leadlag {_native.__version__} there")
            if isinstance(state, Exception):
                # It ended meanwhile.
                continue
            version, lacks = state
            if version != _native.__version__:
                raise _native.Error(_other_version(worker, version, _native.__version__))
            for digest in lacks:
                lacking.setdefault(digest, []).append(worker)
        for digest, workers in lacking.items():
            self._give([digest], workers)

    def _give(self, digests: Sequence[str], workers: Sequence[str]) -> None:
        """Sends inputs to workers. One that ends meanwhile needs none; its successor says what it lacks."""
        token = os.urandom(8).hex()
        for digest in digests:
            for start, piece, last in self.inputs.pieces(digest):
                present = self.client.nthreads()
                there = [worker for worker in workers if worker in present]
                if there:
                    self.client.run(_keep, digest, token, start, piece, last, workers=there, on_error="ignore")


def _other_version(worker: str, version: str, here: str) -> str:
    return f"worker {worker} has leadlag {version}, and this process has {here}: results may differ; install the same version"


# A worker.


def _cache(directory: str) -> Path:
    folder = Path(directory) / "leadlag"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _state(digests: Sequence[str], dask_worker: Any) -> tuple[str, list[str]]:
    """The version of this package, and which inputs are not there."""
    cache = _cache(dask_worker.local_directory)
    return _native.__version__, [digest for digest in digests if not (cache / digest).is_file()]


def _keep(digest: str, token: str, start: int, piece: bytes, last: bool, dask_worker: Any) -> None:
    """Takes a piece of an input; with the last one it is there, if it is what its name says."""
    cache = _cache(dask_worker.local_directory)
    growing = cache / f"{digest}.{token}"
    with growing.open("r+b" if start else "wb") as file:
        file.seek(start)
        file.write(piece)
    if last:
        sum_ = hashlib.sha256()
        with growing.open("rb") as file:
            while part := file.read(PIECE):
                sum_.update(part)
        if sum_.hexdigest() == digest:
            os.replace(growing, cache / digest)
        else:
            growing.unlink()


_LAYING_OUT = threading.Lock()


def _laid_out(cache: Path, manifest: Manifest) -> Path:
    """A folder with these files, made once."""
    folder = cache / ("place-" + _digest(json.dumps(sorted(manifest.items())).encode())[:24])
    with _LAYING_OUT:
        if not folder.is_dir():
            growing = Path(tempfile.mkdtemp(dir=cache))
            for name, digest in manifest.items():
                path = growing / name
                path.parent.mkdir(parents=True, exist_ok=True)
                try:
                    os.link(cache / digest, path)
                except OSError:
                    path.write_bytes((cache / digest).read_bytes())
            os.replace(growing, folder)
    return folder


def _digests(value: Any) -> Iterator[str]:
    """The inputs that a job names."""
    if isinstance(value, dict):
        for key, inside in value.items():
            if key == "place":
                yield from inside.values()
            elif key == "text" and isinstance(inside, str):
                yield inside
            else:
                yield from _digests(inside)
    elif isinstance(value, (list, tuple)):
        for inside in value:
            yield from _digests(inside)


def _resolved(value: Any, cache: Path) -> Any:
    """An option with the name that its file has here."""
    if isinstance(value, dict) and "place" in value:
        return str(_laid_out(cache, value["place"]) / value["name"]) + value.get("rest", "")
    if isinstance(value, list):
        return [_resolved(inside, cache) for inside in value]
    return value


class _Ended(Exception):
    """The process that computed was killed."""


def _batch(job: Job) -> Job:
    """Computes a batch in a process of its own, which ends with this one."""
    from distributed import get_worker

    worker = get_worker()
    began, cache = time.monotonic(), _cache(worker.local_directory)
    if job["version"] != _native.__version__:
        return {"error": _other_version(worker.address, _native.__version__, job["version"]), "worker": worker.address}
    lacks = sorted({digest for digest in _digests(job) if not (cache / digest).is_file()})
    if lacks:
        return {"lacks": lacks, "worker": worker.address}
    compute = _study_batch if job["kind"] == "study" else _fleet_batch
    return {**compute(job, cache), "worker": worker.address, "seconds": time.monotonic() - began}


def _study_batch(job: Job, cache: Path) -> Job:
    folder = _laid_out(cache, job["place"])
    words = ["--quiet", "--threads", "1", "study", "run", str(folder), "--data", str(folder / "data"), "--batch", "2"]
    for name in job["ids"]:
        words += ["--task", name]
    code, said, process = _computed({"kind": "study", "words": words}, cache)
    parts = {name: folder / "parts" / f"{name}.json" for name in job["ids"]}
    if code != 0 or not all(path.is_file() for path in parts.values()):
        return {"error": said.removeprefix("error: ") or f"leadlag study run ended with {code}"}
    logs = {f"{path.stem}-{os.urandom(4).hex()}.json": path.read_bytes() for path in (folder / "runs").glob(f"*-{process}.json")}
    return {"parts": {name: path.read_bytes() for name, path in parts.items()}, "logs": logs}


def _fleet_batch(job: Job, cache: Path) -> Job:
    own: Job = {"kind": "fleet", "models": job["models"], "calls": []}
    own["settings"] = {name: _resolved(value, cache) for name, value in job["settings"].items()}
    reading = {name: _resolved(value, cache) for name, value in job.get("reading", {}).items()}
    names: dict[str, str] = {}
    for item in job["items"]:
        path = None
        if "file" in item:
            path = _resolved(item["file"], cache)
            names[path] = item["file"]["given"]
        text = str(cache / item["text"]) if "text" in item else None
        calls = own["calls"]
        if "ids" not in item:
            options = {name: _resolved(value, cache) for name, value in item["options"].items()}
            drive = (path or text, item["name"], item["follower"], options)
            if not calls:
                calls.append({"drives": []})
            calls[0]["drives"].append(drive)
        elif calls and item["ids"] is not None and (calls[-1]["path"], calls[-1]["text"]) == (path, text):
            calls[-1]["reading"]["trajectory"] += "," + item["ids"]
        else:
            chosen = reading if item["ids"] is None else {**reading, "trajectory": item["ids"]}
            calls.append({"path": path, "text": text, "reading": chosen})
    with tempfile.TemporaryDirectory(dir=cache) as folder:
        answer = Path(folder) / "answer"
        code, said, _ = _computed({**own, "answer": str(answer)}, cache)
        if code != 0:
            return {"error": said or f"the process ended with {code}"}
        found: Job = pickle.loads(answer.read_bytes())
    # Names of files are those that they have where the client is.
    for here, given in names.items():
        found["told"] = [text.replace(here, given) for text in found["told"]]
        for table in found["tables"]:
            for name, values in table.items():
                if isinstance(values, list):
                    table[name] = [value.replace(here, given) if isinstance(value, str) else value for value in values]
    return found


def _computed(job: Job, folder: Path) -> tuple[int, str, int]:
    """Does a job in a process with one thread; returns its exit code, its last words and its number."""
    command = [sys.executable, "-m", "leadlag.study"]
    environment = {**_environment(), "RAYON_NUM_THREADS": "1"}
    with (
        tempfile.TemporaryFile() as said,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said, env=environment, cwd=folder
        ) as process,
    ):
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(pickle.dumps(job))
            process.stdin.flush()
        code = process.wait()
        said.seek(0)
        text = said.read().decode(errors="replace").strip()
    if code < 0:
        raise _Ended(f"the process that computed was ended by signal {-code}; {text}".strip("; "))
    return code, text, process.pid


# The process that computes.


def _end_with_the_worker() -> None:
    """The pipe closes when the worker ends, however it ends."""
    while os.read(0, 1):
        pass
    os._exit(1)


def _main() -> int:
    job: Job = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_the_worker, daemon=True).start()
    if job["kind"] == "study":
        return _native.run(["leadlag", *job["words"]])
    each = [_settings(Model(base, extend), cast(Settings, job["settings"])) for base, extend in job["models"]]
    again = getattr(_native, "_again")
    tables: list[Job] = []
    told: list[str] = []
    try:
        for call in job["calls"]:
            if "drives" in call:
                drives = [
                    again(origin if name is None else Path(origin).read_bytes(), name, follower, options)
                    for origin, name, follower, options in call["drives"]
                ]
                table, said, interrupted = _native.calibrate_drives(drives, each, None)
            elif call["text"] is not None:
                text = Path(call["text"]).read_bytes()
                table, said, interrupted = _native.calibrate_files([], text, each, call["reading"], None)
            else:
                table, said, interrupted = _native.calibrate_files([call["path"]], None, each, call["reading"], None)
            if interrupted is not None:
                raise interrupted
            tables.append(dict(table))
            told += said
    except _native.Error as error:
        print(error, file=sys.stderr)
        return 1
    Path(job["answer"]).write_bytes(pickle.dumps({"tables": tables, "told": told}))
    return 0


if __name__ == "__main__":
    sys.exit(_main())
