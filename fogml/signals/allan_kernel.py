"""Compiled sums behind the Allan deviation. Loads numba: import it only where it is used.

A series is held as its phase: the running sum of its values, each segment starting from zero,
segment after segment. Segment ``s`` of k samples holds k + 1 phases at
``edges[s]:edges[s + 1]``.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.processes import available_cores
from fogml.signals import large
from fogml.signals.compiled import kernel

_SUM_BLOCK = 1024
_TILE = 65_536
"""Second differences taken for all averaging factors at a time: 512 KiB of phases, so that the
small factors find theirs in the second-level cache and the large ones share lines in the third."""
_LANES = 16
"""Parts that the work is cut into, whatever the number of threads: same sums on any machine."""
_HELD = 1 << 24
"""Phases held in memory, 128 MiB at most and once a call: a file's pages cost a third of all the time."""
_SMALL = 2_000_000
"""Second differences under which threads cost more than they save."""


def phase(values: FloatArray, starts: IntArray, stops: IntArray) -> tuple[FloatArray, IntArray]:
    """Phases of the segments ``values[starts[s]:stops[s]]``, each less its own mean.

    A constant does not change a second difference of phases, and without it the sums stay
    small and keep their digits. They are summed in short blocks from compensated totals, so
    that rounding does not pile up along the run.
    """
    lengths = stops - starts
    edges = np.concatenate(([0], np.cumsum(lengths + 1))).astype(np.int64)
    phases = large.empty(int(edges[-1]), held=_HELD)
    phases[edges[:-1]] = 0.0
    segment, number = _pieces(lengths, _SUM_BLOCK)
    first = starts[segment] + number * _SUM_BLOCK
    last = np.minimum(first + _SUM_BLOCK, stops[segment])
    place = edges[segment] + 1 + number * _SUM_BLOCK
    # About each segment's first value: an offset far above the noise costs no digits.
    origin = values[np.minimum(starts, len(values) - 1)]
    sums = np.zeros(len(segment))
    bounds = np.linspace(0, len(segment), _LANES + 1).astype(np.int64)
    lanes = [slice(bounds[lane], bounds[lane + 1]) for lane in range(_LANES)]
    threaded = len(phases) > _SMALL

    def add(lane: int) -> None:
        part = lanes[lane]
        _block_sums(values, origin[segment[part]], first[part], last[part], sums[part])

    _spread(add, _LANES, threaded=threaded)
    totals = np.bincount(segment, weights=sums, minlength=len(lengths))
    mean = origin + totals / np.maximum(lengths, 1)
    # The mean as rounded is what each value loses below.
    sums -= (last - first) * (mean - origin)[segment]
    before = _totals_before(segment, sums)

    def fill(lane: int) -> None:
        part = lanes[lane]
        _fill(values, mean[segment[part]], first[part], last[part], before[part], place[part], phases)

    _spread(fill, _LANES, threaded=threaded)
    return phases, edges


def second_difference_squares(
    phases: FloatArray, edges: IntArray, factors: IntArray
) -> tuple[FloatArray, IntArray]:
    """Sum of squared second differences at every sample, and their number, for each factor.

    ``sum (x[i + 2m] - 2 x[i + m] + x[i])^2`` over every i of every segment.
    """
    tiles = _tiles(edges)
    counts = np.array(
        [np.maximum(np.diff(edges) - 2 * m, 0).sum(dtype=np.int64) for m in factors], dtype=np.int64
    )
    lanes = min(_LANES, len(tiles))
    bounds = np.linspace(0, len(tiles), lanes + 1).astype(np.int64)
    partial = np.zeros((lanes, len(factors)))

    def work(lane: int) -> None:
        _overlapping(phases, tiles[bounds[lane] : bounds[lane + 1]], factors, partial[lane])

    _spread(work, lanes, threaded=len(phases) * len(factors) > _SMALL)
    return partial.sum(axis=0), counts


def stepped_second_difference_squares(
    phases: FloatArray, edges: IntArray, factors: IntArray
) -> tuple[FloatArray, IntArray]:
    """The same at every m-th sample of each segment: windows that do not overlap."""
    sums = np.zeros(len(factors))
    counts = np.zeros(len(factors), dtype=np.int64)
    _stepped(phases, edges, factors, sums, counts)
    return sums, counts


def lag_sums(phases: FloatArray, edges: IntArray, factors: IntArray) -> FloatArray:
    """Lag-0 and lag-1 sums of m-sample averages and of their first differences.

    Columns: sum of squares and of neighbours' products of the averages, then of their
    differences; each less its mean in each segment. Shape (len(factors), 4).
    """
    sums = np.zeros((len(factors), 4))

    def work(row: int) -> None:
        _lag_sums(phases, edges, factors[row], sums[row])

    _spread(work, len(factors), threaded=len(phases) > _SMALL)
    return sums


