"""The functions of the package."""

from __future__ import annotations

import difflib
import os
import re
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._frames import table_like, text_of
from ._progress import Bar

if TYPE_CHECKING:
    from typing_extensions import Unpack

Drive = _native.Drive
Extension = str | os.PathLike[str] | tuple[str, str]


class Model:
    """A model: a base with parts and extensions.

    ``base``: a variant by name or id, such as ``"idm+delay"``, ``"gipps+delay+linear+mfc"`` or ``31``; a built-in law, such as ``"krauss"``; a file
    with a law of your own, ``"my_law.wgsl+delay"``; or the WGSL text of one, whose function ``NAME_law`` gives it its name.
    ``extend``: what the model has beyond it, each the name of a built-in cause (``"actuation_lag"``), the path of a WGSL file, or a pair
    ``(name, text)`` of WGSL text whose functions begin with that name.
    ``parts``: what goes with a law that is given as text, such as ``"delay+linear"``.
    """

    base: str | tuple[str, str, str]

    def __init__(
        self, base: str | int | tuple[str, str, str], extend: Iterable[Extension] = (), parts: str = ""
    ) -> None:
        if isinstance(extend, (str, os.PathLike)):
            extend = [extend]
        self.extend = [(str(e[0]), str(e[1])) if isinstance(e, tuple) else os.fspath(e) for e in extend]
        parts = f"+{parts.lstrip('+')}" if parts else ""
        if isinstance(base, tuple):
            self.base = base
            return
        text = str(base)
        if "\n" not in text:
            self.base = text + parts
            return
        law = re.search(r"\bfn\s+([a-z][a-z0-9_]*)_law\s*\(", text)
        if law is None:
            raise _native.UsageError(
                "the text has no function NAME_law, so it is no law; an extension is given by extend=[(name, text)]"
            )
        self.base = (law[1], text, parts)

    def __repr__(self) -> str:
        base = self.base[0] + self.base[2] if isinstance(self.base, tuple) else self.base
        names = [e[0] if isinstance(e, tuple) else e for e in self.extend]
        return f"Model({', '.join([base, *names])})"


ModelLike = str | int | Model
BoundsLike = str | os.PathLike[str] | dict[str, tuple[float, float] | float]


class Settings(TypedDict, total=False):
    """Settings of a calibration, each a keyword; see :func:`calibrate`."""

    bounds: BoundsLike | Iterable[BoundsLike] | None
    fix: dict[str, float] | None
    gof: str | None
    convention: str | None
    optimizer: str | None
    seed: int | None
    replicates: int | None
    max_evaluations: int | None
    intervals: bool | None
    device: str | None
    precision: str | None


def _bounds(
    given: BoundsLike | Iterable[BoundsLike] | None,
) -> tuple[list[str], list[tuple[str, float, float]]]:
    """Sets and files by name, and bounds of single parameters; one number fixes a parameter."""
    if given is None:
        given = ()
    each: Iterable[BoundsLike] = [given] if isinstance(given, (str, os.PathLike, dict)) else given
    names: list[str] = []
    single: list[tuple[str, float, float]] = []
    for one in each:
        if not isinstance(one, dict):
            names.append(os.fspath(one))
            continue
        for name, ends in one.items():
            lower, upper = (ends, ends) if isinstance(ends, (int, float)) else ends
            single.append((name, float(lower), float(upper)))
    return names, single


def _settings(model: ModelLike, given: Settings) -> _native.Calibration:
    """The settings of a calibration; what is None is left as it is by default."""
    known = list(Settings.__annotations__)
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise _native.UsageError(f"no setting is called {name}: expected {', '.join(known)}{hint}")
    asked = model if isinstance(model, Model) else Model(model)
    one = _native.Calibration(asked.base, asked.extend)
    names, single = _bounds(given.get("bounds"))
    for name in names:
        one = one.bounds(name)
    for name, lower, upper in single:
        one = one.bound(name, lower, upper)
    for name, value in (given.get("fix") or {}).items():
        one = one.fix(name, float(value))
    one = one.words(
        given.get("gof"), given.get("convention"), given.get("optimizer"), given.get("device"), given.get("precision")
    )
    return one.numbers(
        given.get("seed"), given.get("replicates"), given.get("max_evaluations"), given.get("intervals")
    )


def _several(models: ModelLike | Sequence[ModelLike]) -> list[Model]:
    """One model or several, as a list."""
    several = [models] if isinstance(models, (str, int, Model)) else models
    return [model if isinstance(model, Model) else Model(model) for model in several]


