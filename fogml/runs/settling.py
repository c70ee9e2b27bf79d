"""How long outputs take to settle after steps, of all steps together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fogml.arrays import FloatArray, IndexArray

LEAST_ROWS = 4
"""Rows that tell a mean and a line."""
SHARE = 1e-8
"""Of a step, what may lack and count as settled: a hundredth of a ppm of scale factor, and no rounding."""


def settling_rows(
    output: FloatArray,
    starts: IndexArray,
    stops: IndexArray,
    heights: FloatArray,
    first: int,
    *,
    growth: float = 1.5,
    errors: float = 4.0,
    share: float = SHARE,
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
        Of a step, what may lack all the same.
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


def unsettled_rows(
    output: FloatArray,
    begin: IndexArray,
    end: IndexArray,
    heights: FloatArray,
    first: tuple[int, int],
    reach: tuple[int, int],
    share: tuple[float, float] = (SHARE, SHARE),
) -> tuple[int, int]:
    """Rows at the begin of plateaus in which gyro and table have not settled, and at the end in which they
    have left, as where the recorded rate comes late; by all plateaus together.

    Either is told by plateaus without the other, which the begin is looked into twice for.

    Parameters
    ----------
    output
        The gyro's output, shape (n,).
    begin, end
        Rows [begin, end) of plateaus, the first row and the last among them, each of shape (k,).
    heights
        Steps between them, shape (k - 1,).
    first
        Rows that the searches begin with, at begins and at ends.
    reach
        Rows of a plateau that are looked at, at most, from either end.
    share
        Of a step, what may lack at begins and at ends.
    """
    count = len(output)
    lasting = end - begin >= LEAST_ROWS
    begins, ends = lasting[1:], lasting[:-1]
    settling, leaving = 0, 0
    for _ in range(2):
        # Where none is late, all of a plateau tells how it settles.
        late = leaving if leaving > first[1] else 0
        kept = np.minimum(np.append(end[:-1] - late, end[-1])[1:], begin[1:] + reach[0])
        settling = settling_rows(
            output, begin[1:][begins], kept[begins], heights[begins], first[0], share=share[0]
        )
        ended = count - end[:-1]
        kept = np.minimum(count - np.append(0, begin[1:] + settling)[:-1], ended + reach[1])
        leaving = settling_rows(
            output[::-1], ended[ends], kept[ends], -heights[ends], first[1], share=share[1]
        )
    return settling, leaving


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
