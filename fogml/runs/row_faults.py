"""Rows that can't be rows of a run, and what is said of them: values that are none, time out of order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.clock_order import Ordered
from fogml.runs.findings import Finding
from fogml.runs.possible import fault_of, faulty, float32_reason

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
REPAIR = "--repair"


class Rows(NamedTuple):
    """How messages name the rows of a table: base name of the file, and a row by its number from 0."""

    file: str
    row_name: Callable[[int], str]


def finite_rows(
    table: Rows, columns: Mapping[str, FloatArray], rows: IndexArray, repair: bool
) -> tuple[IndexArray, Finding | None]:
    """Rows whose values of the run format are all numbers that a recording can hold."""
    bad: NDArray[np.bool_] | None = None
    for name, values in columns.items():
        found = faulty(name, values)
        if found is None:
            continue
        if not repair:
            row = int(np.argmax(found))
            raise InputError(
                f"{table.file}, column '{name}', {table.row_name(int(rows[row]))}: the value is "
                f"{fault_of(values[row])}, {int(found.sum())} such in the column; correct them, or {REPAIR} "
                "drops the rows"
            )
        bad = found if bad is None else bad | found
    if bad is None:
        return rows, None
    first = int(rows[np.argmax(bad)])
    count = int(bad.sum())
    message = f"rows dropped for missing or infinite values: {count}, the first: {table.row_name(first)}"
    return np.flatnonzero(~bad), Finding("repaired_rows", message, row=first + 1, count=count)


def order_error(table: Rows, rows: IndexArray, time: FloatArray, ordered: Ordered) -> InputError:
    """What to say of a clock out of order: what it suffers from, and only what mends that."""
    at = int(np.argmax(time[1:] <= time[:-1])) + 1 if np.any(time[1:] <= time[:-1]) else 0
    why = float32_reason(time) or ordered.hopeless
    if why:
        cure = f"{why}; correct it, or give 'sample_s' in an import profile in place of the clock"
        return step_error(table, int(rows[at]), time[at] == time[at - 1], cure)
    told = ", and ".join(fault.told for fault in ordered.faults)
    cures = " and ".join(dict.fromkeys(fault.cure for fault in ordered.faults))
    return step_error(
        table, int(rows[at]), time[at] == time[at - 1], f"{told}; correct it, or {REPAIR} {cures}"
    )


def step_error(table: Rows, row: int, repeats: bool, cure: str = "correct it") -> InputError:
    what = "repeats" if repeats else "goes back"
    return InputError(
        f"{table.file}, column 'time', {table.row_name(row)}: time {what}; it must strictly increase: {cure}"
    )
