"""Training rows as a search sees them: averaged in blocks of time, standardised; and when it stops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.models.folds import dealt_folds
from fogml.models.rbf.objective import Objective, Shape
from fogml.signals.averages import BlockAverages, block_averages

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
    if len(blocks) < rows / 4:
        return None
    between = blocks.values[0].var(axis=0)
    return blocks if np.all(spread - between <= _MIXED * spread + 1e-12) else None


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


PATIENCE = 15
"""Iterations without a smaller error on held-out rows after which a descent ends."""


def held_out_rows(count: int, everything: bool = False) -> tuple[IndexArray, IndexArray]:
    """Indices of rows fitted to and of rows held out: every fifth block of time, or none."""
    rows = np.arange(count, dtype=np.intp)
    if everything:
        return rows, rows[:0]
    held = dealt_folds(count) == 0
    return rows[~held], rows[held]


class Watch:
    """Keeps the shape with the least mean squared error on held-out rows, and ends what gains nothing.

    Parameters
    ----------
    objective
        The objective on the rows fitted to, for its output weights.
    inputs, linear, target
        Held-out rows: network inputs (n, d), linear columns (n, p), target (n,).

    Attributes
    ----------
    best, error
        The shape kept, None before the first, and its mean squared error.
    """

    def __init__(
        self, objective: Objective, inputs: FloatArray, linear: FloatArray, target: FloatArray
    ) -> None:
        self._objective = objective
        self._held = Objective(inputs, linear, target)
        self.best: Shape | None = None
        self.error = float("inf")
        self._since = 0

    def __call__(self, shape: Shape) -> None:
        """See a shape; raises StopIteration once `PATIENCE` of them in a row were no better."""
        error = self._held.mean_square(shape, self._objective.weights(shape))
        if error < self.error:
            self.best, self.error, self._since = shape, error, 0
            return
        self._since += 1
        if self._since >= PATIENCE:
            self._since = 0
            raise StopIteration


@dataclass(frozen=True)
class Frame:
    """Mean and standard deviation of the inputs, shape (k,), and of the target."""

    shift: FloatArray
    scale: FloatArray
    target_shift: float
    target_scale: float

    @classmethod
    def of(cls, inputs: FloatArray, target: FloatArray) -> Frame:
        """The frame of training rows; what does not vary is left unscaled."""
        shift, scale = inputs.mean(axis=0), inputs.std(axis=0)
        scale = np.where(scale > 1e-12 * np.maximum(np.abs(shift), 1e-300), scale, 1.0)
        deviation = float(target.std())
        return cls(shift, scale, float(target.mean()), deviation if deviation > 0.0 else 1.0)


class Level:
    """Training rows averaged to some coarseness, standardised.

    `seen` are indices of the network's inputs; torch works on `device` in `dtype`.
    """

    def __init__(self, rows: AveragedRows, frame: Frame, seen: IndexArray, device: str, dtype: str) -> None:
        inputs = (rows.inputs - frame.shift) / frame.scale
        self.linear = np.column_stack([inputs, np.ones(len(inputs))])
        self.inputs = np.ascontiguousarray(inputs[:, seen])
        self.target = (rows.target - frame.target_shift) / frame.target_scale
        self.in_time, self.per_row = rows.in_time, rows.per_row
        self._device, self._dtype = device, dtype

    def __len__(self) -> int:
        return len(self.target)

    def objective(self, evidence: bool, share: float) -> tuple[Objective, Watch | None]:
        """The objective, and what watches a descent where it is not the evidence."""
        fitted, held = held_out_rows(len(self), everything=evidence)
        rows = self.inputs[fitted], self.linear[fitted], self.target[fitted]
        objective = Objective(*rows, evidence=evidence, device=self._device, dtype=self._dtype)
        objective.share = share
        if evidence:
            return objective, None
        return objective, Watch(objective, self.inputs[held], self.linear[held], self.target[held])
