"""Columns of another rate than the gyro's, empty in most rows, brought to the gyro's rows at true times."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fogml.runs.columns import DUTY, column_spec
from fogml.runs.findings import Finding
from fogml.signals import large

FloatArray = NDArray[np.float64]

EMPTY_SHARE = 0.4
"""Share of empty rows from which on a column may be one of another rate."""
REGULAR_SHARE = 0.9
"""Share of its values that must be as many rows apart as usual, to half of that or one row."""
LONGEST_HOLE = 3.0
"""Nothing is filled in where values are more usual distances apart [s] than this."""


def is_of_another_rate(values: FloatArray) -> bool:
    """Whether a column is empty (NaN) in many rows, and evenly so."""
    held = np.flatnonzero(~np.isnan(values))
    if len(held) < 2 or len(values) - len(held) < EMPTY_SHARE * len(values):
        return False
    apart = np.diff(held)
    usual = float(np.median(apart))
    return float(np.mean(np.abs(apart - usual) <= max(1.0, 0.5 * usual))) >= REGULAR_SHARE


def on_gyro_rows(
    columns: Mapping[str, FloatArray],
) -> tuple[dict[str, FloatArray], NDArray[np.intp], tuple[Finding, ...]]:
    """Columns of another rate, interpolated in time between their own values, on the gyro's rows.

    Between two values of a duty or a switch the earlier one is held. Before the first value and after
    the last these are held. If the gyro itself is empty in most rows, only its own rows stay.

    Parameters
    ----------
    columns
        Columns of a run in internal units, each of shape (n,); times that don't go back.

    Returns
    -------
    columns, rows, findings
        Columns of shape (m,), the rows that they are of, and a finding for each column that was filled.
    """
    time = columns["time"]
    rows = large.count_up(len(time))
    if not any(np.isnan(values).any() for values in columns.values()):
        return dict(columns), rows, ()
    findings = []
    if is_of_another_rate(columns["gyro"]):
        rows = large.places(~np.isnan(columns["gyro"]))
        message = (
            f"'gyro' is in {len(rows)} of {len(time)} rows: the others, of another rate, are brought to these"
        )
        findings.append(Finding("other_rate", message, column="gyro", count=len(rows)))
    filled: dict[str, FloatArray] = {}
    for name, values in columns.items():
        spec = column_spec(name)
        sparse = spec is not None and name not in ("time", "gyro") and is_of_another_rate(values)
        if not sparse:
            filled[name] = values[rows]
            continue
        held = np.flatnonzero(~np.isnan(values))
        hold = spec is not None and spec.internal == DUTY
        filled[name] = _at(time[rows], time[held], values[held], hold)
        how = "held" if hold else "interpolated"
        message = (
            f"'{name}' is of another rate, {len(held)} values in {len(time)} rows; {how} at its true times"
        )
        findings.append(Finding("other_rate", message, column=name, row=int(held[0]) + 1, count=len(held)))
    return filled, rows, tuple(findings)


def _at(time: FloatArray, known: FloatArray, values: FloatArray, hold: bool) -> FloatArray:
    """Values at other times; NaN in holes."""
    before = np.clip(np.searchsorted(known, time, side="right") - 1, 0, len(known) - 1)
    if hold:
        found = values[before]
    else:
        found = np.interp(time, known, values)
    after = np.minimum(before + 1, len(known) - 1)
    apart = known[after] - known[before]
    hole = (apart > LONGEST_HOLE * float(np.median(np.diff(known)))) & (time != known[before])
    return np.where(hole, np.nan, found)
