"""Files of the misalignment procedure: averages with marked segments, averages without, or a run.

Columns: ``state`` (1 to 4), ``tilt [deg]``, ``rate [deg/s]``, ``output`` with its unit (or ``gyro``), and
``segment`` (before, turn, after) with one row per average. Without ``segment`` rests and turns are found from
the rate; with ``time`` the rows are samples, and the samples about each change of the rate are cut.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.lab.misalignment import STATES, TableMeasurements
from fogml.lab.misalignment_segments import Rows, from_marks, from_rates, from_samples
from fogml.runs.columns import conversion, parse_header
from fogml.runs.csv_dialect import csv_dialect
from fogml.runs.raw_table import RawTable
from fogml.runs.reading import file_format, read_table
from fogml.runs.run import FloatArray

SEGMENTS = ("before", "turn", "after")
_NEEDED = ("state", "tilt", "rate")
_TILT_UNITS = {"deg": 1.0, "rad": 180.0 / np.pi}


def read_measurements(path: str | Path) -> TableMeasurements:
    """What the turns in a file gave.

    Raises
    ------
    InputError
        Naming file, column and row, if something is missing or is not what it should be.
    """
    path = Path(path)
    table = read_table(path)
    cells = _cells(table)
    rows = _rows(table, cells)
    if "segment" in cells:
        return from_marks(rows, _segments(path, table, cells["segment"]))
    if "time" in cells:
        factor, _ = conversion("time", parse_header(cells["time"])[1], table.file)
        return from_samples(rows, factor * _column(table, cells, "time"))
    return from_rates(rows)


def _cells(table: RawTable) -> dict[str, str]:
    """Header cell of each column by name."""
    cells: dict[str, str] = {}
    for cell in table.cells:
        name = parse_header(cell)[0]
        if name in cells:
            raise InputError(f"{table.file}: column '{name}' is there twice; rename or remove one of them")
        cells[name] = cell
    missing = [name for name in _NEEDED if name not in cells]
    if "output" not in cells and "gyro" not in cells:
        missing.append("output")
    if missing:
        held = ", ".join(f"'{name}'" for name in list(cells)[:20])
        raise InputError(
            f"{table.file}: no column {', '.join(repr(name) for name in missing)}; the procedure needs "
            f"'state', 'tilt [deg]', 'rate [deg/s]', 'segment' and 'output' with its unit; "
            f"the header holds {held}"
        )
    return cells


def _column(table: RawTable, cells: dict[str, str], name: str) -> FloatArray:
    if cells[name] not in table.columns:
        raise InputError(f"{table.file}, column '{name}': holds text, numbers were expected; export it again")
    values = table.columns[cells[name]]
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"{table.file}, column '{name}', {table.row_name(row)}: the value is missing or not finite, "
            f"{int(bad.sum())} such in the column; correct or remove the rows"
        )
    return values


def _rows(table: RawTable, cells: dict[str, str]) -> Rows:
    state = _column(table, cells, "state")
    wrong = ~np.isin(state, STATES)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{table.file}, column 'state', {table.row_name(row)}: {state[row]:g} is no mounting state; "
            "states are 1, 2, 3 and 4"
        )
    tilt_unit = parse_header(cells["tilt"])[1]
    if tilt_unit not in _TILT_UNITS:
        stated = f"has unit '{tilt_unit}'" if tilt_unit else "states no unit"
        raise InputError(f"{table.file}: column 'tilt' {stated}; write 'tilt [deg]' or 'tilt [rad]'")
    rate_factor, _ = conversion("rate", parse_header(cells["rate"])[1], table.file)
    name = "output" if "output" in cells else "gyro"
    unit = parse_header(cells[name])[1]
    if not unit:
        raise InputError(f"{table.file}: column '{name}' states no unit; write e.g. '{name} [V]'")
    if len(table) == 0:
        raise InputError(f"{table.file}: a header and no rows; turns and rests were expected below it")
    return Rows(
        source=table.file,
        unit=unit,
        state=state,
        tilt_deg=_TILT_UNITS[tilt_unit] * _column(table, cells, "tilt"),
        rate_deg_s=rate_factor * _column(table, cells, "rate"),
        output=_column(table, cells, name),
        row_name=table.row_name,
    )


def _segments(path: Path, table: RawTable, cell: str) -> NDArray[np.str_]:
    """The marks of the rows, checked."""
    kind = file_format(path)
    if kind == "csv":
        dialect = csv_dialect(path)
        place = dialect.cells.index(cell)
        with path.open(encoding=dialect.encoding, errors="replace", newline="") as file:
            lines = csv.reader(file, delimiter=dialect.separator)
            rows = [row for row in lines if any(field.strip() for field in row)][1:]
        marks = np.array([row[place].strip().lower() if place < len(row) else "" for row in rows])
    elif kind == "parquet":
        from pyarrow import parquet

        column = parquet.read_table(path, columns=[cell]).column(0).to_pylist()
        marks = np.array([str(value).strip().lower() for value in column])
    else:
        raise InputError(
            f"{table.file}: text in column 'segment' is read from CSV and Parquet files; export it as "
            "one, or leave the column out, and segments are found from the rate"
        )
    if len(marks) != len(table):
        raise InputError(
            f"{table.file}, column 'segment': {len(marks)} marks for {len(table)} rows; export it again"
        )
    wrong = ~np.isin(marks, SEGMENTS)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{table.file}, column 'segment', {table.row_name(row)}: '{marks[row]}' is no segment; "
            "segments are before, turn and after"
        )
    return marks