def _many(drives: Drive | Iterable[Drive]) -> list[Drive]:
    """One drive or several, as a list."""
    found = [drives] if isinstance(drives, Drive) else list(drives)
    for one in found:
        if not isinstance(one, Drive):
            raise TypeError(f"expected a Drive, found {type(one).__name__}: leadlag.Drive(table) makes one of a table")
    if not found:
        raise _native.UsageError("expected at least one drive")
    return found


def _warn(texts: Iterable[str]) -> None:
    for text in texts:
        warnings.warn(text, stacklevel=3)


def calibrate(
    drive: Drive | Iterable[Drive], model: ModelLike, *, progress: bool = True, **settings: Unpack[Settings]
) -> _native.Fit:
    """Calibrates a model on a drive; on several, one parameter set for all.

    ``model``: a variant by name or id, or a :class:`Model` with extensions. Settings, each a keyword:

    - ``bounds``: ``"acc"`` (the paper's, the default), ``"human"``, the path of a TOML file, ``{"v_0": (25, 40)}``, where one number fixes a parameter, or several of these;
    - ``fix``: values of parameters that are not searched, by name;
    - ``gof``: what is minimised, such as ``"nrmse-sva"`` (the default) or ``"rmse-s"``;
    - ``convention``: ``"paper"`` or ``"authors"``;
    - ``optimizer``: ``"auto"``, ``"ga"``, ``"lshade"`` or ``"cmaes"``;
    - ``seed`` (1), ``replicates`` (1), ``max_evaluations`` (300000 simulations);
    - ``intervals``: whether 95 % intervals are estimated (True);
    - ``device``: ``"auto"``, ``"lanes"`` (the CPU), ``"gpu"`` or ``"reference"``; ``precision``: ``"plain"``, ``"compensated"`` or ``"f64"``.

    Ctrl-C ends the search: what was found so far is returned, without intervals, with a warning.

    Raises :class:`leadlag.UsageError` for settings that cannot be, :class:`leadlag.Error` where no candidate is feasible.
    """
    drives = _many(drive)
    one = _settings(model, settings)
    _warn(one.warnings(drives))
    with Bar(one.model, progress) as tell:
        fit, interrupted = one.run(drives, tell)
    if interrupted is not None:
        if not isinstance(interrupted, KeyboardInterrupt):
            raise interrupted
        warnings.warn("interrupted: this is what was found so far", stacklevel=2)
    return fit


def calibrate_all(
    pairs: Any,
    models: ModelLike | Sequence[ModelLike],
    *,
    progress: bool = True,
    reading: dict[str, Any] | None = None,
    **settings: Unpack[Settings],
) -> Any:
    """Calibrates every leader-follower pair by itself: a row per pair and model.

    ``pairs``: drives; a table of many pairs (pandas, Polars, Arrow, a mapping) that a column map or layout in ``reading`` explains; or the path of a
    file or folder, or several. ``models``: one or several. ``reading``: options of :func:`leadlag.read`, such as ``{"columns": "highd"}``.
    ``settings``: as of :func:`calibrate`; a search takes 2000 simulations per parameter unless ``max_evaluations`` says otherwise.

    Returns a table like the one that was given, else of pandas, else a dictionary of columns: ids, scores, parameters with units in their names, ends
    of their intervals, and in ``reason`` why a pair has none. Ctrl-C returns the rows that are there, with a warning.
    """
    each = [_settings(model, settings) for model in _several(models)]
    options = _options(pairs, reading)
    with Bar("calibrations", progress) as tell:
        if isinstance(pairs, (str, os.PathLike)):
            found = _native.calibrate_files([os.fspath(pairs)], None, each, options, tell)
        elif _are_drives(pairs):
            found = _native.calibrate_drives(_many(pairs), each, tell)
        elif isinstance(pairs, Sequence) and all(isinstance(p, (str, Path)) for p in pairs):
            found = _native.calibrate_files([os.fspath(p) for p in pairs], None, each, options, tell)
        else:
            found = _native.calibrate_files([], text_of(pairs), each, options, tell)
    columns, told, interrupted = found
    _warn(told)
    if interrupted is not None:
        if not isinstance(interrupted, KeyboardInterrupt):
            raise interrupted
        warnings.warn("interrupted: these are the rows that are there", stacklevel=2)
    return table_like(columns, pairs)


