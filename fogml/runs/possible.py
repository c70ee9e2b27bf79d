"""Numbers and rows that no recording holds: missing, infinite, beyond any sensor; clocks of no logger."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.arrays import BoolArray, FloatArray, IndexArray, unmasked
from fogml.errors import InputError
from fogml.numerals import short
from fogml.runs.clock_order import Ordered
from fogml.runs.columns import DUTY, column_spec, parse_header
from fogml.runs.findings import Finding
from fogml.signals import large

GREATEST = 1e20
"""Values beyond this, in any unit of the run format, are faults; a count of 64 bits is below it."""
SHORTEST_STEP_S = 1e-9
"""No gyro is sampled faster than this [s]."""
GREATEST_TIME_S = 1e11
"""No clock shows more [s]: since 1970 it is 2e9, since year 1, as .NET counts, 6e10; 2e12 are ms."""
ROUGH_STEP = 0.1
"""Single precision is too rough for a clock where its numbers lie more of a mean interval apart."""


def faulty(name: str, values: FloatArray) -> BoolArray | None:
    """Which values of a column of the run format no recording holds, shape (n,); None where all are sound."""
    if column_spec(name) is None or len(values) == 0:
        return None
    low, high = large.extremes(values)  # NaN where any value is
    if low >= -GREATEST and high <= GREATEST:
        return None
    with np.errstate(invalid="ignore"):
        return np.asarray(~(np.abs(values) <= GREATEST))


def fault_of(value: float) -> str:
    """What is wrong with a value."""
    if np.isnan(value):
        return "missing (NaN)"
    return "infinite" if np.isinf(value) else f"{short(value)}, which no sensor gives"


def clock_fault(time: FloatArray) -> str | None:
    """What is wrong with a clock that strictly increases, or None."""
    if len(time) < 2:
        return None
    if max(abs(time[0]), abs(time[-1])) > GREATEST_TIME_S:
        most = max(time[0], time[-1], key=abs)
        return f"times up to {short(most)} s are no clock's; state its unit, e.g. 'time [ms]'"
    step = float(time[-1] - time[0]) / (len(time) - 1)
    if step < SHORTEST_STEP_S:
        return f"samples {short(step)} s apart are no gyro's; state the clock's unit, e.g. 'time [s]'"
    if digits_of_clock(time):
        return (
            f"times such as {np.floor(time[-1]):06.0f} are hours, minutes and seconds in digits, as they jump"
            " where a minute ends; an import profile reads them by 'unit: stamp'; else write them with colons"
            ", as in 09:59:59, or in seconds"
        )
    return None


def digits_of_clock(time: FloatArray) -> bool:
    """Whether strictly increasing times are written as HHMMSS: they jump where a minute ends.

    That is told from two ends on, at intervals up to 40 s: then one step in three does not cross one.
    """
    if not 0.0 <= time[0] < time[-1] < 240_000.0 or _beyond_59(time[:: max(len(time) // 1000, 1)]):
        return False
    if any(_beyond_59(time[part]) for part in large.pieces(time)):
        return False
    found: list[tuple[FloatArray, ...]] = []
    for part in large.pieces(time, overlap=1):
        minute, steps = np.floor(time[part] / 100.0), np.diff(time[part])
        ends = np.diff(minute) > 0.0
        seconds = time[part] - 40.0 * minute - 2400.0 * np.floor(minute / 100.0)
        found.append((steps[~ends], steps[ends], np.diff(seconds)[ends]))
    within, ending, true = (np.concatenate(parts) for parts in zip(*found))
    if len(ending) < 2 or 3 * len(within) < len(ending):
        return False
    usual = float(np.median(within))
    return bool(np.median(true) < 1.5 * usual < np.median(ending))


def _beyond_59(time: FloatArray) -> bool:
    """Whether some times, read as HHMMSS, have a second or minute of 60 or more."""
    whole = np.floor(time)
    return bool(np.any((whole % 100.0 >= 60.0) | (whole // 100.0 % 100.0 >= 60.0)))


def float32_reason(time: FloatArray) -> str | None:
    """Why a clock in single precision can't tell its samples apart, or None if it is not that."""
    if len(time) < 2 or not np.isfinite(time).all():
        return None
    greatest = float(np.abs(time).max())
    if greatest > float(np.finfo(np.float32).max):
        return None
    apart = float(np.spacing(np.float32(greatest)))
    if apart <= ROUGH_STEP * float(np.ptp(time)) / (len(time) - 1) or apart < 1e-6:
        return None
    if np.any(time.astype(np.float32).astype(np.float64) != time):
        return None
    return (
        f"the times are in single precision (float32), whose numbers near {short(greatest, 4)} are "
        f"{short(apart)} s apart; take the start off in double precision before they are stored"
    )


