"""Changes of the table's rate: where they are, how long outputs take to settle, which samples they spoil."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.runs.turning import least_rate_deg_s, white_noise

LEAST_ROWS = 4
"""Rows that tell a mean and a line."""


def settling_rows(
    output: FloatArray,
    starts: IndexArray,
    stops: IndexArray,
    heights: FloatArray,
    first: int,
    *,
    growth: float = 1.5,
    errors: float = 4.0,
    share: float = 1e-8,
) -> int:
    """Rows after a step in which the output lacks some of it, `first` at least, half of a plateau at most.

    In windows that grow: what the output there differs, along the step, from the line through the plateau's
    second half; a bias that drifts steadily is none of it.

    Parameters
    ----------
    output
        The gyro's output, shape (n,).
    starts, stops
        Rows [start, stop) of the plateaus that begin with a step, each of shape (k,).
    heights
        Those steps of the output, shape (k,).
    first
        Row that the search begins with.
    growth
        What a window's end is of its begin, over 1: settling is told as finely, by means of so many rows.
    errors
        Standard errors beyond which the output has not settled; of tens of windows noise takes none so far.
    share
        Of a step, what may lack all the same: a hundredth of a ppm of the scale factor, and no rounding.
    """
    plateaus = [
        _settled(output, start, stop, height)
        for start, stop, height in zip(starts.tolist(), stops.tolist(), heights.tolist(), strict=True)
        if start + first + LEAST_ROWS <= start + (stop - start) // 2
    ]
    settling = first
    while True:
        last = max(first + LEAST_ROWS, round(growth * first))
        lacked = squares = noise = 0.0
        for start, half, height, count, mean, slope, spread, one in plateaus:
            if start + first + LEAST_ROWS > half:
                continue
            part = output[start + first : min(start + last, half)]
            away = first + 0.5 * (len(part) - 1) - (half - start) - 0.5 * (count - 1)
            lacked += height * float(part.mean() - mean - slope * away)
            squares += height**2
            noise += height**2 * one * (1 / len(part) + 1 / count + away**2 / spread)
        if not squares > 0.0:
            return settling
        if abs(lacked) > max(errors * np.sqrt(noise), share * squares):
            # One window more: what is left goes on to fall where noise hides it.
            settling = round(growth * last)
        first = last


class _Settled(NamedTuple):
    """A plateau: first row, the row that its second half begins with, the step before it, and of that half.

    Rows, mean, slope a row, the sum of squares of the rows about their middle, and the variance of one.
    """

    start: int
    half: int
    height: float
    rows: int
    mean: float
    slope: float
    spread: float
    variance: float


def _settled(output: FloatArray, start: int, stop: int, height: float) -> _Settled:
    half = start + (stop - start) // 2
    settled = output[half:stop]
    count = len(settled)
    rows = np.arange(count) - 0.5 * (count - 1)
    spread = float(rows @ rows)
    slope = float(rows @ settled) / spread
    variance = error_of_mean(settled) ** 2 * count
    return _Settled(start, half, height, count, float(settled.mean()), slope, spread, variance)


def error_of_mean(part: FloatArray, parts: int = 16) -> float:
    """Standard error of a mean from differences of neighbouring parts, so that a drift is no noise.

    Of parts and not of rows: rounding to whole counts, which rows hold, averages out sooner than noise.

    Parameters
    ----------
    part
        Rows, shape (n,).
    parts
        How many there are: few have room for noise that is slower than a row, many tell it to a sixth.
    """
    rows = max(len(part) // parts, 1)
    means = part[len(part) % rows :].reshape(-1, rows).mean(axis=1)
    return float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2) / len(means)))


MARGIN_BEYOND_S = 2.5
"""The margin is this much longer than the time to rate, which the source bounds by 5 s."""
LEAST_GYRO_STEP_DEG_S = 0.1
"""Steps of the gyro smaller than this are not taken for turns of a table [deg/s]."""
LONGEST_TRANSITION_S = 60.0
"""A rate that changes for longer is a profile of its own, not a transition [s]."""
_LAG_S = 1.0
_PLATEAU_S = 3.0
_RATE_NOISES, _GYRO_NOISES = 8.0, 20.0


@dataclass(frozen=True)
class _Changes:
    """Changes of a series of plateaus, k of them: rows [start, stop] over which it changes."""

    start: IndexArray
    stop: IndexArray


def find_transitions(run: Run) -> IndexArray:
    """Rows at which a change of the table's rate begins, shape (k,), ascending.

    Found from the column ``rate``, a measured one too, else from steps of the gyro itself of at
    least 0.1 deg/s and twenty times its noise. A rate that changes for over a minute without a
    pause is no transition.
    """
    return _changes(run).start


def time_to_rate_s(run: Run, settled_share: float = 0.02, noises: float = 6.0) -> float:
    """The longest time the table takes to reach its rate [s]; 0 if it never changes.

    Where the recorded rate steps at once it is a command, and the gyro tells the time: until it
    stays within `settled_share` of the step, or so many standard deviations of its noise, about the new
    plateau. A step of less than twice that noise tells nothing.
    """
    changes = _changes(run)
    if len(changes.start) == 0:
        return 0.0
    longest = float((run.time[changes.stop] - run.time[changes.start]).max())
    return max(longest, _gyro_settling_s(run, changes, settled_share, noises))


def transition_mask(run: Run, margin_s: float | None = None) -> BoolArray:
    """True for the samples to be cut about each change of the table's rate, shape (n,).

    Parameters
    ----------
    run
        The run.
    margin_s
        Samples within this time of a change are cut [s]; by default m = t_z + 2.5 s with t_z the
        table's time to rate, within the source's bounds t_z < m < t_z + 5 s; after a change as long as all
        changes together show that gyro or table have not settled.

    Raises
    ------
    InputError
        If the margin is negative.

    Notes
    -----
    Patent CN105333888A: +-m seconds about each change are deleted. The two samples between which
    the change begins are always cut, so that slow sampling cuts too.
    """
    if margin_s is not None and not margin_s >= 0.0:
        raise InputError(
            f"the margin about a change of the table's rate must not be negative, got {margin_s:g} s"
        )
    changes, time = _changes(run), run.time
    settled_s = margin_s
    if margin_s is None or settled_s is None:
        margin_s = time_to_rate_s(run) + MARGIN_BEYOND_S
        settled_s = _settling_s(run, changes, margin_s)
    starts = changes.start
    first = np.searchsorted(time, time[starts] - margin_s)
    last = np.searchsorted(time, time[starts] + settled_s, side="right")
    edges = np.zeros(len(run) + 1, dtype=np.int64)
    np.add.at(edges, np.minimum(first, np.maximum(starts - 1, 0)), 1)
    np.add.at(edges, last, -1)
    return np.asarray(np.cumsum(edges[:-1]) > 0)


def _changes(run: Run) -> _Changes:
    """The changes of the table's rate, found once for a run."""
    known: _Changes | None = run.__dict__.get("_transitions")
    if known is None:
        known = _find(run)
        run.__dict__["_transitions"] = known
    return known


