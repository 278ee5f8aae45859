"""The functions of the package."""

from __future__ import annotations

import difflib
import os
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _drives, _native
from ._drives import Reading
from ._frames import map_text, table_like, text_of
from ._progress import Bar
from ._warnings import tell as _tell

if TYPE_CHECKING:
    from typing_extensions import Unpack

Drive = _native.Drive
Extension = str | os.PathLike[str] | tuple[str, str]


class Model:
    """A model: a base with parts and extensions.

    ``base``: a variant by name or id, such as ``"idm+delay"``, ``"gipps+delay+linear+mfc"`` or ``31``; a built-in law, such as ``"krauss"``; a file
    with a law of your own, ``"my_law.wgsl+delay"``; or the WGSL text of one, whose function ``NAME_law`` gives it its name.
    ``extend``: its extensions, each the name of a built-in cause (``"actuation_lag"``), the path of a WGSL file, or a pair
    ``(name, text)`` of WGSL text whose functions begin with that name.
    ``parts``: the parts of a law that is given as text, such as ``"delay+linear"``.
    """

    #: The base, or (name, text, parts) of a law that is given as text.
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


class Options(Settings, Reading, total=False):
    """Settings of a calibration and options of reading, each a keyword."""


def _chosen(given: Mapping[str, Any], settings: Iterable[str], reading: Iterable[str]) -> tuple[Any, dict[str, Any]]:
    """The settings and the options of reading among keywords."""
    settings, reading = list(settings), list(reading)
    for name in given:
        if name not in (*settings, *reading):
            near = difflib.get_close_matches(name, [*settings, *reading], 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            of_reading = f", or to read a drive {', '.join(reading)}" if reading else ""
            raise _native.UsageError(f"no setting is called {name}: expected {', '.join(settings)}{of_reading}{hint}")
    options = {name: value for name, value in given.items() if name in reading and value is not None}
    if isinstance(options.get("columns"), Mapping):
        options["columns"] = map_text(options["columns"])
    return {name: value for name, value in given.items() if name in settings}, options


#: The settings of a calibration.
SETTINGS = tuple(Settings.__annotations__)


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
            try:
                lower, upper = ends if isinstance(ends, Iterable) else (ends, ends)
                single.append((name, float(lower), float(upper)))
            except (TypeError, ValueError) as error:
                message = f"bounds of {name}: expected (lower, upper) or one number, found {ends!r}"
                raise _native.UsageError(message) from error
    return names, single


def _settings(model: ModelLike, given: Settings) -> _native.Calibration:
    """The settings of a calibration; None means the default."""
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


def _interrupted(exception: BaseException | None, what: str, level: int = 3) -> None:
    """Raises the error that stopped the work; Ctrl-C is a warning, because there is a result. ``level``: frames to the line of the user."""
    if exception is None:
        return
    if not isinstance(exception, KeyboardInterrupt):
        raise exception
    warnings.warn(f"interrupted: {what}", stacklevel=level)


def calibrate(
    drive: Any,
    model: ModelLike,
    *,
    history: float | None = None,
    folds: int | None = None,
    own: str | Sequence[str] = (),
    progress: bool = True,
    **options: Unpack[Options],
) -> _native.Fit:
    """Calibrates a model on a drive; on several, one parameter set for all.

    ``drive``: a :class:`Drive`; a pandas, Polars or Arrow table or a mapping of arrays, as :class:`Drive` takes them; a path; or several of these in a list.
    ``model``: a variant by name or id, or a :class:`Model` with extensions. ``history``: time at the start of each drive [s] in which the car is the
    measured one; simulation and score begin after it, and delays are at most as long. ``folds``: leave each driver out of one of this many further
    calibrations; ``fit.to_dict()["held_back"]`` has the scores. ``own``: own values of the named parameter, or parameters, for each driver; the fit then
    has the middle of their distribution, and ``fit.to_dict()["own"]`` the distribution and each driver's. ``progress``: whether a bar is shown.

    Options of reading are those of :func:`read`, such as ``columns`` for a table of other names and units. Settings, each a keyword:

    - ``bounds``: ``"acc"`` (the paper's, the default), ``"human"``, the path of a TOML file, ``{"v_0": (25, 40)}``, where one number fixes a parameter,
      or several of these in a list, of which the later replace the earlier;
    - ``fix``: values of parameters that are not searched, by name; within the bounds that a file or a mapping gives;
    - ``gof``: the measure to minimise, such as ``"nrmse-sva"`` (the default) or ``"rmse-s"``; ``"pooled-rmse-s"`` pools the squared errors of several drives;
    - ``convention``: ``"paper"`` or ``"authors"``;
    - ``optimizer``: ``"auto"``, ``"ga"``, ``"lshade"`` or ``"cmaes"``;
    - ``seed`` (1), ``replicates`` (1), ``max_evaluations`` (300000 simulations);
    - ``intervals``: whether 95 % intervals are estimated (True);
    - ``device``: ``"auto"``, ``"lanes"`` (the CPU), ``"gpu"`` or ``"reference"``; ``precision``: ``"plain"``, ``"compensated"`` or ``"f64"``.

    Ctrl-C ends the search and returns the result so far, without intervals, with a warning; without any result it raises
    KeyboardInterrupt. A second Ctrl-C ends the call at once.

    Raises :class:`leadlag.UsageError` for invalid settings, :class:`leadlag.Error` where no candidate is feasible.
    """
    settings, reading = _chosen(options, SETTINGS, _drives.OPTIONS)
    one = _settings(model, settings)
    one = one if history is None else one.history(history)
    one = one if folds is None else one.folds(folds)
    one = one.own([own] if isinstance(own, str) else list(own))
    drives, doubts = _drives.some(drive, reading)
    _tell([*doubts, *one.warnings(drives)], 2)
    with Bar(one.model, progress) as tell:
        fit, interrupted = one.run(drives, tell)
    _interrupted(interrupted, "this is what was found so far")
    return fit


def calibrate_all(
    pairs: Any,
    models: ModelLike | Sequence[ModelLike],
    *,
    holdout: float | None = None,
    progress: bool = True,
    **options: Unpack[Options],
) -> Any:
    """Calibrates every pair of a follower and the car ahead separately: a row per pair and model.

    ``pairs``: drives, or tables of one drive each, in a list; one table of many pairs (pandas, Polars, Arrow, a mapping), which ``columns`` or
    ``layout`` explains; or the path of a file or folder, or several. ``models``: one or several. ``progress``: whether a bar is shown.

    ``holdout``: hold back this share of each drive, its end, above 0 and below 1. It is scored and not calibrated on: columns ``heldout_score``, ... Several models
    have ``expected_score`` without it, the score expected on another drive of the same driver; compare models by these, and not by ``score``, which is always lower for the larger of two nested models.

    Settings are those of :func:`calibrate`, options of reading those of :func:`read` without ``follower`` and ``name``. A search takes 2000 simulations per
    parameter unless ``max_evaluations`` says otherwise.

    Returns a table like the one that was given, else of pandas, else a dictionary of columns: ids, scores, parameters with units in their names, ends
    of their intervals, and in ``reason`` why a pair has none. Ctrl-C returns the finished rows, with a warning.
    """
    settings, reading = _chosen(options, SETTINGS, _native.READING)
    return table_like(_each_pair(pairs, _several(models), holdout, progress, settings, reading), pairs)


def _each_pair(
    pairs: Any,
    models: list[Model],
    holdout: float | None,
    progress: bool,
    settings: Any,
    reading: Any,
) -> dict[str, Any]:
    """The columns of the table of all pairs; called by what a user calls."""
    each = [_settings(model, settings) for model in models]
    taken, doubts = _pairs(pairs, reading)
    with Bar("calibrations", progress) as tell:
        columns, interrupted = _native.calibrate_pairs(taken, each, tell, holdout)
    _tell([*doubts, *taken.warnings], 3)
    _interrupted(interrupted, "these are the rows that are there", 4)
    return columns


def _pairs(pairs: Any, reading: Any) -> tuple[_native.Pairs, list[str]]:
    """The pairs as the extension module takes them, with warnings of drives."""
    if _are_drives(pairs):
        drives, doubts = _drives.some(pairs, reading)
        return _native.pairs_of_drives(drives), doubts
    if isinstance(pairs, (str, os.PathLike)):
        return _native.pairs_of_files([os.fspath(pairs)], None, reading), []
    if isinstance(pairs, Sequence):
        return _native.pairs_of_files([os.fspath(p) for p in pairs], None, reading), []
    return _native.pairs_of_files([], text_of(pairs), reading), []


def _are_drives(pairs: Any) -> bool:
    """Whether these are drives, or tables of one drive each; not paths, which may hold many."""
    if isinstance(pairs, Sequence) and not isinstance(pairs, str):
        return len(pairs) > 0 and not all(isinstance(pair, (str, os.PathLike)) for pair in pairs)
    return isinstance(pairs, Drive)


class Evaluator:
    """Scores populations of candidates: the objective for your own optimiser.

    ``drives``: one drive or several, as in :func:`calibrate`; the score is the mean over them. ``model``, settings and options of reading are as of
    :func:`calibrate`. A candidate is a row of values, one per entry of ``parameters``; ``lower`` and ``upper`` are their bounds, ``units`` their units.

    ``evaluator(candidates)`` gives scores, shape (n, p) to (n,). Float64 in C order is read in place. A score is infinite for a crash, and for a candidate
    with a value that the equations do not allow, such as a negative headway or NaN, so that an optimiser may leave the bounds.
    """

    def __init__(self, drives: Any, model: ModelLike, **options: Unpack[Options]) -> None:
        settings, reading = _chosen(options, SETTINGS, _drives.OPTIONS)
        own, doubts = _drives.some(drives, reading)
        _tell(doubts, 2)
        self._again = (own, model, settings)
        self._native = _settings(model, settings).evaluate_on(own)
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
        """Scores of candidates, shape (n, p) to (n,); infinite if a candidate crashes or cannot be simulated."""
        return self._native.scores(self._rows(candidates))

    def simulate(
        self, candidates: ArrayLike, drive: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Simulated spacing [m], speed [m/s] and acceleration [m/s²] on one drive, each of shape (n, samples), by the f64 reference; NaN behind a
        crash. Raises :class:`leadlag.UsageError` for a candidate that cannot be simulated, with its number and parameter."""
        spacing, speed, acceleration = self._native.simulate(self._rows(candidates), drive)
        return spacing, speed, acceleration

    def residuals(self, candidates: ArrayLike) -> NDArray[np.float64]:
        """Residuals whose sum of squares is the score, for a least-squares solver: shape (n, p) to (n, m), from free simulations in f64.

        A row has the drives one after the other, of each the residuals of spacing, then of speed, then of acceleration, one per sample: simulated
        minus measured, with the weights of the measure, so that m is three times the number of all samples and the unit is the square root of that of
        the score. They are 0 before the first simulated sample and for a signal that the measure leaves out. All residuals of a candidate whose
        score is infinite are infinite. The weights depend on the candidate: a measure is a sum of norms, and a solver minimises the measure itself.

        Raises :class:`leadlag.UsageError` for Theil's coefficients (``gof="u-..."``), which are no norms of residuals.
        """
        return self._native.residuals(self._rows(candidates))

    def normal_equations(
        self, candidates: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """JᵀJ, Jᵀr and rᵀr of the residuals r of :meth:`residuals` and their derivatives J: shape (n, p) to (n, p, p), (n, p) and (n,).

        A Gauss-Newton step d solves JᵀJ d = -Jᵀr. JᵀJ is per unit of two parameters, Jᵀr per unit of one; rᵀr is the score, and
        2 Jᵀr its gradient. They come from finite differences, with p + 2 simulations per candidate and drive: on a GPU in f32, if the evaluator
        is on one (:attr:`device`), otherwise in f64. Where the score of a candidate is infinite, or the run of a neighbour fails, rᵀr is infinite
        and the rest is NaN. Where the convention rounds delays to whole samples, derivatives with respect to a delay are meaningless: fix it.

        Raises :class:`leadlag.UsageError` as :meth:`residuals`.
        """
        return self._native.normal_equations(self._rows(candidates))

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
    drives: Any,
    holdout: Any = (),
    *,
    base: ModelLike,
    effort: str = "normal",
    seed: int = 1,
    causes: Iterable[str | os.PathLike[str] | tuple[str, str]] = (),
    bounds: BoundsLike | Iterable[BoundsLike] | None = None,
    progress: bool = True,
    **reading: Unpack[Reading],
) -> _native.Findings:
    """Finds the errors of the best simulation with ``base``, the cause that explains them, and its gain on unseen drives.

    ``drives`` and ``holdout``: one drive or several, as in :func:`calibrate`; options of reading are those of :func:`read`. Without ``holdout`` the last
    third of each drive is held back. ``base``: a model as :func:`calibrate` takes it. ``effort``: ``"quick"`` (about 10 s of CPU per drive of 15 minutes), ``"normal"`` (twice that)
    or ``"thorough"``. ``causes``: WGSL files, or pairs ``(name, text)``, that are tried in addition to the built-in ones. ``bounds``: as in :func:`calibrate`, in place
    of those of the diagnosis; they may name parameters of causes. ``progress``: whether a bar is shown.

    Ctrl-C ends it without a result.
    """
    _, options = _chosen(reading, (), _drives.OPTIONS)
    held, doubts_held = _drives.many(holdout, options)
    trained, doubts = _drives.some(drives, options)
    _tell([*doubts, *doubts_held], 2)
    asked, settings = _diagnosis(base, effort, seed, causes, bounds)
    with Bar(f"diagnosis of {asked!r}", progress) as tell:
        return _native.diagnose(trained, held, asked, settings, bool(reading.get("correct")), tell)


def diagnose_all(
    pairs: Any,
    *,
    base: ModelLike,
    effort: str = "normal",
    seed: int = 1,
    causes: Iterable[str | os.PathLike[str] | tuple[str, str]] = (),
    bounds: BoundsLike | Iterable[BoundsLike] | None = None,
    progress: bool = True,
    **reading: Unpack[Reading],
) -> _native.Findings:
    """Finds what ``base`` lacks for all drivers of a fleet: one law for every pair, judged on drivers that its fits leave out.

    ``pairs``: as in :func:`calibrate_all`; drives of 10 s or more count, and at least twelve drivers are needed. The other options are those of :func:`diagnose`.
    ``fleet`` in the JSON has the share of the drivers with the named causes, and the pairs that cannot be used with the reason.

    Ctrl-C ends it without a result.
    """
    _, options = _chosen(reading, (), _native.READING)
    asked, settings = _diagnosis(base, effort, seed, causes, bounds)
    taken, doubts = _pairs(pairs, options)
    _tell([*doubts, *taken.warnings], 2)
    with Bar(f"diagnosis of {asked!r}", progress) as tell:
        return _native.diagnose_pairs(taken, asked, settings, tell)


def _diagnosis(
    base: ModelLike,
    effort: str,
    seed: int,
    causes: Iterable[str | os.PathLike[str] | tuple[str, str]],
    bounds: BoundsLike | Iterable[BoundsLike] | None,
) -> tuple[Model, _native.DiagnosisSettings]:
    names, single = _bounds(bounds)
    if isinstance(causes, (str, os.PathLike)):
        causes = [causes]
    own = [(str(c[0]), str(c[1])) if isinstance(c, tuple) else (Path(c).stem, Path(c).read_text()) for c in causes]
    return base if isinstance(base, Model) else Model(base), (effort, seed, own, names, single)


def extended(model: Model, causes: Iterable[str], own: Iterable[tuple[str, str]]) -> Model:
    """A model with causes by name; ``own``: the texts of those that are not built in."""
    texts = dict(own)
    return Model(model.base, [*model.extend, *((name, texts[name]) if name in texts else name for name in causes)])
