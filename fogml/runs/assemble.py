"""From a file's table to a run: headers, units, missing values, order of time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.columns import column_spec, conversion, parse_header
from fogml.runs.facts import Facts, read_side_file
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable
from fogml.runs.run import Run

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
_REPAIR = "--repair"
_MOST_NAMES = 20
_LONGEST_NAME = 40


def run_from_table(table: RawTable, path: Path, *, repair: bool, name: str | None) -> Run:
    """The run that a file's table holds.

    Raises
    ------
    InputError
        For every fault that is not repaired.
    """
    columns, gyro_unit, findings = _internal_columns(table)
    rows = np.arange(len(table), dtype=np.intp)
    for step in (_finite_rows, _ordered_rows, _new_times):
        kept, finding = step(table, columns, rows, repair)
        if finding is not None:
            findings.append(finding)
            rows = rows[kept]
            columns = {key: values[kept] for key, values in columns.items()}
    if len(rows) < 2:
        raise too_short(table.file, len(rows))
    return Run(name or path.name, columns, _facts(table, path), gyro_unit, (*table.findings, *findings))


@dataclass
class Assembler:
    """Runs from consecutive blocks of one file; nothing is repaired."""

    path: Path
    facts: Facts | None = None
    last_time: float = -np.inf
    samples: int = 0

    def block(self, table: RawTable) -> Run:
        """The next block as a run.

        Raises
        ------
        InputError
            For every fault, also for time that goes back or repeats from one block to the next.
        """
        columns, gyro_unit, findings = _internal_columns(table)
        rows = np.arange(len(table), dtype=np.intp)
        _finite_rows(table, columns, rows, repair=False)
        time = columns["time"]
        if len(time) and time[0] <= self.last_time:
            raise _order_error(table, time[0] == self.last_time, 0)
        _ordered_rows(table, columns, rows, repair=False)
        _new_times(table, columns, rows, repair=False)
        if len(time):
            self.last_time = float(time[-1])
            self.samples += len(time)
        if self.facts is None:
            self.facts = _facts(table, self.path)
        return Run(self.path.name, columns, self.facts, gyro_unit, (*table.findings, *findings))


def too_short(file: str, samples: int) -> InputError:
    """What to say of a file with fewer than two samples."""
    usable = "no usable sample" if samples == 0 else "1 usable sample"
    return InputError(f"{file}: {usable}; a run needs at least 2")


def _internal_columns(
    table: RawTable,
) -> tuple[dict[str, FloatArray], Literal["deg/h", "count"], list[Finding]]:
    """Columns by name in internal units, the gyro's unit, and notes on unknown columns."""
    columns: dict[str, FloatArray] = {}
    gyro_unit: Literal["deg/h", "count"] = "deg/h"
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
        if column_spec(name) is None:
            unknown.append(name)
    for name in ("time", "gyro"):
        if name not in columns:
            found = _listed(seen)
            raise InputError(
                f"{table.file}: no column '{name}'; a run needs time and gyro, e.g. 'time [s]', "
                f"'gyro [deg/h]'; the header holds {found}"
            )
    notes = []
    if unknown:
        message = f"kept and not used by models: {_listed(unknown)}"
        notes.append(Finding("unknown_column", message, column=unknown[0], count=len(unknown)))
    return columns, gyro_unit, notes


def _listed(names: Collection[str]) -> str:
    """Names in one line, however many and long they are."""
    shown = [f"'{name[:_LONGEST_NAME]}'" for name in islice(names, _MOST_NAMES)]
    more = [f"{len(names) - len(shown)} more"] if len(names) > len(shown) else []
    return ", ".join(shown + more) or "nothing"


def _finite_rows(
    table: RawTable, columns: Mapping[str, FloatArray], rows: IndexArray, repair: bool
) -> tuple[IndexArray, Finding | None]:
    """Rows whose values of the run format are all finite."""
    bad: NDArray[np.bool_] | None = None
    for name, values in columns.items():
        # The sum is finite unless a value is not, and takes one pass without a mask.
        with np.errstate(over="ignore", invalid="ignore"):
            is_sound = np.isfinite(values.sum())
        if is_sound or column_spec(name) is None:
            continue
        found = ~np.isfinite(values)
        if not found.any():
            continue
        if not repair:
            row = int(np.argmax(found))
            kind = "missing (NaN)" if np.isnan(values[row]) else "infinite"
            raise InputError(
                f"{table.file}, column '{name}', {table.row_name(int(rows[row]))}: the value is {kind}, "
                f"{int(found.sum())} such in the column; correct them, or {_REPAIR} drops the rows"
            )
        bad = found if bad is None else bad | found
    if bad is None:
        return rows, None
    first = int(np.argmax(bad))
    count = int(bad.sum())
    message = f"rows dropped for missing or infinite values: {count}, the first: {table.row_name(first)}"
    return np.flatnonzero(~bad), Finding("repaired_rows", message, row=first + 1, count=count)


def _ordered_rows(
    table: RawTable, columns: Mapping[str, FloatArray], rows: IndexArray, repair: bool
) -> tuple[IndexArray, Finding | None]:
    """Rows in order of time."""
    time = columns["time"]
    back = time[1:] < time[:-1]
    if not back.any():
        return rows, None
    first = int(np.argmax(back)) + 1
    if not repair:
        raise _order_error(table, False, int(rows[first]))
    count = int(back.sum())
    message = f"rows sorted, as time goes back: {count} times, first at {table.row_name(int(rows[first]))}"
    order = np.argsort(time, kind="stable")
    return order, Finding("repaired_order", message, column="time", row=int(rows[first]) + 1, count=count)


def _new_times(
    table: RawTable, columns: Mapping[str, FloatArray], rows: IndexArray, repair: bool
) -> tuple[IndexArray, Finding | None]:
    """Rows whose time is not that of the row before."""
    time = columns["time"]
    repeats = np.flatnonzero(time[1:] == time[:-1]) + 1
    if not len(repeats):
        return rows, None
    first = int(rows[repeats[0]])
    if not repair:
        raise _order_error(table, True, first)
    message = f"rows dropped that repeat a time: {len(repeats)}, the first: {table.row_name(first)}"
    kept = np.delete(np.arange(len(rows), dtype=np.intp), repeats)
    return kept, Finding("repaired_repeats", message, column="time", row=first + 1, count=len(repeats))


def _order_error(table: RawTable, repeats: bool, row: int) -> InputError:
    what, cure = ("repeats", "drops the repeats") if repeats else ("goes back", "sorts the rows")
    return InputError(
        f"{table.file}, column 'time', {table.row_name(row)}: time {what}; it must strictly increase; "
        f"correct it, or {_REPAIR} {cure}"
    )


def _facts(table: RawTable, path: Path) -> Facts:
    """Facts of the side file, which a person may have corrected, before those in the file itself."""
    beside = read_side_file(path)
    if table.facts is None or beside != Facts():
        return beside
    return table.facts
