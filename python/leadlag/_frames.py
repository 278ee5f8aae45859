"""Converts between tables of Python and those of leadlag."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _native


def columns_of(table: Any) -> dict[str, Any]:
    """The columns of a table by name: a mapping of arrays, a pandas, Polars or Arrow table, or whatever exports an Arrow stream."""
    if isinstance(table, Mapping):
        return {str(name): _unmasked(values) for name, values in table.items()}
    if hasattr(table, "column_names") and hasattr(table, "column"):  # pyarrow
        return {name: table.column(name).to_numpy() for name in table.column_names}
    if hasattr(table, "columns") and hasattr(table, "__getitem__"):  # pandas, Polars
        return {str(name): np.asarray(table[name].to_numpy()) for name in table.columns}
    if hasattr(table, "__arrow_c_stream__"):
        try:
            import pyarrow
        except ImportError as error:
            raise TypeError(f"a {type(table).__name__} is read through pyarrow, which is not installed") from error
        return columns_of(pyarrow.table(table))
    if isinstance(table, np.ndarray) and table.dtype.names:
        return {name: _unmasked(table[name]) for name in table.dtype.names}
    raise TypeError(
        f"expected a mapping of columns, a pandas, Polars or Arrow table, or a path, found {type(table).__name__}"
    )


def _unmasked(values: Any) -> Any:
    """Values as an array; those behind a mask are missing."""
    if not isinstance(values, np.ma.MaskedArray):
        return np.asarray(values)
    missing = {"f": np.nan, "M": "NaT"}.get(values.dtype.kind)
    # Of the same type, so that a float32 keeps its own digits.
    filler = np.array(missing, object if missing is None else values.dtype)
    return np.where(np.ma.getmaskarray(values), filler, values.data)


def text_of(table: Any) -> bytes:
    """A table as CSV text that reads back the same numbers."""
    columns = columns_of(table)
    if not columns:
        raise _native.UsageError("the table has no columns")
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise _native.UsageError(f"the columns are of different lengths: {told}")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(_cells(values) for values in columns.values())))
    return text.getvalue().encode()


def _cells(values: Any) -> list[Any]:
    """Values as text: numbers in the shortest form that reads back the same, empty if missing."""
    if values.dtype.kind == "f":
        # A float32 is written with its own digits, those of the measurement.
        cells: list[Any] = ["" if cell == "nan" else cell for cell in values.astype(str).tolist()]
        return cells
    if values.dtype.kind == "M":
        values = (values - np.datetime64(0, "s")) / np.timedelta64(1, "s")
    return ["" if _is_missing(cell) else cell for cell in values.tolist()]


def _is_missing(cell: Any) -> bool:
    """None, NaN, and what pandas has for a missing value, which is not even unequal to itself."""
    return cell is None or type(cell).__name__ in ("NAType", "NaTType") or bool(cell != cell)


#: Default units of a column map's roles.
UNITS = {"time": "s", "speed": "m/s", "acceleration": "m/s2", "sin_grade": "-"}


def map_text(columns: Mapping[str, Any]) -> str:
    """A column map as the text of its TOML file. Roles may stand alone: a name in SI units, or (name, unit), as a table of pairs."""
    whole = dict(columns) if "columns" in columns else {"columns": columns}
    roles = {role: _column(str(role), column) for role, column in whole.pop("columns").items()}
    whole = {"title": "columns of a table in memory", "rows": "pairs", **whole}
    lines = [f"{key} = {_toml(value)}" for key, value in whole.items()]
    return "\n".join([*lines, "[columns]", *(f"{role} = {_toml(column)}" for role, column in roles.items()), ""])


def _column(role: str, column: Any) -> Any:
    if isinstance(column, str):
        kind = role.removeprefix("lead2_").removeprefix("lead_")
        unit = None if kind in ("id", "ahead", "lane", "group") else UNITS.get(kind, "m")
        column = (column, unit)
    if isinstance(column, tuple):
        name, unit = column
        return {"name": name} if unit is None else {"name": name, "unit": unit}
    return column


def _toml(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def table_like(columns: dict[str, Any], model: Any) -> Any:
    """Columns as a table of the kind of ``model``: a Polars table for one of Polars, else of pandas, a dict without either."""
    if type(model).__module__.partition(".")[0] == "polars":
        import polars

        return polars.DataFrame(columns)
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns)


def drive_frame(drive: _native.Drive) -> Any:
    """The four columns of a drive as a pandas DataFrame."""
    import pandas

    return pandas.DataFrame(
        {
            "time_s": drive.time,
            "lead_speed_mps": drive.lead_speed,
            "speed_mps": drive.speed,
            "spacing_m": drive.spacing,
        }
    )


#: Units of the columns of signals, by their endings.
ENDINGS = {"_s": "s", "_m": "m", "_mps": "m/s", "_mps2": "m/s2"}


def dataset(frame: Any) -> Any:
    """Columns of signals over time, as xarray has them."""
    made = frame.set_index("time_s").to_xarray()
    for name in made.variables:
        made[name].attrs["units"] = next(unit for ending, unit in ENDINGS.items() if str(name).endswith(ending))
    return made


def simulation_frame(simulation: _native.Simulation) -> Any:
    """The table of a simulation as a pandas DataFrame."""
    import pandas

    return pandas.DataFrame(
        {
            "time_s": simulation.time,
            "spacing_m": simulation.spacing,
            "speed_mps": simulation.speed,
            "acceleration_mps2": simulation.acceleration,
        }
    )