def _find(run: Run) -> _Changes:
    if len(run) < 3:
        return _Changes(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
    if "rate" in run.columns:
        least = least_rate_deg_s(run, _RATE_NOISES)
        return _level_changes(run, run.rate, least)
    gyro = _gyro_deg_s(run)
    if gyro is None:
        return _Changes(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
    least = max(LEAST_GYRO_STEP_DEG_S, _GYRO_NOISES * _spread(gyro))
    return _lasting(run, gyro, _level_changes(run, gyro, least), least)


def _gyro_deg_s(run: Run) -> FloatArray | None:
    """The gyro as a rate [deg/s]; None for counts without a scale factor."""
    if run.gyro_unit == "count" and run.facts.scale_factor is None:
        return None
    return run.gyro_deg_h / 3600.0


def _spread(values: FloatArray) -> float:
    """Noise of one sample, that of a coarsely quantised output too, whatever its few great steps."""
    # 80 % of the differences of white noise are smaller than 1.28 sqrt(2) standard deviations.
    return float(np.quantile(np.abs(np.diff(values)), 0.8)) / 1.8124


def _level_changes(run: Run, values: FloatArray, least: float) -> _Changes:
    """Where a series moves by more than `least` within a second, single outliers left out."""
    lag = max(1, round(_LAG_S / run.sample_s))
    clean = _median_of_three(values)
    earlier = np.concatenate([np.full(lag, clean[0]), clean])[: len(clean)]
    moved = np.abs(clean - earlier) > least
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moved, [False]]).astype(np.int8)))
    # The first row that differs from the one a lag before begins the change; a lag before the
    # last such row it has ended.
    start, stop = edges[::2], edges[1::2]
    stop = np.where(stop < len(values), np.maximum(stop - lag, start), len(values) - 1)
    brief = run.time[stop] - run.time[start] <= max(LONGEST_TRANSITION_S, 3.0 * run.sample_s)
    return _Changes(start[brief], stop[brief])


