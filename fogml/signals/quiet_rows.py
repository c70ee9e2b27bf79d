"""Rows of a series that tell its steady noise: without loud bursts, steps and spikes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fogml.signals import large

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SPIKE = 8.0
"""A sample, or a step of the sub-averages, further than this many standard deviations is no noise."""
_BLOCKS, _LOUD = 32, 4.0
"""Blocks of time, and the multiple of their median mean square from which one is left out."""
_LEAST = 8
"""Steps between means that tell a typical one."""


def quiet_parts(values: FloatArray, starts: IntArray, stops: IntArray, width: int) -> list[tuple[int, int]]:
    """Rows without loud blocks, cut at steps, as told by means of so many samples; gaps stay cuts."""
    means = [
        values[a : a + (b - a) // width * width].reshape(-1, width).mean(axis=1)
        for a, b in zip(starts.tolist(), stops.tolist())
    ]
    whole = [(a, b) for a, b in zip(starts.tolist(), stops.tolist()) if b - a >= 3]
    steps = [np.abs(np.diff(part)) for part in means]
    count = sum(map(len, steps))
    typical = float(np.median(np.concatenate(steps))) / 0.6745 if count >= _LEAST else 0.0
    if typical == 0.0:
        return whole
    block = max(count // _BLOCKS, 4)
    kept: list[tuple[int, int]] = []
    for start, stop, step in zip(starts.tolist(), stops.tolist(), steps):
        bad = np.zeros(len(step), dtype=np.bool_)
        for first in range(0, len(step), block):
            inside = np.sort(step[first : first + block])
            # A block with one step in it is not loud but for that.
            if float(np.sum(inside[:-1] ** 2)) > _LOUD * typical**2 * len(inside) and len(inside) >= 4:
                bad[first : first + block] = True
        bad |= step > _SPIKE * typical
        edges = np.flatnonzero(np.diff(np.concatenate(([True], bad, [True])).astype(np.int8)))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist()):
            # Means a to b are quiet; the last goes on to the stretch's end.
            kept.append((start + a * width, stop if b == len(step) else start + (b + 1) * width))
    kept = [(a, b) for a, b in kept if b - a >= 3]
    return kept if sum(b - a for a, b in kept) >= 0.5 * sum(b - a for a, b in whole) else whole


def without_spikes(values: FloatArray) -> FloatArray:
    """Values with those far from both neighbours replaced by the neighbours' mean."""
    if len(values) < 3:
        return values

    def away(part: FloatArray) -> FloatArray:
        return np.asarray(np.abs(part[1:-1] - 0.5 * (part[:-2] + part[2:])))

    # White noise of one unit is 3/2 away in variance.
    middle = large.median(lambda: (away(values[part]) for part in large.pieces(values, overlap=2)))
    limit = _SPIKE * middle / 0.6745
    lone = [
        part.start + 1 + np.flatnonzero((away(x := values[part]) > limit) & (np.abs(x[2:] - x[:-2]) <= limit))
        for part in large.pieces(values, overlap=2)
    ]
    rows = np.concatenate(lone)
    if limit == 0.0 or not len(rows):
        return values
    cleaned = large.each(np.copy, values)
    cleaned[rows] = 0.5 * (values[rows - 1] + values[rows + 1])
    return cleaned