def as_vector(run: str, name: str, values: ArrayLike) -> FloatArray:
    """A column as float64, shape (n,); dates and durations as seconds, dates since the first."""
    values = unmasked(values)
    array = np.asarray(values)
    if name == "time" and (array.dtype.kind in "mM" or _holds_dates(array)):
        return _seconds(run, values)
    if array.dtype.kind not in "fiub" and array.dtype != object:
        raise InputError(f"{run}, column '{name}': holds {array.dtype}, numbers were expected")
    try:
        vector = np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{run}, column '{name}': holds what is no number; numbers were expected") from None
    if vector.ndim != 1:
        raise InputError(
            f"{run}, column '{name}': of shape {vector.shape}, one number a sample was expected, shape (n,)"
        )
    return vector


def _holds_dates(array: NDArray[np.generic]) -> bool:
    """Whether an array of objects holds dates, as that of a pandas column with a time zone does."""
    return array.dtype == object and array.ndim == 1 and len(array) > 0 and hasattr(array[0], "timestamp")


def _seconds(run: str, values: ArrayLike) -> FloatArray:
    """Dates or durations of any resolution as seconds, dates since the first one."""
    array = np.asarray(values)
    if array.dtype == object:
        try:
            seconds = [(date - array[0]).total_seconds() for date in array.tolist()]
        except (AttributeError, TypeError):
            raise InputError(f"{run}, column 'time': holds dates that can't be read") from None
        return np.array(seconds, dtype=np.float64)
    if np.isnat(array).any():
        row = int(np.argmax(np.isnat(array)))
        raise InputError(f"{run}, column 'time', sample {row + 1}: the value is missing (NaT); leave it out")
    if array.ndim != 1:
        raise InputError(f"{run}, column 'time': of shape {array.shape}, shape (n,) was expected")
    unit = np.datetime_data(array.dtype)[0]
    if unit in ("Y", "M", "generic"):
        raise InputError(f"{run}, column 'time': dates of unit '{unit}' tell no samples apart")
    since = array if array.dtype.kind == "m" else array - array[:1]
    return np.asarray(since / np.timedelta64(1, "s"), dtype=np.float64)


def check_columns(run: str, columns: Mapping[str, FloatArray]) -> None:
    """Refuse columns that are no recording: named with a unit, faulty values, a clock that stays."""
    for name, values in columns.items():
        plain, unit = parse_header(name)
        if unit is not None and (spec := column_spec(plain)) is not None:
            raise InputError(
                f"{run}, column '{name}': here it is called '{plain}', in {spec.internal}; "
                "Run.from_pandas takes columns with their units"
            )
        bad = faulty(name, values)
        if bad is not None:
            row = int(np.argmax(bad))
            raise InputError(
                f"{run}, column '{name}', sample {row + 1}: the value is {fault_of(values[row])}, "
                f"{int(bad.sum())} such in the column; correct them or leave these samples out"
            )
    time = columns.get("time")
    if time is None:
        return
    stays = time[1:] <= time[:-1]
    if stays.any():
        row = int(np.argmax(stays)) + 1
        what = "repeats" if time[row] == time[row - 1] else "goes back"
        why = float32_reason(time) or (
            "rows out of order, a restart or a wrapped counter are told apart by "
            "fogml.runs.clock_order.in_order(time, columns)"
        )
        raise InputError(
            f"{run}, column 'time', sample {row + 1}: time {what}; it must strictly increase: {why}"
        )
    if fault := clock_fault(time):
        raise InputError(f"{run}, column 'time': {fault}")


