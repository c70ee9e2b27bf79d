"""From a file's table to a run: headers, units, missing values, order of time."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Literal

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.numerals import percent
from fogml.runs.arrival_times import burst_ends, sampling_times
from fogml.runs.clock_order import in_order
from fogml.runs.columns import TIME_ON, column_spec, conversion, parse_header
from fogml.runs.facts import Facts, read_side_file
from fogml.runs.findings import Finding
from fogml.runs.header_spelling import column_meant, face_of
from fogml.runs.other_rate import on_gyro_rows, other_clocks
from fogml.runs.possible import (
    REPAIR,
    Rows,
    clock_fault,
    faulty,
    finite_rows,
    float32_reason,
    order_error,
    small_shares,
    step_error,
)
from fogml.runs.raw_table import RawTable
from fogml.runs.run import Run
from fogml.runs.three_axes import SeveralAxes, axes_of

DROPPING = ("repaired_rows", "repaired_repeats")
"""Codes of the findings that count rows which are gone."""
_MOST_NAMES = 20
_LONGEST_NAME = 40
MOST_DROPPED = 0.02
"""Repair drops no more than this share of the rows, or one row, unless it is told to."""


def runs_of_table(
    table: RawTable, path: Path, *, repair: bool, name: str | None, most_dropped: float = MOST_DROPPED
) -> list[Run]:
    """The runs that a file's table holds: one, or one for each leg where the clock restarts and repair is on.

    Raises
    ------
    InputError
        For every fault that is not repaired, and where repair would drop more than the share
        `most_dropped` of the rows.
    """
    columns, gyro_unit, tick_s, notes = _internal_columns(table)
    findings = [*table.findings, *notes, *told_by_the_whole(table.cells, columns)]
    return runs_of_columns(
        columns,
        Rows(table.file, table.row_name, table.called),
        _facts(table, path),
        name or path.name,
        gyro_unit=gyro_unit,
        tick_s=tick_s,
        findings=findings,
        repair=repair,
        most_dropped=most_dropped,
    )


def told_by_the_whole(cells: Collection[str], columns: Mapping[str, FloatArray]) -> Iterator[Finding]:
    """What only all rows tell of a file's columns, in internal units: shares of one, other clocks."""
    stated = {name: unit for name, unit in map(parse_header, cells) if name in columns}
    for name, unit in stated.items():
        yield from small_shares(name, unit, columns[name])
    yield from other_clocks(columns["time"], columns, stated)


def runs_of_columns(
    columns: dict[str, FloatArray],
    table: Rows,
    facts: Facts,
    name: str,
    *,
    gyro_unit: Literal["deg/h", "count"],
    tick_s: float,
    findings: list[Finding],
    repair: bool,
    most_dropped: float,
) -> list[Run]:
    """The runs that columns in internal units hold, NaN where a row has no value; as `runs_of_table`.

    Parameters
    ----------
    columns
        Columns of the table, each of shape (n,).
    table
        Names its rows.
    facts
        Set-up facts.
    name
        What the run is called; legs are called by it and their number.
    gyro_unit
        Unit of the gyro's column.
    tick_s
        One count of the clock [s].
    findings
        What was noticed before.
    repair
        Whether faults are repaired.
    most_dropped
        Share of the rows that repair may drop.
    """
    total = len(columns["time"]) + sum(f.count for f in findings if f.code == "repaired_rows")
    # Rows of another rate may share their times with the gyro's, so these are told apart first.
    columns, rows, found = _of_gyro_rate(columns)
    findings += found
    kept, finding = finite_rows(table, {"time": columns["time"]}, rows, repair)
    rows, columns = _taken(rows, columns, kept, finding, findings)
    if len(rows) < 2:
        raise too_short(table.file, len(rows))
    ordered = in_order(
        columns["time"], columns, tick_s=tick_s, row_name=lambda i: table.row_name(int(rows[i]))
    )
    if ordered.faults or ordered.hopeless:
        if not repair or ordered.hopeless or float32_reason(columns["time"]):
            raise order_error(table, rows, columns["time"], ordered)
        columns = {key: values[ordered.rows] for key, values in columns.items()} | {"time": ordered.time}
        rows = rows[ordered.rows]
        findings += [fault.done for fault in ordered.faults]
    runs = []
    for number, leg in enumerate(ordered.legs):
        part, part_rows = {key: values[leg] for key, values in columns.items()}, rows[leg]
        said = list(findings)
        if ordered.faults:
            part, kept, found = _of_gyro_rate(part)
            part_rows, said = part_rows[kept], [*said, *found]
        kept, finding = finite_rows(table, part, part_rows, repair)
        part_rows, part = _taken(part_rows, part, kept, finding, said)
        _check_clock_steps(table.file, part["time"])
        time, finding = sampling_times(part)
        part["time"] = time
        called, own = name, facts
        if len(ordered.legs) > 1:
            called = f"{name} leg {number + 1}"
            own = facts if number == 0 else facts.model_copy(update={"powered_on": None, "started": None})
        if len(part_rows) < 2:
            raise too_short(table.file, len(part_rows))
        said += [finding] if finding else []
        runs.append(Run.derived(called, part, own, gyro_unit, tuple(said)))
    _check_dropped(table.file, runs, total, most_dropped)
    return runs


