"""Converts the input of a command to drives: drives, tables, paths."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, TypedDict

from . import _native
from ._frames import text_of

Drive = _native.Drive


class Table(TypedDict, total=False):
    """Options of reading a table, each a keyword; see :func:`leadlag.read`. None stands for the default."""

    columns: str | os.PathLike[str] | Mapping[str, Any] | None
    layout: str | None
    trajectory: str | int | None
    segment: int | None
    start: float | None
    end: float | None
    max_gap: float | None
    smooth: bool | None
    correct: bool | None
    resample: float | None
    reconcile: str | None
    vehicle: str | None
    grade: str | os.PathLike[str] | None
    lead_length: float | None
    lead_start: float | None


class Reading(Table, total=False):
    """The same for one drive of it."""

    follower: int | str | None
    name: str | None


#: The options of reading a drive; a table of many pairs takes `_native.READING`, which has no follower and no name.
OPTIONS = ("follower", "name", *_native.READING)


def is_one(given: Any) -> bool:
    """Whether something is one drive: a drive, a path or a table, and no list of them."""
    is_table = isinstance(given, Mapping) or hasattr(given, "columns") or hasattr(given, "__arrow_c_stream__")
    return isinstance(given, (Drive, str, os.PathLike)) or is_table


def one(given: Any, reading: Mapping[str, Any] | None = None) -> Drive:
    """The drive of one input, without a warning."""
    options = {name: value for name, value in (reading or {}).items() if value is not None}
    if isinstance(given, Drive):
        if options:
            raise read_already(options)
        return given
    if isinstance(given, (str, os.PathLike)):
        return read(os.fspath(given), None, options)
    if not is_one(given):
        expected = "a leadlag.Drive, a path, a table of pandas, Polars or Arrow, or a mapping of arrays"
        raise TypeError(f"expected {expected}, found {type(given).__name__}")
    return read(text_of(given), options.get("name") or "table", options)


def read(source: str | bytes, name: str | None, options: Mapping[str, Any]) -> Drive:
    """The drive of a file, or of the text of a table, for whose file ``name`` stands; without a warning."""
    others = {option: value for option, value in options.items() if option != "follower"}
    follower = options.get("follower")
    drive: Drive = getattr(_native, "_again")(source, name, None if follower is None else str(follower), others)
    return drive


def many(given: Any, reading: Mapping[str, Any] | None = None) -> tuple[list[Drive], list[str]]:
    """The drives of one input or of several, and the doubtful values of those that were read here."""
    each = [given] if is_one(given) or not isinstance(given, Iterable) else list(given)
    drives = [one(thing, reading) for thing in each]
    read_here = [drive for drive, thing in zip(drives, each) if drive is not thing]
    return drives, [text for drive in read_here for text in drive.warnings]


def some(given: Any, reading: Mapping[str, Any] | None = None) -> tuple[list[Drive], list[str]]:
    """The same; none is an error."""
    drives, doubts = many(given, reading)
    if not drives:
        raise _native.UsageError("expected at least one drive")
    return drives, doubts


def read_already(options: Iterable[str]) -> _native.UsageError:
    """Error for an option of reading on a drive that was read already."""
    names = ", ".join(options)
    return _native.UsageError(f"{names}: drives are read already; give it to leadlag.read or leadlag.Drive")