def check_forwards(run: str, part: slice | BoolArray) -> None:
    """Refuse as a part of a run a sample, or samples in an order of one's own."""
    if (part.step or 1) < 0 if isinstance(part, slice) else np.asarray(part).dtype != np.bool_:
        raise InputError(f"{run}: a part is a slice forwards, as run[100:200], or a mask of the samples")


REPAIR = "--repair"


class Rows(NamedTuple):
    """How messages name the rows of a table: base name of the file, and a row by its number from 0; of a part
    of a file `within` names the rows that it holds."""

    file: str
    row_name: Callable[[int], str]
    called: Mapping[str, str] = {}
    within: str = ""

    def fault(self, name: str, row: int, values: FloatArray, found: BoolArray, cure: str) -> str:
        """What to say of faulty values, the first of them in a row by its number, and how to mend them."""
        is_whole = not self.within and bool(found.all())
        if is_whole:
            needed = name in ("time", "gyro")
            cure = "correct them" if needed else "leave the column out where it was not recorded"
            cure += ", or take another axis alone (--axis)" if name in self.called else ""
        no_other = ", and no other" if is_whole else ""
        return (
            f"{self.file}, column '{self.called.get(name, name)}', {self.row_name(row)}: the value is "
            f"{fault_of(values[np.argmax(found)])}, {int(found.sum())} such in "
            f"{self.within or 'the column'}{no_other}; {cure}"
        )


def finite_rows(
    table: Rows, columns: Mapping[str, FloatArray], rows: IndexArray, repair: bool
) -> tuple[IndexArray, Finding | None]:
    """Rows whose values of the run format are all numbers that a recording can hold."""
    bad: BoolArray | None = None
    for name, values in columns.items():
        found = faulty(name, values)
        if found is None:
            continue
        if not repair or (len(found) and found.all()):
            cure = f"correct them, or {REPAIR} drops the rows"
            raise InputError(table.fault(name, int(rows[np.argmax(found)]), values, found, cure))
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
    if table.within:  # of which the rows of legs are counted
        told = f"in {table.within} {told.partition(' (')[0]}"
    cures = " and ".join(dict.fromkeys(fault.cure for fault in ordered.faults))
    return step_error(
        table, int(rows[at]), time[at] == time[at - 1], f"{told}; correct it, or {REPAIR} {cures}"
    )


def step_error(table: Rows, row: int, repeats: bool, cure: str = "") -> InputError:
    cure = cure or f"correct it, or {REPAIR} brings the rows in order"
    what = "repeats" if repeats else "goes back"
    return InputError(
        f"{table.file}, column 'time', {table.row_name(row)}: time {what}; it must strictly increase: {cure}"
    )


def small_shares(name: str, unit: str | None, values: FloatArray) -> list[Finding]:
    """What is said of a column stated in percent, in internal units, that never exceeds 1 %."""
    if unit != "%" or (spec := column_spec(name)) is None:
        return []
    percent = float(np.fmax.reduce(values, initial=0.0)) / spec.units["%"][0]
    if not 0.0 < percent <= 1.0 + 1e-9:
        return []
    cure = (
        f"state the unit '{DUTY}'" if DUTY in spec.units else "a profile's 'scale: 100' makes percent of them"
    )
    message = f"'{name}' never exceeds {short(percent)} %; where these are shares of one, {cure}"
    return [Finding("small_shares", message, column=name)]