def _spread(work: Callable[[int], None], parts: int, *, threaded: bool) -> None:
    threads = min(available_cores(), parts)
    if not threaded or threads < 2:
        for part in range(parts):
            work(part)
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, range(parts)))


def _pieces(lengths: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Segment of each piece of at most `size`, and the piece's number within its segment."""
    pieces = -(-lengths // size)
    segment = np.repeat(np.arange(len(lengths)), pieces)
    number = np.arange(len(segment)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return segment, number


def _tiles(edges: IntArray) -> IntArray:
    """First index, past-the-last index, and the segment's past-the-last index of every tile."""
    segment, number = _pieces(np.diff(edges), _TILE)
    first = edges[segment] + number * _TILE
    end = edges[segment + 1]
    return np.ascontiguousarray(np.column_stack((first, np.minimum(first + _TILE, end), end)))


@kernel(fastmath={"reassoc", "contract"})
def _sum_about(values: FloatArray, origin: float) -> float:
    total = 0.0
    for i in range(len(values)):
        total += values[i] - origin
    return total


@kernel()
def _block_sums(
    values: FloatArray, origin: FloatArray, first: IntArray, last: IntArray, sums: FloatArray
) -> None:
    for b in range(len(first)):
        sums[b] = _sum_about(values[first[b] : last[b]], origin[b])


@kernel()
def _totals_before(segment: IntArray, sums: FloatArray) -> FloatArray:
    """Sum of a segment's earlier blocks, compensated (Neumaier)."""
    before = np.zeros(len(sums))
    total, lost = 0.0, 0.0
    for b in range(len(sums)):
        if b > 0 and segment[b] != segment[b - 1]:
            total, lost = 0.0, 0.0
        before[b] = total + lost
        added = total + sums[b]
        if abs(total) >= abs(sums[b]):
            lost += (total - added) + sums[b]
        else:
            lost += (sums[b] - added) + total
        total = added
    return before


@kernel()
def _fill(
    values: FloatArray,
    mean: FloatArray,
    first: IntArray,
    last: IntArray,
    before: FloatArray,
    place: IntArray,
    phases: FloatArray,
) -> None:
    for b in range(len(first)):
        local = 0.0
        shift = place[b] - first[b]
        for i in range(first[b], last[b]):
            local += values[i] - mean[b]
            phases[i + shift] = before[b] + local


@kernel(fastmath={"reassoc", "contract"})
def _squares(x0: FloatArray, x1: FloatArray, x2: FloatArray) -> float:
    total = 0.0
    for i in range(len(x0)):
        second = (x2[i] - x1[i]) - (x1[i] - x0[i])
        total += second * second
    return total


@kernel()
def _overlapping(phases: FloatArray, tiles: IntArray, factors: IntArray, sums: FloatArray) -> None:
    for t in range(len(tiles)):
        first, last, end = tiles[t]
        for k in range(len(factors)):
            m = factors[k]
            stop = min(last, end - 2 * m)
            if stop > first:
                sums[k] += _squares(
                    phases[first:stop],
                    phases[first + m : stop + m],
                    phases[first + 2 * m : stop + 2 * m],
                )


@kernel()
def _stepped(
    phases: FloatArray, edges: IntArray, factors: IntArray, sums: FloatArray, counts: IntArray
) -> None:
    for k in range(len(factors)):
        m = factors[k]
        for s in range(len(edges) - 1):
            total = 0.0
            for i in range(edges[s], edges[s + 1] - 2 * m, m):
                second = (phases[i + 2 * m] - phases[i + m]) - (phases[i + m] - phases[i])
                total += second * second
                counts[k] += 1
            sums[k] += total


@kernel()
def _lag_sums(phases: FloatArray, edges: IntArray, m: int, sums: FloatArray) -> None:
    for s in range(len(edges) - 1):
        averages = (edges[s + 1] - 1 - edges[s]) // m
        if averages < 3:
            continue
        first = edges[s]
        begin = (phases[first + m] - phases[first]) / m
        # About the segment's first average, so that a large one costs no digits.
        before, step_before = 0.0, 0.0
        total, squares, products = 0.0, 0.0, 0.0
        step_squares, step_products = 0.0, 0.0
        for k in range(1, averages):
            at = first + k * m
            value = (phases[at + m] - phases[at]) / m - begin
            step = value - before
            total += value
            squares += value * value
            products += value * before
            step_squares += step * step
            if k > 1:
                step_products += step * step_before
            else:
                first_step = step
            before, step_before = value, step
        mean = total / averages
        steps = averages - 1
        drift = before / steps
        sums[0] += squares - averages * mean * mean
        sums[1] += products - mean * (2.0 * total - before) + (averages - 1) * mean * mean
        sums[2] += step_squares - steps * drift * drift
        sums[3] += step_products - drift * (2.0 * before - step_before - first_step) + (steps - 1) * drift**2
