"""What is noticed in a run that was read: gaps, sampling, sensors, outliers, temperature span.

Nothing is changed; each finding says where and how much.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fogml.runs.findings import Finding
from fogml.runs.run import FloatArray, Run

STUCK_S = 600.0
MOVED_DEGC = 0.5
SATURATED_SAMPLES = 20
OUTLIER_SIGMA = 8.0
SMALL_SPAN_DEGC = 5.0
_IRREGULAR_SHARE = 0.01
_MAD_TO_SIGMA = 1.482602218505602
_SMOOTHED_SAMPLES = 9


def check_run(run: Run) -> tuple[Finding, ...]:
    """Everything noticed in a run, in O(n).

    ``gap``: intervals longer than 3 median sample intervals. ``irregular_sampling``: more than
    1 % of the other intervals are off the median by more than a tenth. ``stuck_sensor``: one
    value for over 10 min while another temperature moves by more than 0.5 degC. ``saturation``:
    the gyro stays at its greatest or least value for 20 samples. ``outliers``: gyro samples over
    8 robust sigma off the median of their 9 neighbours. ``small_temperature_span``: under 5 degC.
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
        message = (
            f"{len(starts)} gaps longer than 3 sample intervals, the longest {lengths[longest]:.4g} s at "
            f"{run.time[starts[longest] - 1]:.6g} s; the run is cut into {len(starts) + 1} stretches"
        )
        yield Finding("gap", message, column="time", row=int(starts[0]) + 1, count=len(starts))


def _irregular(run: Run) -> Iterator[Finding]:
    steps = np.diff(run.time)
    off = np.abs(steps - run.sample_s) > 0.1 * run.sample_s
    off[run.gap_starts - 1] = False
    count = int(off.sum())
    if count > _IRREGULAR_SHARE * len(steps):
        message = (
            f"{count} of {len(steps)} intervals differ from the median of {run.sample_s:.4g} s by more "
            "than a tenth; true times are used"
        )
        yield Finding("irregular_sampling", message, column="time", row=int(np.argmax(off)) + 2, count=count)


def _stuck(run: Run) -> Iterator[Finding]:
    names = run.temperature_columns
    if len(names) < 2:
        return
    for name in names:
        others = [other for other in names if other != name]
        for start, stop in _constant_spells(run.columns[name], run.time, STUCK_S):
            part = slice(start, stop)
            moved = [other for other in others if np.ptp(run.columns[other][part]) > MOVED_DEGC]
            if moved:
                message = (
                    f"'{name}' stays at {run.columns[name][start]:.6g} degC from {run.time[start]:.6g} s to "
                    f"{run.time[stop - 1]:.6g} s while '{moved[0]}' moves; the sensor may be stuck"
                )
                yield Finding("stuck_sensor", message, column=name, row=start + 1, count=stop - start)
                break


def _constant_spells(values: FloatArray, time: FloatArray, least_s: float) -> list[tuple[int, int]]:
    """Spells [start, stop) of one value that last longer than `least_s`."""
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    starts = np.concatenate([[0], changes])
    stops = np.concatenate([changes, [len(values)]])
    long = time[stops - 1] - time[starts] > least_s
    return list(zip(starts[long].tolist(), stops[long].tolist(), strict=True))


def _saturated(run: Run) -> Iterator[Finding]:
    gyro = run.gyro
    greatest, least = float(gyro.max()), float(gyro.min())
    if greatest == least:
        message = f"'gyro' is {greatest:.6g} in every sample; the output may be dead"
        yield Finding("saturation", message, column="gyro", row=1, count=len(gyro))
        return
    for extreme in (greatest, least):
        at = gyro == extreme
        count = int(at.sum())
        if count >= SATURATED_SAMPLES and _longest_spell(at) >= SATURATED_SAMPLES:
            message = f"{count} samples of 'gyro' at its extreme of {extreme:.6g}; the output may saturate"
            yield Finding("saturation", message, column="gyro", row=int(np.argmax(at)) + 1, count=count)


def _longest_spell(mask: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _outliers(run: Run) -> Iterator[Finding]:
    if len(run) < 4 * _SMOOTHED_SAMPLES:
        return
    deviation = _off_neighbours(run.gyro)
    # Quantised and turning outputs have many zero or huge steps: the spread is that of the middle.
    sigma = _MAD_TO_SIGMA * float(np.median(np.abs(deviation)))
    if sigma == 0.0:
        return
    found = np.abs(deviation) > OUTLIER_SIGMA * sigma
    if "rate" in run.columns or found.mean() > 0.01:
        found &= ~_near_steps(run.gyro, OUTLIER_SIGMA * sigma)
    count = int(found.sum())
    if count:
        row = int(np.argmax(found))
        message = (
            f"{count} samples of 'gyro' over {OUTLIER_SIGMA:g} robust sigma ({sigma:.4g}) off their "
            f"neighbours, the first {run.gyro[row]:.6g} at {run.time[row]:.6g} s; kept"
        )
        yield Finding("outliers", message, column="gyro", row=row + 1, count=count)


def _off_neighbours(values: FloatArray) -> FloatArray:
    """Each value less the median of three means about it: its own side, before, and after.

    Means of the four samples before and after follow drift and steps; the smaller deviation of
    the two counts, so an edge of the table's rate is no outlier and a lone sample is.
    """
    half = _SMOOTHED_SAMPLES // 2
    total = np.concatenate([[0.0], np.cumsum(values - values[0])])
    means = (total[half:] - total[:-half]) / half + values[0]
    before = values[half:-half] - means[: -half - 1][: len(values) - 2 * half]
    after = values[half:-half] - means[half + 1 :]
    inner = np.where(np.abs(before) < np.abs(after), before, after)
    deviation = np.zeros(len(values))
    deviation[half:-half] = inner
    return deviation


def _near_steps(values: FloatArray, size: float) -> NDArray[np.bool_]:
    """Samples within a few of a lasting step: levels before and after differ by more than `size`."""
    half = _SMOOTHED_SAMPLES
    if len(values) <= 2 * half:
        return np.zeros(len(values), dtype=np.bool_)
    total = np.concatenate([[0.0], np.cumsum(values - values[0])])
    means = (total[half:] - total[:-half]) / half
    lasting = np.abs(means[half:] - means[:-half]) > size
    near = np.zeros(len(values), dtype=np.bool_)
    for shift in range(2 * half):
        near[shift : shift + len(lasting)] |= lasting
    return near


def _span(run: Run) -> Iterator[Finding]:
    if not run.temperature_columns:
        return
    temperature = run.temperature("T") if _has_coil(run) else run.columns[run.temperature_columns[0]]
    span = float(np.ptp(temperature))
    if span < SMALL_SPAN_DEGC:
        message = f"the temperature spans {span:.3g} degC only; under 5 degC a drift model is poorly told"
        yield Finding("small_temperature_span", message, count=1)


def _has_coil(run: Run) -> bool:
    return any(name == "T" or name == "T_in" or name[1:].isdigit() for name in run.temperature_columns)
