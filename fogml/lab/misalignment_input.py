"""Files of the misalignment procedure: averages with marked segments, averages without, or a run.

Columns: ``state`` (1 to 4), ``tilt [deg]``, ``rate [deg/s]``, ``output`` with its unit (or ``gyro``), and
``segment`` (before, turn, after) with one row per average. Without ``segment`` rests and turns are found from
the rate; with ``time`` the rows are samples, and the samples about each change of the rate are cut.
``state_angle [deg]`` is how far the gyro is turned in its mounting plane in the state of the row, clockwise
as seen from +z; without it states 1 to 4 are at 0, 180, 270 and 90 deg.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.lab.misalignment import TableMeasurements
from fogml.lab.misalignment_segments import Rows, from_marks, from_rates, from_samples
from fogml.lab.misalignment_states import DOCUMENT_ANGLES_DEG, STATES, stated
from fogml.runs.column_files import parquet_marks
from fogml.runs.columns import conversion, parse_header
from fogml.runs.csv_dialect import csv_dialect
from fogml.runs.facts import read_side_file, side_file
from fogml.runs.opening import opened
from fogml.runs.raw_table import RawTable
from fogml.runs.reading import read_table

SEGMENTS = ("before", "turn", "after")
_NEEDED = ("state", "tilt", "rate")
_ANGLE_UNITS = {"deg": 1.0, "rad": 180.0 / np.pi}
_SAME_ANGLE_DEG = 1e-6
_MARK = 40  # characters of a mark that are told of


def read_measurements(path: str | Path, state_angles_deg: Sequence[float] | None = None) -> TableMeasurements:
    """What the turns in a file gave.

    Parameters
    ----------
    path
        The file.
    state_angles_deg
        Turn of states 1 to 4 in the mounting plane, clockwise as seen from +z [deg], where the file has no
        column of it; if None, that of the source document.
    """
    path = Path(path)
    table = read_table(path)
    facts = read_side_file(path) if side_file(path) else table.facts
    measured = _measured(path, table, state_angles_deg)
    return replace(measured, synthetic=facts is not None and facts.synthetic)


def _measured(path: Path, table: RawTable, state_angles_deg: Sequence[float] | None) -> TableMeasurements:
    cells = _cells(table)
    rows = _rows(table, cells, state_angles_deg)
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
            f"'state', 'tilt [deg]', 'rate [deg/s]', 'output' with its unit, and 'segment' or 'time'; "
            f"the header holds {held}"
        )
    return cells


def _column(table: RawTable, cells: dict[str, str], name: str) -> FloatArray:
    if cells[name] not in table.columns:
        raise InputError(f"{table.file}, column '{name}': holds text, numbers were expected; export it again")
    values = table.columns[cells[name]]
    with np.errstate(over="ignore"):
        bad = ~np.isfinite(values * values)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(
            f"{table.file}, column '{name}', {table.row_name(row)}: the value is missing or not finite, "
            f"or its square is, {int(bad.sum())} such in the column; correct or remove the rows"
        )
    return values


def _angle(table: RawTable, cells: dict[str, str], name: str) -> FloatArray:
    """A column of angles [deg]."""
    unit = parse_header(cells[name])[1]
    if unit not in _ANGLE_UNITS:
        found = f"has unit '{unit}'" if unit else "states no unit"
        raise InputError(f"{table.file}: column '{name}' {found}; write '{name} [deg]' or '{name} [rad]'")
    return _ANGLE_UNITS[unit] * _column(table, cells, name)


def _state_angles(
    table: RawTable, cells: dict[str, str], state: FloatArray, given: Sequence[float] | None
) -> tuple[float, ...]:
    """Turn of states 1 to 4 [deg]: the file's own, else the given ones, else the source document's."""
    if given is not None and (len(given) != len(STATES) or not np.isfinite(given).all()):
        raise InputError(
            f"state angles {stated(given)}: four angles were expected, one for each of the states 1 to 4"
        )
    if "state_angle" not in cells:
        return tuple(DOCUMENT_ANGLES_DEG if given is None else given)
    angles = _angle(table, cells, "state_angle")
    found = []
    for number, default in zip(STATES, DOCUMENT_ANGLES_DEG):
        own = np.flatnonzero(state == number)
        # A state that is not there is missed where all four are needed.
        first = float(angles[own[0]]) if len(own) else default
        other = own[np.abs(angles[own] - first) > _SAME_ANGLE_DEG]
        if len(other):
            row = int(other[0])
            raise InputError(
                f"{table.file}, column 'state_angle', {table.row_name(row)}: {angles[row]:g} deg "
                f"in state {number}, {first:g} deg in a row before; a state is one turn of the gyro"
            )
        found.append(first)
    if given is not None and np.max(np.abs(np.subtract(found, given))) > _SAME_ANGLE_DEG:
        raise InputError(
            f"{table.file}, column 'state_angle': states 1 to 4 at {stated(found)} deg, and "
            f"{stated(given)} deg were given; leave one of the two out"
        )
    return tuple(found)


def _rows(table: RawTable, cells: dict[str, str], state_angles_deg: Sequence[float] | None) -> Rows:
    state = _column(table, cells, "state")
    wrong = ~np.isin(state, STATES)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{table.file}, column 'state', {table.row_name(row)}: {state[row]:g} is no mounting state; "
            "states are 1, 2, 3 and 4"
        )
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
        tilt_deg=_angle(table, cells, "tilt"),
        rate_deg_s=rate_factor * _column(table, cells, "rate"),
        output=_column(table, cells, name),
        state_angles_deg=_state_angles(table, cells, state, state_angles_deg),
        row_name=table.row_name,
    )


def _segments(path: Path, table: RawTable, cell: str) -> NDArray[np.str_]:
    """The marks of the rows, checked."""
    source = opened(path)
    if source.kind == "csv":
        dialect = csv_dialect(source.path)
        place = dialect.cells.index(cell)
        raw = dialect.source.open()
        with io.TextIOWrapper(raw, encoding=dialect.encoding, errors="replace", newline="") as file:
            lines = csv.reader(islice(file, dialect.skipped_lines, None), delimiter=dialect.separator)
            try:
                rows = [row for row in lines if any(field.strip() for field in row)]
            except csv.Error as error:
                line = dialect.skipped_lines + lines.line_num
                raise InputError(
                    f"{table.file}, line {line}: not readable as CSV ({error}); is a quotation mark not "
                    "closed there?"
                ) from None
        # One long text would make all of them as long.
        marks = np.array([row[place].strip().lower()[:_MARK] if place < len(row) else "" for row in rows])
    elif source.kind == "parquet":
        marks = np.char.lower(np.char.strip(parquet_marks(path, cell)))
    else:
        raise InputError(
            f"{table.file}: text in column 'segment' is read from CSV, Excel and Parquet files; export it "
            "as one, or leave the column out, and segments are found from the rate"
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
