"""Training rows averaged in blocks of time, for the tuning of a network's shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.errors import InputError
from fogml.signals.averages import BlockAverages, block_averages

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

_MIXED = 0.05
"""Share of an input's variance within blocks beyond which rows are taken not to be in order of time."""
_FINER = 16
"""So many shorter blocks to each, in which a long run's rows are alike, are averaged with those near them."""


@dataclass(frozen=True)
class AveragedRows:
    """Averages of training rows.

    Attributes
    ----------
    inputs, target
        Averages, shapes (m, k) and (m,).
    per_row
        Training rows behind one averaged row, on average.
    in_time
        Whether neighbouring averages are neighbours in time.
    """

    inputs: FloatArray
    target: FloatArray
    per_row: float
    in_time: bool


def average_in_blocks(
    inputs: FloatArray,
    target: FloatArray,
    rows: int,
    groups: ArrayLike | None = None,
    time: ArrayLike | None = None,
) -> AveragedRows:
    """Average consecutive rows down to about `rows` blocks; blocks never cross groups or gaps.

    Where rows turn out not to be in order of time (the inputs scatter within blocks nearly as
    much as over all), rows that are near each other in the inputs are averaged instead.

    Parameters
    ----------
    inputs, target
        Training rows, shapes (n, k) and (n,).
    rows
        Averages wanted; with n <= rows nothing is averaged.
    groups
        Labels of the runs that rows come from, shape (n,).
    time
        Times of the rows [s], shape (n,); by default rows follow each other evenly.

    Raises
    ------
    InputError
        If `groups` or `time` has not n entries.
    """
    count = len(target)
    clock = _one_clock(count, groups, time)
    if count <= rows:
        return AveragedRows(inputs, target, 1.0, True)
    interval, spread = float(np.median(np.diff(clock))), inputs.var(axis=0)
    blocks = _alike_in_blocks(clock, inputs, target, rows, interval, spread)
    if blocks is not None:
        return AveragedRows(blocks.values[0], blocks.values[1], float(np.mean(blocks.counts)), True)
    weights = np.ones(count)
    finer = None
    if count > 2 * _FINER * rows:
        finer = _alike_in_blocks(clock, inputs, target, _FINER * rows, interval, spread)
    if finer is not None:
        (inputs, target), weights = finer.values, finer.counts.astype(np.float64)
    label = _cells(inputs, rows)
    totals = np.bincount(label, weights=weights)
    means = [np.bincount(label, weights=weights * x) / totals for x in (*inputs.T, target)]
    return AveragedRows(np.column_stack(means[:-1]), means[-1], count / len(totals), False)


def _alike_in_blocks(
    clock: FloatArray,
    inputs: FloatArray,
    target: FloatArray,
    rows: int,
    interval: float,
    spread: FloatArray,
) -> BlockAverages | None:
    """Averages of about `rows` blocks of time; None where the inputs scatter within them.

    `interval` is that of the clock, `spread` the variance of the inputs, shape (k,).
    """
    window = interval * int(np.ceil(len(clock) / rows))
    blocks = block_averages(clock, inputs, target, window_s=window)
    between = blocks.values[0].var(axis=0)
    alike = len(blocks) >= rows / 4 and np.all(spread - between <= _MIXED * spread + 1e-12)
    return blocks if alike else None


def _one_clock(count: int, groups: ArrayLike | None, time: ArrayLike | None) -> FloatArray:
    """Increasing times over all groups, each group far from the one before."""
    clock = np.arange(count, dtype=np.float64) if time is None else np.asarray(time, dtype=np.float64)
    label = np.zeros(count) if groups is None else np.asarray(groups)
    for name, values in (("time", clock), ("groups", label)):
        if values.shape != (count,):
            raise InputError(f"fit: {name} has shape {values.shape}, ({count},) was expected")
    if count < 2:
        return clock
    steps = np.diff(clock)
    breaks = (label[1:] != label[:-1]) | (steps < 0)
    inside = steps[~breaks]
    interval = float(np.median(inside)) if inside.size else 1.0
    steps[breaks] = 1e3 * (interval or 1.0) * count
    return np.concatenate([[0.0], np.cumsum(steps)])


def _cells(inputs: FloatArray, cells: int) -> IndexArray:
    """Cell of each row, shape (n,): halved at the median of the widest input, level by level."""
    scaled = inputs / np.where(inputs.std(axis=0) > 0, inputs.std(axis=0), 1.0)
    count = len(scaled)
    label = np.zeros(count, dtype=np.intp)
    every = np.arange(count)
    for _ in range(int(np.log2(cells))):
        sizes = np.bincount(label)
        sums = np.stack([np.bincount(label, weights=column) for column in scaled.T])
        squares = np.stack([np.bincount(label, weights=column**2) for column in scaled.T])
        widest = np.argmax(squares / sizes - (sums / sizes) ** 2, axis=0)
        order = np.lexsort((scaled[every, widest[label]], label))
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        rank = np.empty(count, dtype=np.intp)
        rank[order] = every - np.repeat(starts, sizes)
        label = 2 * label + (rank >= (sizes[label] + 1) // 2)
    return label
