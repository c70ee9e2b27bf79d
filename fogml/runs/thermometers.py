"""Thermometers that read, but not well: single readings that stand out, and steps too coarse for a rate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import counted
from fogml.numerals import short
from fogml.runs.findings import Finding
from fogml.runs.outliers import OUTLIER_SIGMA, find_outliers
from fogml.runs.run import Run
from fogml.signals import large

LEAST_SPIKE_DEGC = 0.5
"""A reading that stands out by less [degC] moves a rate of temperature by less than ramps differ."""
RATE_WINDOW_S = 64.0
"""Window of a rate of temperature in features that state none [s]."""
SLOW_RATE_DEGC_MIN = 0.1
"""Error of a rate from which on a coarse thermometer is told [degC/min]: a tenth of a usual ramp."""
LEAST_LEVELS = 8
"""Readings of fewer values are of a temperature that hardly moves, or of a set-point."""
MOST_CHANGES = 0.25
"""Where more of the readings differ from the one before, noise rounds the steps off."""


def spiked(run: Run) -> Iterator[Finding]:
    """Readings over 8 robust sigma off their neighbours that step less than a dropout."""
    for name in run.temperature_columns:
        values, bad = run.columns[name], run.dropouts(name)
        # What stands out from the median of five is at most two steps from it.
        if all(
            np.abs(steps).max(initial=0.0) < 0.5 * LEAST_SPIKE_DEGC for _, steps in large.differences(values)
        ):
            continue
        found, _ = find_outliers(values)
        if bad is not None:
            found = found[~bad[found]]
        off = _off(values, found)
        found, off = found[off >= LEAST_SPIKE_DEGC], off[off >= LEAST_SPIKE_DEGC]
        if len(found):
            row, count = int(found[0]), len(found)
            readings = counted(count, "reading")
            message = (
                f"{readings} of '{name}' over {OUTLIER_SIGMA:g} robust sigma off their neighbours, by up to "
                f"{short(off.max())} degC, the first {values[row]:.6g} at {run.time[row]:.10g} s; kept: they "
                "count as temperature and as its rate"
            )
            yield Finding("temperature_outliers", message, column=name, row=row + 1, count=count)


def _off(values: FloatArray, places: IndexArray) -> FloatArray:
    """How far readings are off the median of five, and off lines through the two before and the two after.

    The least of the three, so that a turn of the temperature, which goes on from one side, is none.
    """
    place = places[:, None] + np.array([-2, -1, 0, 1, 2])
    near = values[np.clip(place, 0, len(values) - 1)]
    own = near[:, 2]
    before, after = 2.0 * near[:, 1] - near[:, 0], 2.0 * near[:, 3] - near[:, 4]
    sides = np.abs(np.column_stack((own - before, own - after)))
    sides[:, 0][places < 2] = np.inf
    sides[:, 1][places > len(values) - 3] = np.inf
    return np.minimum(np.abs(own - np.median(near, axis=1)), sides.min(axis=1))


def coarse(run: Run) -> Iterator[Finding]:
    """Thermometers of the coil whose steps make a rate of temperature wrong.

    Of a mean of readings in steps q while less than a step passes, the error has the deviation q / sqrt(12);
    of the rate by two neighbouring windows w, q / sqrt(6) / w.
    """
    for name in dict.fromkeys(one for what in ("T", "T_in", "T_out") for one in run.sensors(what)):
        values = run.columns[name]
        step = resolution(values)
        error = 60.0 * step / np.sqrt(6.0) / RATE_WINDOW_S
        if error < SLOW_RATE_DEGC_MIN or not _in_steps(values, step):
            continue
        message = (
            f"'{name}' is recorded in steps of {short(step)} degC: a rate of temperature over "
            f"{RATE_WINDOW_S:g} s is off by {short(error, 2)} degC/min (one sigma), and its "
            "coefficient by more "
            f"than is stated; record more digits, or take longer windows: dT[block, {_long_enough(step):g} s]"
        )
        yield Finding("coarse_thermometer", message, column=name, count=len(values))


def _long_enough(step: float) -> float:
    """Window, in whole minutes, whose rates are off by less than is told [s]."""
    return 60.0 * float(np.ceil(step / np.sqrt(6.0) / SLOW_RATE_DEGC_MIN))


def _in_steps(values: FloatArray, step: float) -> bool:
    """Whether readings are multiples of a step apart, of several levels, and stay at each for some time."""
    changes, low, high = 0, values[0], values[0]
    for part in large.pieces(values, overlap=1):
        steps = np.diff(values[part])
        if np.any(np.abs(steps - step * np.round(steps / step)) > 0.01 * step):
            return False
        changes += int(np.count_nonzero(steps))
        low, high = min(low, values[part].min()), max(high, values[part].max())
    return changes < MOST_CHANGES * len(values) and (high - low) / step > LEAST_LEVELS - 1.5


def resolution(values: FloatArray) -> float:
    """Smallest step of a column that is not zero; 0 where it never moves."""
    least = np.inf
    for _, steps in large.differences(values):
        least = min(least, float(np.min(np.abs(steps), where=steps != 0.0, initial=np.inf)))
    return least if np.isfinite(least) else 0.0
