"""Between tables of Python and what leadlag reads and returns."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _native


def columns_of(table: Any) -> dict[str, Any]:
    """The columns of a table by name: a mapping of arrays, a pandas, Polars or Arrow table, or whatever exports an Arrow stream."""
    if isinstance(table, Mapping):
        return {str(name): np.asarray(values) for name, values in table.items()}
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
    raise TypeError(
        f"expected a mapping of columns, a pandas, Polars or Arrow table, or a path, found {type(table).__name__}"
    )


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
    """Values as they are written: numbers in the shortest form that reads back the same, nothing where there is none."""
    if values.dtype.kind == "f":
        # A float32 is written with its own digits, which is what it was measured with.
        cells: list[Any] = ["" if cell == "nan" else cell for cell in values.astype(str).tolist()]
        return cells
    if values.dtype.kind == "M":
        return list((values - np.datetime64(0, "s")) / np.timedelta64(1, "s"))
    return ["" if cell is None or cell != cell else cell for cell in values.tolist()]


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


def simulation_frame(simulation: _native.Simulation) -> Any:
    """The table of a simulation, as pandas has it."""
    import pandas

    return pandas.DataFrame(
        {
            "time_s": simulation.time,
            "spacing_m": simulation.spacing,
            "speed_mps": simulation.speed,
            "acceleration_mps2": simulation.acceleration,
        }
    )
