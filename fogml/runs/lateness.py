"""An output that follows the recorded rate of the table late or early, as where two clocks differ."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError, quoted
from fogml.numerals import short
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.runs.settling import LEAST_ROWS
from fogml.runs.turning import LEAST_RATE_DEG_S, white_noise
from fogml.signals import large

_LOW, _HIGH = 0.1, 0.9
"""Shares of a step between which its course is nearly a line, a table's acceleration."""


def late_rate(
    run: Run,
    output: str = "gyro",
    *,
    least_s: float = 1.0,
    samples: float = 2.0,
    noises: float = 40.0,
    alike: float = 0.8,
    reach_s: float = 60.0,
    most: int = 64,
) -> Iterator[Finding]:
    """What is said where steps of the output come later or earlier than those of the recorded rate.

    Of each step it is told when the output has begun to follow, by a line through a tenth and nine tenths of
    it: so an acceleration that a commanded rate knows nothing of is no lateness.

    Parameters
    ----------
    run
        The run; a `rate` that rests on levels tells it, one that moves all the time does not.
    output
        The column that follows it: the gyro, or what a simulator gives for that, ``replayed``.
    least_s, samples
        A lateness of at least this [s] and so many sample intervals is told: less lies within what is left
        out about each change.
    noises
        Steps are looked at that are so many times the output's noise.
    alike
        Share of the steps whose lateness is that of the middle one, but for a fifth: what the table does by
        itself, such as to go on turning, is no lateness.
    reach_s
        How far from a step it is looked for [s], half of the plateaus about it at most.
    most
        Steps that are looked at, the greatest.
    """
    if "rate" not in run.columns:
        return
    starts, stops = _changes(run.rate)
    if len(starts) < 2:
        return
    try:
        gyro = run.gyro_deg_h if output == "gyro" else run.columns[output]
    except InputError:
        return  # counts whose scale factor is not stated
    before, after = np.append(0, stops[:-1]), np.append(starts[1:], len(run))
    heights = np.abs(run.rate[np.minimum(stops, len(run) - 1)] - run.rate[starts - 1])
    least = max(LEAST_RATE_DEG_S, noises * white_noise(gyro[: 1 << 16]) / 3600.0)
    kept = np.argsort(-heights, kind="stable")[:most]
    found = []
    for change in kept[heights[kept] > least].tolist():
        start, stop = int(starts[change]), int(stops[change])
        reach = max(int(reach_s / run.sample_s), 8)
        low = max((int(before[change]) + start) // 2, start - reach)
        high = min((stop + int(after[change]) + 1) // 2, stop + reach)
        if min(start - low, high - stop) >= LEAST_ROWS:
            rows = slice(low, high)
            found.append(_late_s(run.time[rows], run.rate[rows], gyro[rows], start - low, stop - low))
    late = np.array([one for one in found if one is not None])
    if len(late) < 2:
        return
    middle = float(np.median(late))
    told = np.abs(late - middle) <= max(0.2 * abs(middle), 1.5 * run.sample_s)
    if abs(middle) < max(least_s, samples * run.sample_s) or told.sum() < alike * len(found):
        return
    what, whose = ("the output", "gyro") if output == "gyro" else (quoted(output), "simulator")
    message = (
        f"{what} follows the recorded rate {short(abs(middle), 2)} s {'late' if middle > 0.0 else 'early'} "
        f"({told.sum()} of {len(found)} steps): the clocks of {whose} and table differ. Shift one "
        "of them, as what is left out about each change of the rate grows by as much"
    )
    yield Finding("late_rate", message, column="rate", row=int(starts[0]) + 1, count=int(told.sum()))


def _changes(rate: FloatArray, least_rows: int = 16) -> tuple[IndexArray, IndexArray]:
    """Rows [start, stop) of changes between levels: the first row off a level, and the first of the next.

    None of a rate that rests on no levels: that moves at more rows than one in `least_rows`.
    """
    rows = [np.empty(0, dtype=np.intp)]
    for first, part in large.differences(rate):
        rows.append(np.flatnonzero(part) + first + 1)
        if sum(map(len, rows)) > len(rate) // least_rows:
            return rows[0], rows[0]
    moved = np.concatenate(rows)
    if len(moved) == 0:
        return moved, moved
    parted = np.flatnonzero(np.diff(moved) > least_rows)
    return moved[np.append(0, parted + 1)], moved[np.append(parted, len(moved) - 1)]


def _late_s(time: FloatArray, rate: FloatArray, gyro: FloatArray, start: int, stop: int) -> float | None:
    """How much later the output begins to follow a change than the rate does [s]; None where it does not."""
    quarters = slice(0, max(start // 4, 2)), slice(-max((len(time) - stop) // 4, 2), None)
    moments = []
    for series in (rate, gyro):
        old, new = (float(np.median(series[rows])) for rows in quarters)
        if not abs(new - old) > 0.0:
            return None
        course = (series - old) / (new - old)
        moments.append([_passed(time, course, share) for share in (_LOW, 0.5, _HIGH)])
    (low, half, high), (gyro_low, gyro_half, gyro_high) = moments
    begin = low - _LOW / (_HIGH - _LOW) * (high - low)
    followed = gyro_low - _LOW / (_HIGH - _LOW) * (gyro_high - gyro_low)
    late = followed - begin
    # A first order's course, which bends, begins before it by the line.
    return max(late, 0.0) if gyro_half >= half else late


def _passed(time: FloatArray, course: FloatArray, share: float) -> float:
    """When a course from 0 to 1 passes a share for the first time, between samples [s]."""
    row = int(np.argmax(course >= share))
    if row == 0:
        return float(time[0])
    low, high = course[row - 1], course[row]
    return float(time[row - 1] + (share - low) / (high - low) * (time[row] - time[row - 1]))
