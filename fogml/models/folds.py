"""Folds of time: what cross-validation of drift models holds out.

A gyro's noise and what a model leaves are both alike at neighbouring times, so single rows held
out at random are told by their neighbours. Blocks of time are held out instead. Blocks are dealt
to the folds in turn, so that each fold holds a share of every part of the programme; one block
per fold (``blocks_per_fold=1``) holds out whole parts, which asks the model to extrapolate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError, counted
from fogml.models.box import LEAST_SPAN_DEGC

if TYPE_CHECKING:
    from fogml.models.table import TrainingTable

Fold = tuple[IndexArray, IndexArray]
"""Indices of the rows fitted to, and of the rows held out."""
FOLDS = 5
BLOCKS_PER_FOLD = 4


def dealt_blocks(count: int, blocks: int = FOLDS * BLOCKS_PER_FOLD) -> IndexArray:
    """Block of each of `count` rows in time order: `blocks` blocks of neighbouring rows, shape (count,)."""
    return np.arange(count, dtype=np.intp) * min(blocks, max(count, 1)) // max(count, 1)


def dealt_folds(count: int, folds: int = FOLDS, blocks_per_fold: int = BLOCKS_PER_FOLD) -> IndexArray:
    """Fold of each of `count` rows in time order, blocks of rows being dealt in turn, shape (count,)."""
    return dealt_blocks(count, folds * blocks_per_fold) % folds


def time_folds(
    table: TrainingTable, folds: int = FOLDS, *, blocks_per_fold: int = BLOCKS_PER_FOLD, guard_s: float = 0.0
) -> list[Fold]:
    """Folds of a table's rows by blocks of time, each run parted by itself.

    Parameters
    ----------
    table
        Rows in time order, run after run.
    folds
        Number of folds.
    blocks_per_fold
        Blocks that a fold holds of each run.
    guard_s
        Rows of the same run nearer than this to a held-out block are left out of the fit [s].

    Returns
    -------
    list of (fitted, held out)
        Index arrays; folds without rows are left out.

    Raises
    ------
    InputError
        If there are fewer than two rows, or fewer than two folds are asked for.
    """
    if folds < 2:
        raise InputError(f"{folds} folds: at least 2 are needed")
    if len(table) < 2:
        raise InputError(f"{counted(len(table), 'training row')}: at least 2 are needed for folds of time")
    labels = np.empty(len(table), dtype=np.intp)
    for number in np.unique(table.run_index):
        rows = np.flatnonzero(table.run_index == number)
        labels[rows] = dealt_folds(len(rows), folds, blocks_per_fold)
    found = []
    for fold in range(folds):
        held = labels == fold
        fitted = ~held if guard_s <= 0.0 else ~(held | _near(table, held, guard_s))
        if held.any() and fitted.any():
            found.append((np.flatnonzero(fitted), np.flatnonzero(held)))
    return found


def run_folds(table: TrainingTable) -> list[Fold]:
    """Folds that hold out one run each.

    Raises
    ------
    InputError
        If the table holds one run only.
    """
    numbers = np.unique(table.run_index)
    if len(numbers) < 2:
        raise InputError("one training run: at least 2 are needed to leave one out")
    return [
        (np.flatnonzero(table.run_index != number), np.flatnonzero(table.run_index == number))
        for number in numbers
    ]


def told_by_each_other(run_index: IndexArray, temperatures: FloatArray, *, least_share: float = 0.25) -> bool:
    """Whether there are several runs, and the others hold enough of the temperatures each runs through.

    Of a cycle beside a run at one temperature, or of a cold run beside a hot one, the other says nothing:
    what a fit to it leaves there is how it goes on, not how runs differ. A run that stays at its temperature
    runs through nothing, and is told wherever it lies.

    Parameters
    ----------
    run_index
        Run of each row, shape (n,).
    temperatures
        Temperatures [degC], shape (n, k).
    least_share
        Share of each run's span that the others' have to hold: as little as is asked of a unit's runs of its
        fleet's, as over less of it a fit to them mostly goes on beyond what they show.
    """
    numbers = np.unique(run_index)
    for number in numbers:
        rest, own = temperatures[run_index != number], temperatures[run_index == number]
        if not len(rest):
            return False
        span = np.ptp(own, axis=0)
        shared = np.minimum(rest.max(axis=0), own.max(axis=0)) - np.maximum(rest.min(axis=0), own.min(axis=0))
        if np.any((span >= LEAST_SPAN_DEGC) & (shared < least_share * span)):
            return False
    return len(numbers) > 1


def _near(table: TrainingTable, held: BoolArray, guard_s: float) -> BoolArray:
    near = np.zeros(len(table), dtype=bool)
    for number in np.unique(table.run_index[held]):
        rows = np.flatnonzero(table.run_index == number)
        time, inside = table.time_s[rows], held[rows]
        edges = np.flatnonzero(np.diff(inside.astype(np.int8), prepend=0, append=0))
        for first, past in zip(edges[::2], edges[1::2], strict=True):
            start = np.searchsorted(time, time[first] - guard_s, side="left")
            stop = np.searchsorted(time, time[past - 1] + guard_s, side="right")
            near[rows[start:stop]] = True
    return near
