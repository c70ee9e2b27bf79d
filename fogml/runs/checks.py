"""What is noticed in a run that was read: gaps, sampling, sensors, outliers, temperature span.

Nothing is changed; each finding says where and how much.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.runs.findings import Finding
from fogml.runs.run import FloatArray, Run

STUCK_S = 600.0
MOVED_DEGC = 1.0
SATURATED_SAMPLES = 3
OUTLIER_SIGMA = 8.0
SMALL_SPAN_DEGC = 5.0
_IRREGULAR_SHARE = 0.01
_IRREGULAR_PART = 0.1
_RARER_BEFORE_EXTREME = 3
_MOSTLY_CONSTANT = 0.9
_MAD_TO_SIGMA = 1.482602218505602
_SPREAD_SAMPLES = 1024
_LEAST_SAMPLES = 16


def check_run(run: Run) -> tuple[Finding, ...]:
    """Everything noticed in a run, in O(n).

    ``gap``
        Intervals longer than 3 median sample intervals.
    ``irregular_sampling``
        More than 1 % of the other intervals are off the median by more than a tenth.
    ``stuck_sensor``
        The gyro or a temperature holds one value for over 10 min while another temperature
        moves by more than 1 degC.
    ``saturation``
        The gyro stays at its greatest or least value for several samples on end, and is there
        far more often than at the value next to it: noise that is cut off, not its tail.
    ``outliers``
        Gyro samples over 8 robust sigma off the median of the five about them. That median
        follows drift and the steps of a turning table, so neither counts.
    ``small_temperature_span``
        Under 5 degC.
    """
    if len(run) < 2:
        return ()
    parts = (_gaps, _irregular, _stuck, _saturated, _outliers, _span)
    return tuple(finding for part in parts for finding in part(run))


def _gaps(run: Run) -> Iterator[Finding]:
    starts = run.gap_starts
    if len(starts):
        lengths = run.time[starts] - run.time[starts - 1]
        longest = int(np.argmax(lengths))
        gaps = "1 gap" if len(starts) == 1 else f"{len(starts)} gaps"
        message = (
            f"{gaps} longer than 3 sample intervals, the longest {lengths[longest]:.4g} s at "
            f"{run.time[starts[longest] - 1]:.6g} s; the run is cut into {len(starts) + 1} stretches"
        )
        yield Finding("gap", message, column="time", row=int(starts[0]) + 1, count=len(starts))


def _irregular(run: Run) -> Iterator[Finding]:
    steps = np.diff(run.time)
    off = np.abs(steps - run.sample_s) > _IRREGULAR_PART * run.sample_s
    off[run.gap_starts - 1] = False
    count = int(np.count_nonzero(off))
    if count > _IRREGULAR_SHARE * len(steps):
        message = (
            f"{count} of {len(steps)} intervals differ from the median of {run.sample_s:.4g} s by more "
            "than a tenth; true times are used"
        )
        yield Finding("irregular_sampling", message, column="time", row=int(np.argmax(off)) + 2, count=count)


def _stuck(run: Run) -> Iterator[Finding]:
    temperatures = run.temperature_columns
    for name in ("gyro", *temperatures):
        others = [other for other in temperatures if other != name]
        values = run.columns[name]
        spells = [
            (start, stop, moved)
            for start, stop in (_constant_spells(values, run.time) if others else [])
            if (moved := _moving(run, others, slice(start, stop))) is not None
        ]
        if spells:
            start, stop, moved = spells[0]
            count = sum(stop - start for start, stop, _ in spells)
            message = (
                f"'{name}' stays at {values[start]:.6g} from {run.time[start]:.6g} s to "
                f"{run.time[stop - 1]:.6g} s while '{moved}' moves, {count} samples in all; "
                "the sensor may be stuck"
            )
            yield Finding("stuck_sensor", message, column=name, row=start + 1, count=count)


def _constant_spells(values: FloatArray, time: FloatArray) -> list[tuple[int, int]]:
    """Spells [start, stop) of one value that last for over 10 min."""
    edges = np.concatenate([[0], np.flatnonzero(values[1:] != values[:-1]) + 1, [len(values)]])
    long = np.flatnonzero(time[edges[1:] - 1] - time[edges[:-1]] > STUCK_S)
    return [(int(edges[i]), int(edges[i + 1])) for i in long]


def _moving(run: Run, names: list[str], part: slice) -> str | None:
    return next((name for name in names if np.ptp(run.columns[name][part]) > MOVED_DEGC), None)


def _saturated(run: Run) -> Iterator[Finding]:
    gyro = run.gyro
    for extreme, next_to in ((gyro.max(), np.max), (gyro.min(), np.min)):
        at = gyro == extreme
        count = int(np.count_nonzero(at))
        if count < SATURATED_SAMPLES or count == len(gyro) or _longest_spell(at) < SATURATED_SAMPLES:
            continue
        others = gyro[~at]
        is_tail = count <= _RARER_BEFORE_EXTREME * np.count_nonzero(others == next_to(others))
        # An output without noise has levels, not a range that cuts it off.
        is_constant = np.mean(others[1:] == others[:-1]) > _MOSTLY_CONSTANT if len(others) > 1 else True
        if is_tail or is_constant:
            continue
        message = f"{count} samples of 'gyro' at its extreme of {extreme:.6g}; the output may saturate"
        yield Finding("saturation", message, column="gyro", row=int(np.argmax(at)) + 1, count=count)


def _longest_spell(mask: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _outliers(run: Run) -> Iterator[Finding]:
    if len(run) < _LEAST_SAMPLES:
        return
    deviation = np.abs(run.gyro - _median_of_five(run.gyro))
    sigma = _spread(deviation, run.gyro)
    found = deviation > OUTLIER_SIGMA * sigma
    count = int(np.count_nonzero(found))
    if count:
        row = int(np.argmax(found))
        message = (
            f"{count} samples of 'gyro' over {OUTLIER_SIGMA:g} robust sigma off their neighbours, the first "
            f"{run.gyro[row]:.6g} at {run.time[row]:.6g} s; kept"
        )
        yield Finding("outliers", message, column="gyro", row=row + 1, count=count)


def _median_of_five(values: FloatArray) -> FloatArray:
    """Median of each value and the two on either side, mirrored at the ends; shape (n,)."""
    padded = np.concatenate([values[2:0:-1], values, values[-2:-4:-1]])
    a, b, c, d, e = (padded[i : i + len(values)] for i in range(5))
    # The greatest of the pairs' lesser ones and the least of their greater ones are no median:
    # what remains between them is, with the fifth value.
    lower = np.maximum(np.minimum(a, b), np.minimum(d, e))
    upper = np.minimum(np.maximum(a, b), np.maximum(d, e))
    return np.maximum(np.minimum(lower, upper), np.minimum(np.maximum(lower, upper), c))


def _spread(deviation: FloatArray, values: FloatArray) -> FloatArray:
    """Robust sigma of absolute deviations, shape (n,): that of a sample's block, or of most blocks.

    While a table turns, scale-factor noise adds to that of rest: a quiet rest is no reason to
    call all of a turn outliers. Steps of a coarse converter are never below one sigma.
    """
    whole = len(deviation) // _SPREAD_SAMPLES * _SPREAD_SAMPLES
    blocks = np.median(deviation[:whole].reshape(-1, _SPREAD_SAMPLES), axis=1)
    if whole < len(deviation):
        blocks = np.append(blocks, np.median(deviation[max(len(deviation) - _SPREAD_SAMPLES, 0) :]))
    steps = np.abs(np.diff(values))
    resolution = np.min(steps, where=steps > 0.0, initial=np.inf)
    sigma = np.maximum(blocks, np.median(blocks)) * _MAD_TO_SIGMA
    if np.isfinite(resolution):
        sigma = np.maximum(sigma, resolution)
    return np.repeat(sigma, _SPREAD_SAMPLES)[: len(deviation)]


def _span(run: Run) -> Iterator[Finding]:
    if not run.temperature_columns:
        return
    try:
        temperature = run.temperature("T")
    except InputError:  # no coil sensor: the first of the others tells whether it was heated
        temperature = run.columns[run.temperature_columns[0]]
    span = float(np.ptp(temperature))
    if span < SMALL_SPAN_DEGC:
        message = f"the temperature spans {span:.3g} degC only; under 5 degC a drift model is poorly told"
        yield Finding("small_temperature_span", message)
