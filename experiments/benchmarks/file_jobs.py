"""Reading and writing runs beside pandas, pyarrow and polars plain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.chamber import chamber_run
from experiments.benchmarks.harness import Job, Work
from experiments.benchmarks.needs import needs
from fogml.arrays import FloatArray
from fogml.runs.run import Run

Columns = Mapping[str, FloatArray]
_QUICK_ROWS = 20_000
WITHIN = 1.0 / 1.3
"""Reading is wanted within 1.3 times of the fastest plain reader."""
_GYRO = "gyro [deg/h]"


def _columns(rows: int) -> Columns:
    """Time, gyro, two temperatures, rate and power, rounded as loggers write them."""
    run = chamber_run(rows, seed=2)
    return {
        "time [s]": run.time,
        _GYRO: np.round(run.gyro, 5),
        "T_in [degC]": np.round(run.columns["T_in"], 4),
        "T_out [degC]": np.round(run.columns["T_out"], 4),
        "rate [deg/s]": np.zeros(len(run)),
        "power [W]": np.round(5.0 + 0.01 * run.columns["T_in"], 3),
    }


def _pandas_read(path: Path) -> Columns:
    import pandas

    frame = pandas.read_csv(path) if path.suffix == ".csv" else pandas.read_parquet(path)
    return {str(name): frame[name].to_numpy() for name in frame.columns}


def _pyarrow_read(path: Path) -> Columns:
    import pyarrow.csv
    import pyarrow.parquet

    read = pyarrow.csv.read_csv if path.suffix == ".csv" else pyarrow.parquet.read_table
    table = read(path)
    return {name: table[name].to_numpy() for name in table.column_names}


def _polars_read(path: Path) -> Columns:
    import polars

    frame = polars.read_csv(path) if path.suffix == ".csv" else polars.read_parquet(path)
    return {name: frame[name].to_numpy() for name in frame.columns}


def _pandas_write(columns: Columns, path: Path) -> None:
    import pandas

    frame = pandas.DataFrame(columns)
    if path.suffix == ".csv":
        frame.to_csv(path, index=False)
    else:
        frame.to_parquet(path, index=False)


def _pyarrow_write(columns: Columns, path: Path) -> None:
    import pyarrow as pa
    import pyarrow.csv
    import pyarrow.parquet

    table = pa.table(dict(columns))
    write: Any = pyarrow.csv.write_csv if path.suffix == ".csv" else pyarrow.parquet.write_table
    write(table, path)


def _polars_write(columns: Columns, path: Path) -> None:
    import polars

    frame = polars.DataFrame(dict(columns))
    if path.suffix == ".csv":
        frame.write_csv(path)
    else:
        frame.write_parquet(path)


READERS = {"pandas": _pandas_read, "pyarrow": _pyarrow_read, "polars": _polars_read}
WRITERS = {"pandas": _pandas_write, "pyarrow": _pyarrow_write, "polars": _polars_write}


def _reading(read: Callable[[Path], Columns], suffix: str, rows: int, quick: bool, folder: Path) -> Work:
    from fogml.runs.reading import read_run

    columns = _columns(_QUICK_ROWS if quick else rows)
    path = folder / f"run{suffix}"
    _pyarrow_write(columns, path)

    def check(a: Run, b: Columns) -> str:
        np.testing.assert_array_equal(a.gyro, b[_GYRO])
        np.testing.assert_array_equal(a.columns["T_out"], b["T_out [degC]"])
        return f"gyro and T_out, {len(a)} rows, digit by digit"

    return Work(lambda: read_run(path), lambda: read(path), check)


def _writing(
    write: Callable[[Columns, Path], None], suffix: str, rows: int, quick: bool, folder: Path
) -> Work:
    from fogml.runs.writing import write_run

    columns = _columns(_QUICK_ROWS if quick else rows)
    cells = dict(columns)
    names = {"time [s]": "time", _GYRO: "gyro"}
    values = {names.get(cell, cell.split(" ")[0]): found for cell, found in cells.items()}
    run = Run.from_columns("run", None, **values)
    ours_path, plain_path = folder / f"ours{suffix}", folder / f"plain{suffix}"

    def ours() -> Path:
        write_run(run, ours_path)
        return ours_path

    def plain() -> Path:
        write(columns, plain_path)
        return plain_path

    def check(a: Path, b: Path) -> str:
        ours_read, plain_read = _pyarrow_read(a), _pyarrow_read(b)
        for cell in ("time [s]", _GYRO, "T_in [degC]"):
            np.testing.assert_array_equal(ours_read[cell], plain_read[cell])
        share = a.stat().st_size / b.stat().st_size
        return f"time, gyro and T_in read back, digit by digit; {share:.2f} times its bytes"

    return Work(ours, plain, check)


def _job(doing: str, suffix: str, size: str, peer: str) -> Job:
    rows = int(float(size))
    reading = doing == "read"
    kind = {".csv": "CSV", ".parquet": "Parquet"}[suffix]
    # The first of these jobs keeps the name that it has had.
    plain_name = f"{doing}-{suffix[1:]}-{size}-{peer}"
    name = "csv" if plain_name == "read-csv-1e6-pandas" else plain_name
    make = _reading if reading else _writing
    sides = READERS if reading else WRITERS
    return Job(
        name,
        f"{'reading' if reading else 'writing'} {kind}, {rows:,} rows × 6",
        "read_run, with every check" if reading else "write_run",
        peer,
        partial(make, sides[peer], suffix, rows),
        limit_s=0.5 if name == "csv" else None,
        least_ratio=WITHIN if reading else None,
        missing=needs(peer),
        # pandas takes a minute for 10 million rows of CSV, and half a gigabyte of text is written each time.
        big=doing == "write" and suffix == ".csv" and size == "1e7",
    )


FILE_JOBS = tuple(
    _job(doing, suffix, size, peer)
    for doing in ("read", "write")
    for suffix in (".csv", ".parquet")
    for size in ("1e6", "1e7")
    for peer in READERS
)
