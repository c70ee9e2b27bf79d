"""Where a temperature moves and where it stays, told from the sensor alone.

The rate at a time is the change over the shortest centred window in which the sensor moves by
more than its noise can, so fast ramps have sharp edges and slow ones are still seen. Windows
are cut off at long gaps and at the ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.runs.turning import white_noise
from fogml.signals import large
from fogml.signals.averages import window_numbers
from fogml.signals.clock import GAP_TOLERANCE, gap_starts

SETTLED_DEGC_MIN = 0.05
"""A sensor slower than this is settled [degC/min]."""
LEAST_CHANGE_DEGC = 0.3
"""Least change of a quiet sensor that tells a rate [degC]."""
NOISE_FACTOR = 6.0
"""The least change is at least this many times the noise of an average."""
LEAST_TRAVEL_DEGC = 1.5
"""A move shorter than this is a wobble of a stay [degC]."""
SHORTEST_STAY_S = 120.0
"""A pause shorter than this is part of the move [s]."""
LONGEST_BRIDGE_S = 120.0
"""Temperatures are not followed across gaps longer than this and than ten samples [s]."""
_MOST_BINS = 200_000
_LONGEST_BIN_S = 30.0
_LEVEL_S = 300.0
_COARSE_S = 30.0


@dataclass(frozen=True)
class Grid:
    """Consecutive averaging bins over the rows of a run.

    Attributes
    ----------
    starts
        First row of each bin, shape (m,).
    rows
        Number of rows.
    time
        Mean time of each bin [s], shape (m,).
    part
        Which part between long gaps each bin belongs to, shape (m,).
    low, high
        First and last time of that part [s], shape (m,).
    """

    starts: IndexArray
    rows: int
    time: FloatArray
    part: IndexArray
    low: FloatArray
    high: FloatArray

    def averages(self, values: FloatArray) -> FloatArray:
        """Averages of a column over the bins, shape (m,)."""
        counts = np.diff(np.append(self.starts, self.rows))
        return np.asarray(np.add.reduceat(values, self.starts) / counts)

    def to_rows(self, labels: NDArray[np.int8]) -> NDArray[np.int8]:
        """Labels of bins as labels of rows."""
        return np.repeat(labels, np.diff(np.append(self.starts, self.rows)))

    @property
    def part_edges(self) -> IndexArray:
        """First bin of each part, and the number of bins at the end."""
        return np.concatenate([[0], np.flatnonzero(np.diff(self.part)) + 1, [len(self.time)]])


@dataclass(frozen=True)
class Move:
    """One move of a temperature, as bins [start, stop).

    Attributes
    ----------
    knee
        The bin from which on the sensor only settles; `stop` where it does not settle.
    direction
        1 up, -1 down.
    travel
        Change over the move [degC].
    """

    start: int
    knee: int
    stop: int
    direction: int
    travel: float


@dataclass(frozen=True)
class Motion:
    """Moves of the leading temperature on a grid, and where any sensor still moves (m,)."""

    grid: Grid
    temperature: FloatArray
    moves: tuple[Move, ...]
    moving: BoolArray


def find_motion(time: FloatArray, sample_s: float, temperatures: Sequence[FloatArray]) -> Motion:
    """Find the moves of the first of some temperatures, and where any of them still moves.

    Parameters
    ----------
    time
        Time of each row [s], shape (n,), strictly increasing.
    sample_s
        Median sample interval [s].
    temperatures
        At least one temperature [degC], shape (n,) each.
    """
    bin_s = max(1.0, sample_s, (time[-1] - time[0]) / _MOST_BINS)
    grid = _grid(time, sample_s, bin_s)
    noise = max(white_noise(grid.averages(values)) for values in temperatures)
    if NOISE_FACTOR * noise > LEAST_CHANGE_DEGC and bin_s < _LONGEST_BIN_S:
        longer = bin_s * (NOISE_FACTOR * noise / LEAST_CHANGE_DEGC) ** 2
        bin_s = min(_LONGEST_BIN_S, longer)
        grid = _grid(time, sample_s, bin_s)
    moving = np.zeros(len(grid.time), dtype=bool)
    leading: tuple[FloatArray, FloatArray] | None = None
    for values in temperatures:
        binned = grid.averages(values)
        least = max(LEAST_CHANGE_DEGC, NOISE_FACTOR * white_noise(binned))
        binned = _without_spikes(binned)
        rate = _rates(grid, binned, least, bin_s)
        moves = _moves(grid, binned, rate)
        for start, stop, _ in moves:
            moving[start:stop] = True
        if leading is None:
            leading = binned, rate
            spans, change = moves, least
    assert leading is not None
    binned, rate = leading
    return Motion(grid, binned, _refined(grid, binned, rate, spans, change), moving)


def _grid(time: FloatArray, sample_s: float, bin_s: float) -> Grid:
    cuts = gap_starts(time, sample_s, max(LONGEST_BRIDGE_S, 10.0 * sample_s) + GAP_TOLERANCE * sample_s)
    begins = [cuts]
    for rows in large.pieces(time, overlap=1):
        number = window_numbers(time[rows], time[0], sample_s, bin_s)
        begins.append(rows.start + np.flatnonzero(np.diff(number) > 0) + 1)
    starts = np.union1d([0], np.concatenate(begins)).astype(np.intp)
    first = np.concatenate([[0], cuts])
    last = np.concatenate([first[1:] - 1, [len(time) - 1]])
    part = np.searchsorted(cuts, starts, side="right")
    grid = Grid(starts, len(time), np.empty(0), part, time[first][part], time[last][part])
    return Grid(starts, len(time), grid.averages(time), part, grid.low, grid.high)


def _without_spikes(values: FloatArray) -> FloatArray:
    """Running median of five: single outliers go, monotone parts stay as they are."""
    if len(values) < 5:
        return values
    padded = np.concatenate([values[:1], values[:1], values, values[-1:], values[-1:]])
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)


def _rates(grid: Grid, values: FloatArray, least: float, bin_s: float) -> FloatArray:
    """Rate of change [degC/min], 0 where the sensor is settled, shape (m,)."""
    widest = 60.0 * least / SETTLED_DEGC_MIN
    rate = np.zeros(len(values))
    width = widest
    while True:
        low = np.maximum(grid.time - width / 2.0, grid.low)
        high = np.minimum(grid.time + width / 2.0, grid.high)
        change = np.interp(high, grid.time, values) - np.interp(low, grid.time, values)
        seen = np.abs(change) >= least
        rate[seen] = 60.0 * change[seen] / (high[seen] - low[seen])
        if width <= 2.0 * bin_s:
            return rate
        width = max(width / 2.0, 2.0 * bin_s)


def _moves(grid: Grid, values: FloatArray, rate: FloatArray) -> list[tuple[int, int, int]]:
    """Moves as (first bin, bin after the last, direction), wobbles left out, pauses closed."""
    direction = np.sign(rate).astype(np.int8)
    edges = np.flatnonzero((np.diff(direction) != 0) | (np.diff(grid.part) != 0)) + 1
    starts, stops = np.concatenate([[0], edges]), np.concatenate([edges, [len(values)]])
    moving = direction[starts] != 0
    pieces = _joined(grid, starts[moving], stops[moving], direction[starts[moving]])
    travel = values[pieces[1] - 1] - values[pieces[0]]
    far = np.abs(travel) >= LEAST_TRAVEL_DEGC
    starts, stops, signs = _joined(grid, pieces[0][far], pieces[1][far], pieces[2][far])
    return [(int(a), int(b), int(s)) for a, b, s in zip(starts, stops, signs)]


def _joined(
    grid: Grid, starts: IndexArray, stops: IndexArray, signs: NDArray[np.int8]
) -> tuple[IndexArray, IndexArray, NDArray[np.int8]]:
    """Neighbouring moves in one direction joined where the pause between is short."""
    if len(starts) < 2:
        return starts, stops, signs
    pause = grid.time[starts[1:]] - grid.time[stops[:-1] - 1]
    same = (signs[1:] == signs[:-1]) & (grid.part[starts[1:]] == grid.part[stops[:-1] - 1])
    apart = ~(same & (pause < SHORTEST_STAY_S))
    first, last = np.concatenate([[True], apart]), np.concatenate([apart, [True]])
    return starts[first], stops[last], signs[first]


def _refined(
    grid: Grid, values: FloatArray, rate: FloatArray, spans: list[tuple[int, int, int]], least: float
) -> tuple[Move, ...]:
    """Moves with sharp starts, short stays absorbed, and the knee where settling begins."""
    edges = grid.part_edges
    moves: list[Move] = []
    for number, (start, stop, direction) in enumerate(spans):
        part_start = int(edges[np.searchsorted(edges, start, side="right") - 1])
        part_stop = int(edges[np.searchsorted(edges, start, side="right")])
        before = max(part_start, moves[-1].stop if moves else 0)
        following = spans[number + 1][0] if number + 1 < len(spans) else part_stop
        following = min(following, part_stop)
        start = _onset(grid, values, (before, start, stop), direction, least / 2.0)
        # A short stay at the turn from one move into the next belongs to the first of them.
        stays = grid.time[following - 1] - grid.time[stop - 1] >= SHORTEST_STAY_S
        if not stays:
            stop = following
        bounds = [start, *_resumptions(grid, values, start, stop), stop]
        for first, last in pairwise(bounds):
            knee = _knee(grid, values, np.abs(rate), first, last, stays or len(bounds) > 2)
            moves.append(Move(first, knee, last, direction, float(values[last - 1] - values[first])))
    return tuple(moves)


def _onset(
    grid: Grid, values: FloatArray, span: tuple[int, int, int], direction: int, tolerance: float
) -> int:
    """The bin at which a move leaves the level of the stay before it."""
    before, start, stop = span
    if start == before or grid.time[start - 1] - grid.time[before] < SHORTEST_STAY_S:
        return before
    level = min(int(np.searchsorted(grid.time, grid.time[start] - _LEVEL_S)), start - 1)
    stay = values[max(before, level) : start]
    left = direction * (values[start:stop] - np.median(stay)) > tolerance
    return start + int(np.argmax(left)) if left.any() else start


def _resumptions(grid: Grid, values: FloatArray, start: int, stop: int) -> list[int]:
    """Bins within a move at which it takes up speed again after less than half of it.

    They tell the steps of a staircase whose stays are too short for the sensor to settle. Speeds
    are those over the time of the least travel, so the steps of a coarse sensor count for nothing.
    """
    duration = grid.time[stop - 1] - grid.time[start]
    travel = abs(values[stop - 1] - values[start])
    step_s = max(_COARSE_S, duration * LEAST_TRAVEL_DEGC / max(travel, LEAST_TRAVEL_DEGC))
    edges = grid.time[start] + step_s * np.arange(int(duration / step_s) + 1)
    speed = np.abs(np.diff(np.interp(edges, grid.time, values)))
    bins = np.searchsorted(grid.time, edges)
    found: list[int] = []
    peak, low, low_at = 0.0, np.inf, 0
    # A few steps for each degree of travel: short whatever the sampling.
    for at, value in enumerate(speed.tolist()):
        if low < 0.5 * peak and value > max(2.0 * low, 0.5 * peak):
            found.append(int(bins[low_at]))
            peak, low = value, np.inf
        elif value > peak:
            peak, low = value, np.inf
        elif value < low:
            low, low_at = value, at
    return found


def _knee(grid: Grid, values: FloatArray, speed: FloatArray, start: int, stop: int, settles: bool) -> int:
    """The bin from which on a move only settles: for good below 0.8 of its rate at half way.

    A move cut short settles if it kept its rate past half way and then slowed to a quarter of it;
    one that slows down all along is a ramp to its end.
    """
    progress = np.abs(values[start:stop] - values[start])
    rate = _rate_between(grid, progress, start, 0.25, 0.75)
    if not settles:
        kept = _rate_between(grid, progress, start, 0.5, 0.7)
        kept = kept >= 0.75 * _rate_between(grid, progress, start, 0.1, 0.3)
        if not kept or speed[stop - 1] > 0.25 * rate:
            return stop
    fast = np.flatnonzero(speed[start:stop] >= 0.8 * rate)
    return start + int(fast[-1]) + 1 if len(fast) else stop


def _rate_between(grid: Grid, progress: FloatArray, start: int, low: float, high: float) -> float:
    """Mean rate [degC/min] between two shares of a move's travel."""
    first, last = (int(np.argmax(progress >= share * progress[-1])) for share in (low, high))
    if last <= first:
        return np.inf
    seconds = grid.time[start + last] - grid.time[start + first]
    return float(60.0 * (progress[last] - progress[first]) / seconds)
