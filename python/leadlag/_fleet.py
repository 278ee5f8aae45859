"""Many drivers, each calibrated alone, and scores of fits on unseen drives."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _drives, _native
from ._api import (
    SETTINGS,
    Evaluator,
    Model,
    ModelLike,
    Options,
    _are_drives,
    _chosen,
    _each_pair,
    _settings,
    _several,
    calibrate,
)
from ._frames import table_like, text_of
from ._warnings import tell

if TYPE_CHECKING:
    from typing_extensions import Unpack

Drive = _native.Drive


class Fleet:
    """Many drivers, each calibrated alone: the table of :func:`calibrate_all`, with a fit of each driver and scores on other drives.

    ``pairs``, ``models``, ``holdout``, ``progress`` and the options are those of :func:`calibrate_all`, and so are the numbers.

    ``fleet["D03"]`` is the :class:`Fit` of a driver. The name of a driver is the id of the trajectory, else the name of the car, else that of / the file, or ``"pair 3"`` if several files have the same name.
    """

    def __init__(
        self,
        pairs: Any,
        models: ModelLike | Sequence[ModelLike],
        *,
        holdout: float | None = None,
        progress: bool = True,
        **options: Unpack[Options],
    ) -> None:
        self._settings, self._reading = _chosen(options, SETTINGS, _native.READING)
        self._models = {_settings(model, self._settings).model: model for model in _several(models)}
        self._holdout = holdout
        self._like = pairs
        # Tables and drives may change after this; what is calibrated may not.
        self._drives: list[Drive] | None = None
        self._text: bytes | None = None
        if _are_drives(pairs):
            self._drives, doubts = _drives.some(pairs, self._reading)
            tell(doubts, 2)
            pairs = self._drives
        elif not (isinstance(pairs, (str, os.PathLike)) or (isinstance(pairs, Sequence) and not isinstance(pairs, Mapping))):
            self._text = text_of(pairs)
        reading: Any = {} if self._drives is not None else self._reading
        self._columns = _each_pair(pairs, list(self._models.values()), holdout, progress, self._settings, reading)
        #: The driver of each row.
        self._of_row = _named(*(list(self._columns[name]) for name in ("trajectory", "name", "file", "pair")))
        self._fits: dict[tuple[int, str], _native.Fit] = {}

    @property
    def drivers(self) -> list[str]:
        """The drivers, in the order of the pairs."""
        return list(dict.fromkeys(self._of_row))

    @property
    def models(self) -> list[str]:
        """The models, by their names."""
        return list(self._models)

    def to_pandas(self) -> Any:
        """The table of :func:`calibrate_all`: a row per pair and model; of Polars where the pairs are, a dictionary of columns without either."""
        return table_like(self._columns, self._like)

    def fit(self, driver: str, model: str | None = None) -> _native.Fit:
        """The :class:`Fit` of a driver, with the parameters of its row; ``model`` by its name, if there are several.

        With ``holdout`` it covers the calibrated part. The first call takes the time of one calibration.
        """
        row = self._row(driver, model)
        key = (row, self._columns["model"][row])
        if key not in self._fits:
            drive, own = self._drive(row), self._models[key[1]]
            settings: Any = dict(self._settings)
            if settings.get("max_evaluations") is None:
                searched = len(Evaluator(drive, own, **settings).parameters)
                settings["max_evaluations"] = _native.EVALUATIONS_PER_PARAMETER * max(searched, 1)
            self._fits[key] = calibrate(drive, own, progress=False, **settings)
        return self._fits[key]

    def score(self, drives: Any, model: str | None = None, **reading: Any) -> Any:
        """Scores of the drivers on other drives, each with the parameters of the driver of the same name, or else of the same file name: a table with a row per drive and model,
        and the columns ``driver``, ``model`` and ``score``, which is infinite for a run that ends early.

        ``drives``: one or several, as of :func:`calibrate`, with options of reading; ``model``: only this one, by its name.

        Raises :class:`leadlag.UsageError` for a drive of none of the drivers.
        """
        _, options = _chosen(reading, (), _drives.OPTIONS)
        each, doubts = _drives.some(drives, options)
        tell(doubts, 2)
        rows = []
        for drive in each:
            for name in self._models if model is None else [model]:
                driver = self._driver(drive)
                row = self._row(driver, name)
                settings: Any = {**self._settings, "precision": "f64", "device": "lanes"}
                evaluator = Evaluator(drive, self._models[name], **settings)
                candidate = [self._parameters(row, name)[parameter] for parameter in evaluator.parameters]
                rows.append((driver, name, float(evaluator(candidate)[0])))
        return table_like({name: list(values) for name, values in zip(("driver", "model", "score"), zip(*rows))}, self._like)

    def plot(self, model: str | None = None) -> Any:
        """Parameters of the drivers with their 95 % intervals, drawn by matplotlib; returns the figure. ``model`` by its name, if there are / several. A parameter without an interval is an empty circle: the drive does not determine it."""
        from ._show import forest

        name = self._model(model)
        rows = [row for row, own in enumerate(self._columns["model"]) if own == name]
        parameters = {}
        for parameter, column in _settings(self._models[name], self._settings).columns:
            ends = [self._columns.get(f"{column}_{side}") for side in ("low", "high")]
            value, low, high = ([np.nan if of is None else of[row] for row in rows] for of in (self._columns[column], *ends))
            if len(set(value)) > 1:
                parameters[column] = (value, low, high)
        return forest([self._of_row[row] for row in rows], parameters, name)

    def __getitem__(self, driver: str) -> _native.Fit:
        return self.fit(driver)

    def __len__(self) -> int:
        return len(self.drivers)

    def __iter__(self) -> Iterator[str]:
        return iter(self.drivers)

    def __repr__(self) -> str:
        return f"<Fleet: {len(self)} drivers, {', '.join(self._models)}>"

    def _repr_html_(self) -> str:
        table = self.to_pandas()
        show = getattr(table, "_repr_html_", None)
        return show() if show else repr(self)

    def _model(self, model: str | None) -> str:
        """A model by its name, or the only one."""
        if model is None and len(self._models) > 1:
            raise _native.UsageError(f"model: expected one of {', '.join(self._models)}, found none")
        name = next(iter(self._models)) if model is None else model
        if name not in self._models:
            raise _native.UsageError(f"model: expected one of {', '.join(self._models)}, found {name}")
        return name

    def _row(self, driver: str, model: str | None) -> int:
        """The row of a driver and a model, which must have a result."""
        name = self._model(model)
        rows = [row for row, own in enumerate(self._of_row) if own == driver and self._columns["model"][row] == name]
        if len(rows) != 1:
            found = f"found {len(rows)} drives of {driver}" if rows else f"found {driver!r}"
            known = ", ".join(self.drivers[:5]) + (", ..." if len(self) > 5 else "")
            raise _native.UsageError(f"driver: expected one of {known}, {found}")
        if self._columns["reason"][rows[0]]:
            raise _native.Error(f"{driver}: has no parameters: {self._columns['reason'][rows[0]]}")
        return rows[0]

    def _driver(self, drive: Drive) -> str:
        """The driver of another drive: by its name, otherwise by that of its file, as in the table."""
        stem, _, _ = drive.label.rpartition(" follower ")
        return stem if drive.name not in self._of_row and stem in self._of_row else drive.name

    def _parameters(self, row: int, model: str) -> dict[str, float]:
        return {name: float(self._columns[column][row]) for name, column in _settings(self._models[model], self._settings).columns}

    def _drive(self, row: int) -> Drive:
        """What was calibrated on."""
        columns = self._columns
        if self._drives is not None:
            drive = self._drives[int(columns["pair"][row]) - 1]
        else:
            options: dict[str, Any] = dict(self._reading)
            if columns["trajectory"][row]:
                options["trajectory"] = columns["trajectory"][row]
            if "columns" not in options:
                options["follower"] = int(columns["follower"][row])
            file = columns["file"][row]
            drive = _drives.read(file, None, options) if self._text is None else _drives.read(self._text, file, options)
        samples = int(columns["samples"][row])
        return drive if samples == len(drive) else drive.split(at=float(drive.time[samples]))[0]


def _named(trajectories: list[str | None], names: list[str], files: list[str], pairs: list[int]) -> list[str]:
    """Names of the drivers, as on the page of a fleet."""
    of_stem: dict[str, set[int]] = {}
    for file, pair in zip(files, pairs):
        of_stem.setdefault(Path(file).stem, set()).add(pair)

    def driver(trajectory: str | None, name: str, file: str, pair: int) -> str:
        if trajectory or name != "follower":
            return trajectory or name
        stem = Path(file).stem
        return stem if len(of_stem[stem]) == 1 else f"pair {pair}"

    return [driver(*whose) for whose in zip(trajectories, names, files, pairs)]


def compare(fits: Any, on: Any, **reading: Any) -> Any:
    """Scores of fits on drives that they were not fitted to, such as held-out parts: a table with a row per drive and fit.

    ``fits``: several in a list, or a mapping of names to fits; without names they go by their models. ``on``: one drive or several, as of
    :func:`calibrate`, with options of reading.

    Columns: ``drive``, ``fit``, ``nrmse_sva``, ``nrmse_s``, ``nrmse_v``, ``nrmse_a``, ``rmse_s`` [m], ``rmse_v`` [m/s], ``rmse_a`` [m/s²] and ``ended``, which
    says why a run ended early; its scores are NaN. The table is of pandas, else a dictionary of columns.

    A warning names fits that were calibrated on one of the drives. For many drivers, :class:`Fleet` compares models and allows for noise.
    """
    named: list[tuple[str, _native.Fit]]
    named = list(fits.items()) if isinstance(fits, Mapping) else [(fit.model, fit) for fit in fits]
    _, options = _chosen(reading, (), _drives.OPTIONS)
    drives, doubts = _drives.some(on, options)
    seen = [f"{name}: calibrated on {drive.label}, which favours it" for name, fit in named for drive in drives if _has_seen(fit, drive)]
    tell([*doubts, *seen], 2)
    measures = ["nrmse_sva", *(f"{kind}_{signal}" for kind in ("nrmse", "rmse") for signal in "sva")]
    rows: dict[str, list[Any]] = {name: [] for name in ("drive", "fit", *measures, "ended")}
    for drive in drives:
        for name, fit in named:
            simulation = fit.simulate(drive)
            scores = simulation.scores
            values = (drive.label, name, *(scores.get(measure, np.nan) for measure in measures), simulation.ended)
            for column, value in zip(rows.values(), values):
                column.append(value)
    return table_like(rows, None)


def _has_seen(fit: _native.Fit, drive: Drive) -> bool:
    """Whether a fit was calibrated on most samples of a drive, or the drive has most of the calibrated samples."""

    def samples(of: Drive) -> set[tuple[float, ...]]:
        return set(zip(of.time.tolist(), of.speed.tolist(), of.lead_speed.tolist()))

    return any(2 * len(samples(own) & samples(drive)) > min(len(own), len(drive)) for own in fit.drives)