def _of_gyro_rate(
    columns: dict[str, FloatArray],
) -> tuple[dict[str, FloatArray], IndexArray, tuple[Finding, ...]]:
    """Columns brought to the gyro's rows, if their times don't go back; as they are if they do."""
    time = columns["time"]
    if faulty("time", time) is None and np.all(time[1:] >= time[:-1]):
        return on_gyro_rows(columns)
    return columns, np.arange(len(time), dtype=np.intp), ()


def _taken(
    rows: IndexArray,
    columns: dict[str, FloatArray],
    kept: IndexArray,
    finding: Finding | None,
    findings: list[Finding],
) -> tuple[IndexArray, dict[str, FloatArray]]:
    """Rows and columns of the kept rows; what was dropped is noted."""
    if finding is None:
        return rows, columns
    findings.append(finding)
    return rows[kept], {key: values[kept] for key, values in columns.items()}


def _check_dropped(file: str, runs: list[Run], total: int, most_dropped: float) -> None:
    """Refuse to go on with what is left of a recording."""
    dropped = {f: f.count for run in runs for f in run.findings if f.code in DROPPING}
    count = sum(dropped.values())
    if count > max(1.0, most_dropped * total):
        what = "; ".join(f.message for f in dropped)
        raise InputError(
            f"{file}: {REPAIR} would drop {count} of {total} rows ({what}), more than "
            f"{percent(most_dropped, 0)}: correct the file, or {REPAIR} --repair-anyway drops them"
        )


@dataclass
class Assembler:
    """Runs from consecutive blocks of one file; nothing is repaired."""

    path: Path
    facts: Facts | None = None
    last_time: float = -np.inf
    samples: int = 0
    cells: tuple[str, ...] = ()

    def block(self, table: RawTable) -> Run:
        """The next block as a run.

        Raises
        ------
        InputError
            For every fault, also for time that goes back or repeats from one block to the next.
        """
        columns, gyro_unit, tick_s, findings = _internal_columns(table)
        self.cells = table.cells
        within = f"rows {self.samples + 1} to {self.samples + len(table)}"
        rows = np.arange(len(table), dtype=np.intp)
        named = Rows(table.file, table.row_name, table.called, within)
        finite_rows(named, columns, rows, repair=False)
        time = columns["time"]
        ordered = in_order(time, columns, tick_s=tick_s, row_name=table.row_name) if len(time) else None
        if ordered is not None and (ordered.faults or ordered.hopeless):
            raise order_error(named, rows, time, ordered)
        if len(time) and time[0] <= self.last_time:
            raise step_error(named, 0, time[0] == self.last_time)
        if len(time):
            _check_clock_steps(table.file, time)
            self.last_time = float(time[-1])
            self.samples += len(time)
        if self.facts is None:
            self.facts = _facts(table, self.path)
        return Run.derived(self.path.name, columns, self.facts, gyro_unit, (*table.findings, *findings))


