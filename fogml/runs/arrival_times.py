"""Times of arrival told from times of sampling, and the clock of even samples behind them rebuilt.

A FIFO, a USB packet or a message queue hands several samples over at once: their times come in bursts,
as many samples in a burst as its period holds. A clock that shows whole seconds, or other steps longer
than a sample, is the same with no time at all within a burst.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.numerals import short
from fogml.runs.findings import Finding
from fogml.signals import large

LONG_INTERVALS = 1.5
"""An interval of more mean intervals than this lies between bursts."""
SHORT_INTERVALS = 0.5
"""Within a burst intervals are shorter than this many mean intervals."""
LEAST_BURSTS = 8
"""Bursts from which on their period is told."""
MOST_OF_THEM = 0.8
"""Share of the samples that must lie in bursts that fit, and of the intervals within them."""
TIME_BETWEEN = 0.45
"""Share of the time that lies between bursts, at least: it is what the samples in a burst are for."""
DECISIVE_SIGMA = 3.0
"""Standard errors by which the record's own changes must speak for real pauses before they are kept."""
_SURELY_LONG = 0.999 * LONG_INTERVALS  # leaves room for rounding
_LEAST_SAMPLES = 4 * LEAST_BURSTS
_MOST_DEGREE = 3
_WORTH_A_DEGREE = 1.1
_GAP_PERIODS = 0.75


@dataclass(frozen=True)
class EvenClock:
    """Times rebuilt as even sampling.

    Attributes
    ----------
    time
        Rebuilt times [s], shape (n,); strictly increasing.
    interval_s
        Mean interval between samples [s].
    drift_ppm
        Change of the interval from the start to the end [ppm].
    error_s
        Greatest distance of a recorded time from the rebuilt one, after their mean is taken off [s].
    gaps
        Real gaps that were kept.
    """

    time: FloatArray
    interval_s: float
    drift_ppm: float
    error_s: float
    gaps: int

    def words(self) -> str:
        """What was rebuilt, and how well it is known."""
        gaps = {0: "no gap", 1: "1 gap"}.get(self.gaps, f"{self.gaps} gaps")
        rounding = 1e-6 * self.interval_s
        good = "rounding" if self.error_s < rounding else f"{short(self.error_s, 2)} s"
        return (
            f"clock rebuilt from the mean interval of {self.interval_s:.6g} s (drift "
            f"{short(round(self.drift_ppm, 3) + 0.0)} ppm over the run, {gaps} kept), each time good to "
            f"{good}, and all of them late by one unknown delay"
        )


def burst_ends(time: FloatArray) -> IndexArray | None:
    """The last sample of each burst but the last burst's, or None where times don't come in bursts.

    Bursts are what lies between long intervals, if these take much of the time, nearly all others are
    short, and a burst holds as many samples as its period has mean intervals.
    """
    if len(time) < _LEAST_SAMPLES:
        return None
    count = len(time) - 1
    # The mean is no less than the shortest interval.
    shortest = min(steps.min() for _, steps in large.differences(time))
    longer = sum(np.count_nonzero(steps > _SURELY_LONG * shortest) for _, steps in large.differences(time))
    if longer < LEAST_BURSTS:
        return None
    mean = float(time[-1] - time[0]) / count
    if count > 1000:
        # Long real gaps would make the mean interval too long.
        (usual,) = large.quantiles(lambda: (steps for _, steps in large.differences(time)), [0.999])
        mean = _mean_up_to(time, usual)
    found, spent, short = [], 0.0, 0
    for at, steps in large.differences(time):
        between = steps > LONG_INTERVALS * mean
        found.append(at + np.flatnonzero(between))
        spent += float(steps[between].sum())
        short += int(np.count_nonzero(steps[~between] < SHORT_INTERVALS * mean))
    ends = np.concatenate(found)
    if len(ends) < LEAST_BURSTS or 2 * len(ends) > count + 2:
        return None
    if spent < TIME_BETWEEN * (time[-1] - time[0]) or short < MOST_OF_THEM * (count - len(ends)):
        return None
    sizes, periods = np.diff(ends), np.diff(time[ends])
    interval = float(np.median(periods / sizes))
    fits = np.abs(periods - sizes * interval) < 0.5 * float(np.median(periods))
    # Nor are the first and the last longer: of a logger that becomes quicker one holds all that follows.
    outer = np.minimum([ends[0] + 1, count - ends[-1]], sizes[fits].max(initial=0))
    return ends if sizes[fits].sum() + outer.sum() >= MOST_OF_THEM * len(time) else None


def _mean_up_to(time: FloatArray, longest: float) -> float:
    """Mean of the intervals that are no longer than one."""
    spent, count = 0.0, 0
    for _, steps in large.differences(time):
        usual = steps[steps <= longest]
        spent, count = spent + float(usual.sum()), count + len(usual)
    return spent / count


def pauses_are_real(time: FloatArray, ends: IndexArray, columns: Mapping[str, FloatArray]) -> bool:
    """Whether the record itself shows that time passed between the bursts and not within them.

    Where sampling pauses, a slow quantity changes over a pause by the pause's share of the time; where
    samples only arrive in bursts, by one part in the burst's number of samples. Each column's change
    over the intervals between bursts is regressed on its change from the burst before to the burst
    after next, of which it is then that share of a third.
    """
    starts = np.concatenate([[0], ends + 1])
    sizes = np.diff(np.append(starts, len(time)))
    steps = time[ends + 1] - time[ends]
    periods = np.diff(time[starts])
    real, arrival = float(np.median(steps / periods)), float(np.median(1.0 / sizes))
    best = 0.0
    for name, values in columns.items():
        if name == "time" or not np.isfinite(values).all():
            continue
        means = np.add.reduceat(values, starts) / sizes
        change = (values[ends + 1] - values[ends])[1:-1]
        slow = (means[3:] - means[:-3]) / 3.0
        power = float(slow @ slow)
        if power <= 0.0:
            continue
        share = float(change @ slow) / power
        left = change - share * slow
        error = float(np.sqrt(left @ left / max(len(left) - 1, 1) / power))
        if error <= 0.0:
            continue
        score = (abs(share - arrival) - abs(share - real)) / error
        best = score if abs(score) > abs(best) else best
    return best > DECISIVE_SIGMA


