"""Reads calibrations and validations with pyarrow, DuckDB, Polars and pandas and compares the values with the CSV; R, where it is, reads the CSV."""

import csv
import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pandas
import polars
import pyarrow.parquet

TYPES = {"int64": int, "double": float, "bool": lambda text: {"true": True, "false": False}[text], "string": str}


def check(folder: Path, name: str) -> None:
    path = folder / f"{name}.parquet"
    table = pyarrow.parquet.read_table(path)
    metadata = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
    assert metadata["leadlag_table"] == name and metadata["leadlag_schema_version"] == "1", metadata
    with open(folder / f"{name}.csv", newline="") as file:
        rows = list(csv.reader(file))
    header, rows = rows[0], rows[1:]
    assert table.column_names == header, "the same columns in the same order"
    assert table.num_rows == len(rows) > 0, "the same number of rows"
    for i, column in enumerate(table.columns):
        parse = TYPES[str(column.type)]
        expected = [parse(row[i]) if row[i] else None for row in rows]
        assert column.to_pylist() == expected, f"pyarrow: {name}.{header[i]}"
    relation = duckdb.sql(f"select * from '{path}'")
    assert relation.columns == header
    found = [list(row) for row in relation.fetchall()]
    pyarrow_rows = [list(row.values()) for row in table.to_pylist()]
    assert found == pyarrow_rows, "DuckDB and pyarrow agree"
    assert [list(row) for row in polars.read_parquet(path).rows()] == pyarrow_rows, "Polars and pyarrow agree"
    frame, text = pandas.read_parquet(path), pandas.read_csv(folder / f"{name}.csv")
    # Columns without a single value have no type in a CSV.
    filled = [column for column in header if frame[column].notna().any()]
    pandas.testing.assert_frame_equal(frame[filled], text[filled], check_dtype=False, rtol=1e-12)
    if rscript := shutil.which("Rscript"):
        program = f"x <- read.csv('{folder}/{name}.csv'); cat(nrow(x), ncol(x), format(sum(x$rmse_s_m, na.rm = TRUE), digits = 12))"
        said = subprocess.run([rscript, "-e", program], check=True, capture_output=True, text=True).stdout.split()
        assert [int(said[0]), int(said[1])] == [len(rows), len(header)], said
        assert abs(float(said[2]) - frame["rmse_s_m"].sum()) < 1e-6, said
        print(f"{folder}/{name}.csv: its shape and a sum are the same in R")
    print(f"{path}: {table.num_rows} rows, {table.num_columns} columns: the same in pyarrow, DuckDB, Polars, pandas and CSV")


if __name__ == "__main__":
    for name in ("calibrations", "validations"):
        check(Path(sys.argv[1]), name)
    folder = sys.argv[1]
    best = duckdb.sql(
        f"select c.variant, avg(v.nrmse_sva) - avg(c.nrmse_sva) as loss from '{folder}/calibrations.parquet' c "
        f"join '{folder}/validations.parquet' v using (task_id) where c.is_best group by 1 order by 2"
    ).fetchall()
    assert len(best) == 3, best
    print("a join over both tables:", best)
