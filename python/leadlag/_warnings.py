"""Doubts as warnings of Python: one per fault, however many drives have it."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable

#: Drives that a warning names.
NAMED = 3

#: Faults already reported for drives read one by one, by the place of the call.
_told: set[tuple[str, int, str]] = set()


def _parts(text: str) -> tuple[str, str]:
    """The file and the kind of fault of a text `FILE: fault`, without its numbers."""
    whose, colon, fault = text.partition(": ")
    if not colon:
        whose, fault = "", text
    return whose, re.sub(r"\d+(\.\d+)?", "#", fault)


def together(texts: Iterable[str]) -> list[str]:
    """A text per fault, that of the first drive, with the others that have it."""
    faults: dict[str, list[str]] = {}
    for text in texts:
        faults.setdefault(_parts(text)[1], []).append(text)
    told = []
    for first, *others in faults.values():
        names = [name for name in dict.fromkeys(_parts(text)[0] for text in others) if name != _parts(first)[0]]
        named = f": {', '.join(names[:NAMED])}{', ...' if len(names) > NAMED else ''}" if names else ""
        told.append(f"{first} (and {len(others)} more{named})" if others else first)
    return told


def _all_are_shown() -> bool:
    """Whether every warning is shown, or raised, and not only the first one of a place."""
    for action, message, category, module, _ in warnings.filters:
        if message is None and module is None and issubclass(UserWarning, category):
            return action in ("always", "all", "error")
    return False


def tell(texts: Iterable[str], level: int = 1) -> None:
    """Warns of each fault. Drives that one line of a program reads, as a comprehension does, have a fault in common; the others have it in
    `Drive.warnings`. ``level``: frames between this one and the line."""
    frame = sys._getframe(level)
    for text in together(texts):
        fault = (frame.f_code.co_filename, frame.f_lineno, _parts(text)[1])
        if fault not in _told or _all_are_shown():
            _told.add(fault)
            warnings.warn(text, stacklevel=level + 1)
