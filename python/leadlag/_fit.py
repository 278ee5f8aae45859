"""Properties of a fit besides its numbers, from its result file."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from . import _native

#: Width of a 95 % interval in standard errors, for a normal distribution.
WIDTH = 2 * 1.96


def to_dict(fit: _native.Fit) -> dict[str, Any]:
    result: dict[str, Any] = json.loads(fit.to_json())
    return result


def rmse(fit: _native.Fit) -> dict[str, float]:
    score = to_dict(fit)["score"]
    return {signal: score.get(f"rmse_{signal}") for signal in "sva"}


def evaluations(fit: _native.Fit) -> int:
    return int(to_dict(fit)["evaluations"])


def summary(fit: _native.Fit) -> Any:
    import pandas

    result = to_dict(fit)
    known = (result.get("identifiability") or {}).get("parameters", {})
    rows = []
    for name, value in result["parameters"].items():
        low, high = result["intervals"].get(name, (np.nan, np.nan))
        determined = known[name]["determined"] if name in known else None
        rows.append((value, result["units"].get(name), low, high, name in result["at_bound"], determined))
    columns = ["value", "unit", "low", "high", "at_bound", "determined"]
    return pandas.DataFrame(rows, index=pandas.Index(result["parameters"], name="parameter"), columns=columns)


def correlation(fit: _native.Fit) -> Any:
    import pandas

    found = (to_dict(fit).get("identifiability") or {}).get("correlation")
    return found and pandas.DataFrame(found["matrix"], index=found["parameters"], columns=found["parameters"])


def covariance(fit: _native.Fit) -> Any:
    matrix = correlation(fit)
    if matrix is None:
        return None
    ends = np.array([fit.intervals.get(name, (np.nan, np.nan)) for name in matrix.columns])
    errors = (ends[:, 1] - ends[:, 0]) / WIDTH
    return matrix * np.outer(errors, errors)
