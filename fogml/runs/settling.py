"""How long an output takes to settle after steps of the rate, by all steps together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fogml.arrays import FloatArray, IndexArray

SETTLED_SHARE = 1e-8
"""Share of a step that settling may still lack: a hundredth of a ppm of the scale factor."""
LEAST_ROWS = 4
"""Rows that tell a mean and a line."""
PARTS = 16
"""Parts of a plateau that tell how well its mean is known."""
_GROWTH = 1.5
"""What a window's end is of its begin."""
_ERRORS = 4.0
"""Standard errors beyond which the output has not settled."""


def settling_rows(
    output: FloatArray, starts: IndexArray, stops: IndexArray, heights: FloatArray, first: int
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
    """
    plateaus = [
        _settled(output, start, stop, height)
        for start, stop, height in zip(starts.tolist(), stops.tolist(), heights.tolist(), strict=True)
        if start + first + LEAST_ROWS <= start + (stop - start) // 2
    ]
    settling = first
    while True:
        last = max(first + LEAST_ROWS, round(_GROWTH * first))
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
        if abs(lacked) > max(_ERRORS * np.sqrt(noise), SETTLED_SHARE * squares):
            # One window more: what is left goes on to fall where noise hides it.
            settling = round(_GROWTH * last)
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


def error_of_mean(part: FloatArray) -> float:
    """Standard error of a mean from differences of neighbouring parts, so that a drift is no noise.

    Of parts and not of rows: rounding to whole counts, which rows hold, averages out sooner than noise.
    """
    rows = max(len(part) // PARTS, 1)
    means = part[len(part) % rows :].reshape(-1, rows).mean(axis=1)
    return float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2) / len(means)))