def _lasting(run: Run, values: FloatArray, changes: _Changes, least: float) -> _Changes:
    """The changes that leave the series at another level, as no knock and no burst of noise does."""
    reach = max(3, round(_PLATEAU_S / run.sample_s))
    sums = np.concatenate([[0.0], np.cumsum(values - values[0])])

    def mean(first: IndexArray, end: IndexArray) -> FloatArray:
        return np.asarray((sums[end] - sums[first]) / np.maximum(end - first, 1))

    before = mean(np.maximum(changes.start - reach, 0), changes.start)
    after = mean(changes.stop, np.minimum(changes.stop + reach, len(values)))
    lasting = np.abs(after - before) > least
    return _Changes(changes.start[lasting], changes.stop[lasting])


def _median_of_three(values: FloatArray) -> FloatArray:
    left, middle, right = values[:-2], values[1:-1], values[2:]
    inner = np.maximum(np.minimum(left, middle), np.minimum(np.maximum(left, middle), right))
    return np.concatenate([values[:1], inner, values[-1:]])


def _gyro_settling_s(run: Run, changes: _Changes, settled_share: float, noises: float) -> float:
    """The longest time the gyro takes to settle on its new plateau after a change [s]."""
    clean = _median_of_three(run.gyro)
    noise = white_noise(clean)
    edges = np.concatenate([[0], changes.start, [len(run)]])
    longest = 0.0
    for before, start, stop in zip(edges[:-2], edges[1:-1], edges[2:]):
        limit = np.searchsorted(run.time, run.time[start] + LONGEST_TRANSITION_S)
        plateau = clean[start : min(int(stop), int(limit))]
        if len(plateau) < 4:
            continue
        old = float(np.median(clean[before:start][-len(plateau) :]))
        new = float(np.median(plateau[len(plateau) // 2 :]))
        away = np.abs(plateau - new) > max(settled_share * abs(new - old), noises * noise)
        # A plateau that does not hold still in its second half tells no settling time.
        if abs(new - old) > 2.0 * noises * noise and away.any() and not away[len(plateau) // 2 :].any():
            last = start + int(np.flatnonzero(away)[-1])
            longest = max(longest, float(run.time[last] - run.time[start]))
    return longest


def _settling_s(run: Run, changes: _Changes, least_s: float) -> float:
    """Time after changes in which all of them together show that gyro or table have not settled [s].

    `least_s` or longer, half of the shortest plateau at most.
    """
    if len(changes.start) == 0:
        return least_s
    edges = np.concatenate([changes.start, [len(run)]])
    limits = np.searchsorted(run.time, run.time[changes.start] + LONGEST_TRANSITION_S)
    stops = np.minimum(edges[1:], limits)
    first = max(1, round(least_s / run.sample_s))
    kept = (stops - changes.start >= 4 * first) & (changes.start >= LEAST_ROWS)
    if not kept.any():
        return least_s
    starts, stops = changes.start[kept], stops[kept]
    series = run.gyro
    heights = np.array(
        [
            float(series[(start + stop) // 2 : stop].mean() - series[start - LEAST_ROWS : start].mean())
            for start, stop in zip(starts.tolist(), stops.tolist(), strict=True)
        ]
    )
    rows = settling_rows(series, starts, stops, heights, first)
    longest = 0.5 * float(np.min(run.time[stops - 1] - run.time[starts]))
    return max(least_s, min(rows * run.sample_s, longest)) if rows > first else least_s