def _are_drives(pairs: Any) -> bool:
    several = isinstance(pairs, Sequence) and not isinstance(pairs, str) and len(pairs) > 0
    return isinstance(pairs, Drive) or (several and all(isinstance(pair, Drive) for pair in pairs))


def _options(pairs: Any, reading: dict[str, Any] | None) -> dict[str, Any]:
    """The options of reading these pairs."""
    if reading and _are_drives(pairs):
        raise _native.UsageError("reading: drives are read already; give it to leadlag.read or leadlag.Drive")
    return dict(reading or {})


class Evaluator:
    """Scores populations of candidates: the objective for an optimiser of your own.

    ``drives``: one drive or several; the score is the mean over them. ``model`` and ``settings`` are as of :func:`calibrate`. A candidate is a row of
    values, one per entry of ``parameters``.
    """

    def __init__(self, drives: Drive | Iterable[Drive], model: ModelLike, **settings: Unpack[Settings]) -> None:
        self._again = (_many(drives), model, settings)
        self._native = _settings(model, settings).evaluate_on(self._again[0])
        #: Names of the parameters that are searched.
        self.parameters: list[str] = self._native.parameters
        #: Their units.
        self.units: list[str] = self._native.units
        #: Lower bounds, shape (p,).
        self.lower: NDArray[np.float64] = self._native.lower
        #: Upper bounds, shape (p,).
        self.upper: NDArray[np.float64] = self._native.upper

    @property
    def device(self) -> str:
        """What computes."""
        return self._native.device

    def __call__(self, candidates: ArrayLike) -> NDArray[np.float64]:
        """Scores of candidates, shape (n, p) to (n,); infinite for a crash. Float64 in C order is read in place."""
        return self._native.scores(self._rows(candidates))

    def simulate(
        self, candidates: ArrayLike, drive: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Simulated spacing [m], speed [m/s] and acceleration [m/s²] on one drive, each of shape (n, samples), by the f64 reference; NaN behind a
        crash."""
        spacing, speed, acceleration = self._native.simulate(self._rows(candidates), drive)
        return spacing, speed, acceleration

    def _rows(self, candidates: ArrayLike) -> NDArray[np.float64]:
        rows = np.ascontiguousarray(candidates, dtype=np.float64)
        if rows.ndim == 1:
            rows = rows[None, :]
        if rows.ndim != 2 or rows.shape[1] != len(self.parameters):
            names = ", ".join(self.parameters)
            raise _native.UsageError(
                f"candidates: expected an array of shape (n, {len(self.parameters)}) for {names}, found shape {rows.shape}"
            )
        return rows

    def __reduce__(self) -> tuple[Any, ...]:
        drives, model, settings = self._again
        return (_evaluator, (drives, model, settings))

    def __repr__(self) -> str:
        return repr(self._native)


def _evaluator(drives: list[Drive], model: ModelLike, settings: Settings) -> Evaluator:
    return Evaluator(drives, model, **settings)


def diagnose(
    drives: Drive | Iterable[Drive],
    holdout: Drive | Iterable[Drive] = (),
    *,
    base: ModelLike,
    effort: str = "normal",
    seed: int = 1,
    causes: Iterable[str | os.PathLike[str] | tuple[str, str]] = (),
    bounds: BoundsLike | Iterable[BoundsLike] | None = None,
    correct: bool = False,
    progress: bool = True,
) -> _native.Findings:
    """What the best simulation with ``base`` still gets wrong, which cause explains it, and what it is worth on drives that it was not fitted to.

    ``base``: a model as :func:`calibrate` takes it. Without ``holdout`` the last third of each drive is held back. ``effort``: ``"quick"`` (some seconds), ``"normal"`` (about a minute) or
    ``"thorough"``. ``causes``: WGSL files, or pairs ``(name, text)``, that are tried beside the built-in ones. ``correct``: correct faults of the
    data where they can be.
    """
    names, single = _bounds(bounds)
    held = [holdout] if isinstance(holdout, Drive) else list(holdout)
    own = [(str(c[0]), str(c[1])) if isinstance(c, tuple) else (Path(c).stem, Path(c).read_text()) for c in causes]
    asked = base if isinstance(base, Model) else Model(base)
    with Bar(f"diagnosis of {asked!r}", progress) as tell:
        return _native.diagnose(
            _many(drives), held, asked.base, asked.extend, effort, seed, own, names, single, correct, tell
        )