def _even_clock(
    time: FloatArray, anchors: IndexArray, starts: IndexArray, least_gap_s: float = 0.0
) -> EvenClock | None:
    """Even sampling through the times of samples that tell them; None where they don't fit it.

    Each of these `anchors` is of a burst, or of the samples of one stamp, that begins at its row of `starts`.
    """
    told = time[anchors]
    periods, sizes = np.diff(told), np.diff(anchors)
    if len(periods) < 2:
        return None
    interval = float(np.median(periods / sizes))
    period = float(np.median(periods))
    limit = max(_GAP_PERIODS * period, 3.0 * interval, least_gap_s)
    breaks = np.flatnonzero(periods - sizes * interval > limit) + 1
    edges = [0, *breaks.tolist(), len(anchors)]
    first = [0, *starts[breaks].tolist(), len(time)]
    rebuilt, worst, slopes = np.empty(len(time)), 0.0, []
    for part in range(len(edges) - 1):
        within = slice(edges[part], edges[part + 1])
        rows = np.arange(first[part], first[part + 1], dtype=np.float64)
        values, off, ends = _through(anchors[within].astype(float), told[within], interval, rows)
        rebuilt[first[part] : first[part + 1]] = values
        worst = max(worst, off)
        slopes.append((len(rows), *ends))
    if np.any(np.diff(rebuilt) <= 0.0) or worst > max(2.0 * period, least_gap_s):
        return None
    weights = np.array([slope[0] for slope in slopes], dtype=float)
    mean = float(np.average([(slope[1] + slope[2]) / 2.0 for slope in slopes], weights=weights))
    drift = 1e6 * (slopes[-1][2] - slopes[0][1]) / mean if len(breaks) == 0 else 0.0
    return EvenClock(rebuilt, mean, float(drift), worst, len(breaks))


def _through(
    index: FloatArray, told: FloatArray, interval: float, rows: FloatArray
) -> tuple[FloatArray, float, tuple[float, float]]:
    """A smooth clock through told times: its times at rows, greatest misfit, intervals at both ends."""
    if len(index) < LEAST_BURSTS:
        offset = float(np.median(told - index * interval))
        off = float(np.abs(told - index * interval - offset).max())
        return offset + rows * interval, off, (interval, interval)
    x = (index - index[0]) / (index[-1] - index[0])
    chosen = left = None
    for degree in range(1, _MOST_DEGREE + 1):
        fitted = np.polynomial.Polynomial.fit(x, told, degree, domain=[0.0, 1.0], window=[0.0, 1.0])
        spread = float(np.std(told - fitted(x)))
        if left is None or spread * _WORTH_A_DEGREE < left:
            chosen, left = fitted, spread
        else:
            break
    assert chosen is not None
    per_row = index[-1] - index[0]
    at = (rows - index[0]) / per_row
    slope = chosen.deriv()
    ends = float(slope(0.0)) / per_row, float(slope(1.0)) / per_row
    return chosen(at), float(np.abs(told - chosen(x)).max()), ends


def sampling_times(columns: Mapping[str, FloatArray]) -> tuple[FloatArray, Finding | None]:
    """Times of sampling [s], shape (n,): rebuilt where those recorded are times of arrival.

    Parameters
    ----------
    columns
        Columns of a run in internal units, in order of time.

    Returns
    -------
    time, finding
        The times as recorded and None, or those of the rebuilt clock and what was done.
    """
    time = columns["time"]
    ends = burst_ends(time)
    if ends is None:
        return time, None
    starts = np.concatenate([[0], ends + 1])
    clock = None if pauses_are_real(time, ends, columns) else _even_clock(time, ends, starts)
    if clock is None:
        return time, None
    size = float(np.median(np.diff(ends)))
    message = (
        f"the times are those of arrival, in {len(ends) + 1} bursts of {size:.0f} samples: " + clock.words()
    )
    return clock.time, Finding("arrival_times", message, column="time", row=1, count=len(ends) + 1)


def spread_stamps(time: FloatArray) -> tuple[FloatArray, str]:
    """Times [s], shape (n,), in place of stamps that several samples share, and what was done.

    Even sampling through the stamps where they fit it to their own step; else the samples of a stamp
    are spread evenly up to the next one.
    """
    first = np.concatenate([[0], np.flatnonzero(time[1:] != time[:-1]) + 1])
    steps = np.diff(time[first])
    step = float(steps.min()) if len(steps) else 1.0
    clock = _even_clock(time, first, first, 2.0 * step) if len(first) >= LEAST_BURSTS else None
    if clock is not None and clock.error_s <= 1.5 * step:
        return clock.time, clock.words()
    sizes = np.diff(np.append(first, len(time)))
    usual = float(np.median(steps / sizes[:-1])) if len(steps) else step / max(sizes[0], 1)
    # A stamp before a gap stands for its own samples, not for the gap.
    share = np.append(steps, usual * sizes[-1])
    interval = np.minimum(share / sizes, np.maximum(3.0 * usual, step / sizes))
    within = np.arange(len(time)) - np.repeat(first, sizes)
    times = time + within * np.repeat(interval, sizes)
    return times, f"samples of one stamp spread evenly, each time good to {short(step, 2)} s"
