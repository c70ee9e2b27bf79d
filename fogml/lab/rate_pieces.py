"""Pieces of a rate table's test: plateaus of the table's rate, oscillations, and flanks between plateaus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.runs.settling import LEAST_ROWS, error_of_mean, unsettled_rows
from fogml.runs.transitions import LONGEST_TRANSITION_S
from fogml.runs.turning import white_noise

SETTLING_ROWS = 2
"""Rows left out at the begin of a plateau at least, unless told otherwise: a sample's edge and the loop."""
LEAST_CYCLES = 3
"""Cycles that make an oscillation."""
SINE_SHARE = 0.95
"""Share of the rate's square that a sine explains of an oscillation; of turns to and fro it is 8 / pi**2."""
ROUND_OFF_DEG_H = 1e-6
"""Rates that differ by less are the same."""
_NOISES = 6.0
"""Steps of the recorded rate beyond so many of its own noise are steps of the table."""


@dataclass(frozen=True, eq=False)
class Plateaus:
    """Stretches of constant table rate, in time order; k of them.

    Attributes
    ----------
    start, stop
        Row ranges [start, stop), shape (k,).
    time
        Middle of each [s], shape (k,).
    rate
        Rate that acts on the input axis, table and Earth [deg/h], shape (k,).
    output
        Mean output [deg/h], shape (k,).
    error
        Standard error of that mean from the white noise of its samples [deg/h], shape (k,).
    rate_error
        The same of the recorded rate [deg/h], 0 for one that was commanded, shape (k,).
    clipped
        1 where the output is cut off at the run's greatest or least value, else 0, shape (k,).
    """

    start: FloatArray
    stop: FloatArray
    time: FloatArray
    rate: FloatArray
    output: FloatArray
    error: FloatArray
    rate_error: FloatArray
    clipped: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, which: BoolArray) -> Plateaus:
        """Some of them."""
        return Plateaus(*(getattr(self, one.name)[which] for one in fields(self)))


@dataclass(frozen=True, eq=False)
class Oscillation:
    """Rows [start, stop) in which the table turns to and fro at one frequency [Hz]."""

    start: int
    stop: int
    frequency_hz: float


def earth_deg_h(run: Run) -> float:
    """Earth rate on the input axis [deg/h]; 0 where the facts do not tell it."""
    return run.facts.earth_rate_deg_h or 0.0


def with_steady_earth(run: Run) -> Run:
    """A run as it would be if Earth rate did not change with the table's recorded angle.

    Where the table turns the input axis about, what Earth makes of its output is taken off by the slope of
    the output over the rate, which a few ppm of a scale factor or a bend leave nearly as it is.
    """
    if "angle" not in run.columns or not run.earth_known:
        return run
    turning = run.reference_deg_h - 3600.0 * run.rate - earth_deg_h(run)
    if not turning.any() or np.ptp(run.rate) == 0.0:
        return run
    rate = run.rate - run.rate.mean()
    slope = float(rate @ run.gyro_deg_h) / (3600.0 * float(rate @ rate))
    counts = run.facts.scale_factor if run.gyro_unit == "count" else None
    per_deg_h = 1.0 if counts is None else counts.count_per_deg_h
    return run.with_columns(gyro=run.gyro - slope * per_deg_h * turning)