def needs_whole(table: RawTable) -> bool:
    """Whether a file's first rows show what can't be told block by block: other rates, times of arrival."""
    columns = _internal_columns(table)[0]
    if _of_gyro_rate(columns)[2]:
        return True
    time = columns["time"]
    is_clock = faulty("time", time) is None and bool(np.all(time[1:] > time[:-1]))
    return is_clock and burst_ends(time) is not None


def too_short(file: str, samples: int) -> InputError:
    """What to say of a file with fewer than two samples."""
    usable = "no usable sample" if samples == 0 else "1 usable sample"
    return InputError(f"{file}: {usable}; a run needs at least 2")


def _internal_columns(
    table: RawTable,
) -> tuple[dict[str, FloatArray], Literal["deg/h", "count"], float, list[Finding]]:
    """Columns by name in internal units, the gyro's unit, the clock's [s], and notes on unknown columns."""
    columns: dict[str, FloatArray] = {}
    gyro_unit: Literal["deg/h", "count"] = "deg/h"
    tick_s = 1.0
    unknown = []
    seen: dict[str, None] = {}
    for cell in table.cells:
        name, unit = parse_header(cell)
        if name in seen:
            raise InputError(f"{table.file}: column '{name}' is there twice; rename or remove one of them")
        seen[name] = None
        if cell not in table.columns:
            continue
        factor, offset = conversion(name, unit, table.file)
        values = table.columns[cell]
        if factor != 1.0 or offset != 0.0:
            with np.errstate(over="ignore"):  # an infinite value is found below
                values = values * factor + offset
        columns[name] = values
        if name == "gyro" and unit == "count":
            gyro_unit = "count"
        if name == "time":
            tick_s = factor
        if column_spec(name) is None and name != TIME_ON:
            unknown.append(name)
    if axes := axes_of(columns):
        raise SeveralAxes(table.file, axes)
    for name in ("time", "gyro"):
        if name not in columns:
            for other, unit in map(parse_header, table.cells):
                if unit is not None and column_meant(other) == name:
                    conversion(name, unit, table.file)
            found = _listed(seen)
            raise InputError(
                f"{table.file}: no column '{name}'; a run needs time and gyro, e.g. 'time [s]', "
                f"'gyro [deg/h]'; the header holds {found}; where other names mean these, "
                f"'fogml import {table.file} --draft -o profile.yaml' writes a profile to correct"
            )
    notes = []
    if unknown:
        message = f"kept, and used only by features that name it: {_listed(unknown)}"
        stated = dict(parse_header(cell) for cell in table.cells)
        if any(stated[name] in ("degC", "K") for name in unknown):
            message += "; a temperature is used once it is called T, T_in, T_out, T1 … or T_case"
            message += _of_faces(unknown)
        notes.append(Finding("unknown_column", message, column=unknown[0], count=len(unknown)))
    return columns, gyro_unit, tick_s, notes


def _of_faces(names: Sequence[str]) -> str:
    """What to do with temperatures whose names put them inside or outside of something."""
    faces = {name: face for name in names if (face := face_of(name))}
    if not faces or len(set(faces.values())) < len(faces):
        return ""
    calls = " and ".join(f"'{name}' '{face} [degC]'" for name, face in faces.items())
    where = " and ".join({"T_in": "inner", "T_out": "outer"}[face] for face in faces.values())
    return (
        f"; call {calls} if measured on the coil's {where} face, else 'T_case [degC]' of the housing, "
        "'T_chamber [degC]' of the air"
    )


def _listed(names: Collection[str]) -> str:
    """Names in one line, however many and long they are."""
    shown = [f"'{name[:_LONGEST_NAME]}'" for name in islice(names, _MOST_NAMES)]
    more = [f"{len(names) - len(shown)} more"] if len(names) > len(shown) else []
    return ", ".join(shown + more) or "nothing"


def _check_clock_steps(file: str, time: FloatArray) -> None:
    if fault := clock_fault(time):
        raise InputError(f"{file}, column 'time': {fault}")


def _facts(table: RawTable, path: Path) -> Facts:
    """Facts of the side file, which a person may have corrected, before those in the file itself."""
    beside = read_side_file(path)
    facts = beside if table.facts is None or beside != Facts() else table.facts
    if table.started is not None and facts.started is None:
        facts = facts.model_copy(update={"started": table.started})
    return facts