def find_plateaus(run: Run, waves: Sequence[Oscillation] = (), settle_s: float | None = None) -> Plateaus:
    """The plateaus of a run's table rate.

    Parameters
    ----------
    run
        With the table's rate, best as it was commanded.
    waves
        Its oscillations, which hold none.
    settle_s
        Left out at the begin of each but the first [s]; if None as long as outputs of all plateaus together
        show that gyro and table have not settled, and at the end as long as they show that they have left it
        before the recorded rate did, half of a plateau at most.

    Raises
    ------
    InputError
        If that is no time.
    """
    if settle_s is not None and not 0.0 <= settle_s < np.inf:
        raise InputError(f"settle {settle_s:g} s: a time that is not negative is needed")
    time, rate, output = run.time, run.rate, run.gyro_deg_h
    turning = np.zeros(len(rate), dtype=np.bool_)
    for wave in waves:
        turning[wave.start : wave.stop] = True
    changes = (np.abs(np.diff(rate)) > _NOISES * white_noise(rate[~turning])) | turning[1:] | turning[:-1]
    steps = np.concatenate([[0], np.flatnonzero(changes) + 1, [len(rate)]]).astype(np.intp)
    reach = max(round(2.0 * LONGEST_TRANSITION_S / run.sample_s), 4 * LEAST_ROWS)
    settling = leaving = 0
    if settle_s is None:
        heights = 3600.0 * np.diff(rate)[steps[1:-1] - 1]
        settling, leaving = unsettled_rows(
            output, steps[:-1], steps[1:], heights, (SETTLING_ROWS, 0), (len(rate), reach)
        )
    rows = []
    for start, stop in zip(steps[:-1].tolist(), steps[1:].tolist(), strict=True):
        settled, left, most = start, stop, max(SETTLING_ROWS, (stop - start) // 2)
        if start and settle_s is not None:
            settled = int(np.searchsorted(time, time[start] + settle_s))
        elif start:
            settled = start + min(settling, most)
        if stop < len(rate):
            left = max(stop - min(leaving, most), min(settled + LEAST_ROWS, stop))
        parts = [start, *_long_gaps(run, start, stop), stop]
        for first, last in pairwise(parts):
            begin, end = max(first, settled), min(last, left)
            if end - begin >= LEAST_ROWS and last - first > 2 * LEAST_ROWS:
                rows.append((begin, end))
    told = [_told(run, output, *pair) for pair in rows]
    columns = np.array([(*pair, *values) for pair, values in zip(rows, told, strict=True)]).reshape(-1, 7)
    start, stop = columns[:, :2].astype(np.intp).T
    values = [*columns[:, 2:].T, _clipped(output, rows)]
    return Plateaus(start, stop, *values)


def _clipped(
    output: FloatArray, rows: Sequence[tuple[int, int]], least: float = 0.05, times: float = 3.0
) -> FloatArray:
    """Where more than a share `least` of a plateau's samples is at an end of the output, shape (k,).

    And so many `times` more than plateaus mostly have at their own greatest value: coarse counts and an
    output without noise rest there anyway.
    """
    if not rows:
        return np.zeros(0)
    low, high = float(output.min()), float(output.max())
    parts = [output[start:stop] for start, stop in rows]
    usual = float(np.median([np.mean(part == part.max()) for part in parts]))
    at_end = np.array([max(np.mean(part == low), np.mean(part == high)) for part in parts])
    return np.asarray(at_end > least + times * usual, dtype=np.float64)


def _long_gaps(run: Run, start: int, stop: int) -> list[int]:
    """Rows of a plateau that follow a gap longer than what is recorded of it on either side."""
    time, inside = run.time, run.gap_starts[(run.gap_starts > start) & (run.gap_starts < stop)]
    shorter = np.minimum(time[inside - 1] - time[start], time[stop - 1] - time[inside])
    return [int(row) for row in inside[time[inside] - time[inside - 1] > shorter]]


def _told(run: Run, output: FloatArray, start: int, stop: int) -> tuple[float, ...]:
    part, rate = output[start:stop], 3600.0 * run.rate[start:stop]
    middle = 0.5 * (run.time[start] + run.time[stop - 1])
    acting = float(rate.mean()) + earth_deg_h(run)
    return float(middle), acting, float(part.mean()), error_of_mean(part), error_of_mean(rate)


def merged(values: FloatArray, error: FloatArray) -> FloatArray:
    """Values of which those within `_NOISES` of their errors are one, their mean; shape (k,)."""
    order = np.argsort(values, kind="stable")
    ordered, slack = values[order], ROUND_OFF_DEG_H + _NOISES * error[order]
    group = np.concatenate([[0], np.cumsum(np.diff(ordered) > np.maximum(slack[1:], slack[:-1]))])
    means = np.bincount(group, ordered) / np.bincount(group)
    out = np.empty(len(values))
    out[order] = means[group]
    return out


def find_oscillations(run: Run, *, band: float = 0.05, same_cycle: float = 0.2) -> list[Oscillation]:
    """Stretches in which the table's rate is a sine about rest, each at one frequency.

    Parameters
    ----------
    run
        With the table's rate.
    band
        Share of the greatest rate within which the table is at rest: above a rate's noise and offset, and
        far below the amplitude of any wave in the run, which may differ by ten.
    same_cycle
        Change of the length of a cycle, in its logarithm, from which on the frequency is another: above the
        error of crossings that are told to a sample or two, below steps of a test, a third of an octave.
    """
    time, rate = run.time, run.rate
    # A wave passes zero at a good pace; noise about rest does so within a band.
    rest = band * float(np.abs(rate).max(initial=0.0))
    outside = np.flatnonzero(np.abs(rate) > rest)
    rising = np.flatnonzero((rate[outside[:-1]] < 0.0) & (rate[outside[1:]] > 0.0))
    below, above = outside[rising], outside[rising + 1]
    # Linear between the samples on both sides.
    at = time[below] + (time[above] - time[below]) * -rate[below] / (rate[above] - rate[below])
    cycle = np.diff(at)
    cuts = np.flatnonzero(np.abs(np.diff(np.log(cycle))) > same_cycle) + 1
    found = []
    for piece in np.split(np.arange(len(cycle)), cuts):
        if len(piece) < LEAST_CYCLES:
            continue
        first, last = float(at[piece[0]]), float(at[piece[-1] + 1])
        start, stop = np.searchsorted(time, [first, last]).tolist()
        wave = Oscillation(start, stop, len(piece) / (last - first))
        if _is_sine(time[start:stop], rate[start:stop], wave.frequency_hz):
            found.append(wave)
    return found


def _is_sine(time: FloatArray, rate: FloatArray, frequency_hz: float) -> bool:
    omega = 2.0 * np.pi * frequency_hz * (time - time[0])
    basis = np.column_stack([np.cos(omega), np.sin(omega)])
    left = rate - basis @ np.linalg.lstsq(basis, rate, rcond=None)[0]
    return bool(left @ left <= (1.0 - SINE_SHARE) * float(rate @ rate))
