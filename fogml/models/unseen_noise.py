"""What slow noise leaves on another run, beyond what it leaves on parts left out of the training runs.

A model's parts left out lie between rows that were fitted to, minutes or hours away, and share their slow
noise; another run has slow noise of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IndexArray
from fogml.models.folds import Fold
from fogml.models.row_noise import noise_of_rows, noise_products
from fogml.models.table import TrainingTable
from fogml.processes import one_thread
from fogml.signals.bases import lag
from fogml.signals.distributions import normal_ppf, students_ppf


@dataclass(frozen=True)
class Unseen:
    """What may come on top on another run, by noise model.

    Attributes
    ----------
    variances
        Mean over a run [(deg/h)^2], shape (m,).
    weights
        Probabilities of the models, shape (m,).
    """

    variances: FloatArray
    weights: FloatArray

    def widened(self, half_widths: ArrayLike, levels: Sequence[float]) -> FloatArray:
        """Half-widths at levels [deg/h] with it, both as normal errors, shape (n,)."""
        places = 0.5 + np.array(levels) / 2.0
        shown = np.asarray(half_widths) / normal_ppf(places)
        scales = np.sqrt(shown[:, None] ** 2 + self.variances + np.finfo(float).tiny)
        return np.asarray(students_ppf(places, self.weights, np.zeros(len(self.weights)), scales, np.inf))


NONE = Unseen(np.zeros(1), np.ones(1))
_SAME, _ALIKE = 1e-7, 1e-4
"""Directions of columns this small a share of the greatest are rounding; and tell nothing of forms."""


def unseen_noises(
    table: TrainingTable,
    predicted: FloatArray,
    ways: Sequence[Sequence[Fold]],
    *,
    most_rows: int = 2048,
    moving: int = 2,
    lags_rows: Sequence[float] = (2.0, 8.0, 32.0),
) -> list[Unseen]:
    r"""Slow noise on another run that parts left out do not show, of each way.

    Parameters
    ----------
    table
        Averages of columns and output, run after run.
    predicted
        What the model says of the output, of parts left out [deg/h], shape (n,).
    ways
        Ways of leaving out: folds of rows fitted to and held out.
    most_rows
        Rows that are looked at; more are averaged: slow noise shows in few.
    moving, lags_rows
        What a wrong form leaves comes again on another run, and is no slow noise: noise is told beside the
        squares, the cubes and first-order lags of so many rows of so many directions, those in which the
        columns move most.

    Notes
    -----
    The model is looked on as least squares on the columns X, what it predicts beside them. With the
    covariance C of a run's noise and ``G = (X'X)^{-1} X'`` it leaves squares of ``tr C + tr X G C G' X'`` on
    another run of the same course, and ``y_h - X_h G_r y_r`` of rows h left out of the rest r. In the
    difference ``tr C`` cancels::

        tr X G C G' X' + sum over folds of 2 tr X_h G_r C_rh - tr X_h G_r C_rr G_r' X_h'

    The noise is one of the models that the rows speak for (`fogml.models.row_noise.noise_of_rows`);
    what else moves a run as a whole is no part of it.
    """
    labels = np.full((len(ways), len(table)), -1, dtype=np.intp)
    for label, folds in zip(labels, ways, strict=True):
        for number, (_, held) in enumerate(folds):
            label[held] = number
    table, labels = _averaged(replace(table, X=np.column_stack((table.X, predicted))), labels, most_rows)
    with one_thread("blas"):
        noise = noise_of_rows(replace(table, X=_directions(_with_forms(table, moving, lags_rows), _ALIKE)))
        if noise is None:
            return [NONE] * len(ways)
        constant = np.full((len(table), 1), len(table) ** -0.5)
        basis = np.hstack((constant, _directions(table.X, _SAME)))
        own = np.trace(noise_products(basis, table, noise.step_s), axis1=1, axis2=2)
        shown = [_shown(basis, label, table, noise.step_s) for label in labels]
    variances = [np.maximum(noise.squares @ (own - part) / len(table), 0.0) for part in shown]
    return [Unseen(each, noise.weights) for each in variances]


def _shown(basis: FloatArray, label: IndexArray, table: TrainingTable, step_s: float) -> FloatArray:
    """What the parts left out show beside ``tr C``, of noises of unit squares, shape (3,)."""
    found, count = np.zeros(3), basis.shape[1]
    for number in np.unique(label[label >= 0]):
        held = (label == number)[:, None]
        part = np.where(held, basis, 0.0)
        gain = np.zeros_like(basis)
        gain[~held[:, 0]] = np.linalg.pinv(basis[~held[:, 0]], rcond=_SAME).T
        products = noise_products(np.column_stack((gain, part)), table, step_s)
        found += np.einsum("ij,sij->s", part.T @ part, products[:, :count, :count])
        found -= 2.0 * np.trace(products[:, :count, count:], axis1=1, axis2=2)
    return found


def _directions(columns: FloatArray, least: float) -> FloatArray:
    """Orthonormal directions of columns about their means, the greatest first, shape (n, k)."""
    scale = columns.std(axis=0)
    moves = scale > 0.0
    standard = (columns[:, moves] - columns[:, moves].mean(axis=0)) / scale[moves]
    left, sizes, _ = np.linalg.svd(standard, full_matrices=False)
    return np.asarray(left[:, sizes > least * sizes.max(initial=0.0)])


def _with_forms(table: TrainingTable, moving: int, lags_rows: Sequence[float]) -> FloatArray:
    """Columns with squares, cubes and lags of the directions in which they move most, shape (n, k + m)."""
    most = _directions(table.X[:, :-1], _SAME)[:, :moving] * len(table) ** 0.5
    lagged = np.zeros((len(lags_rows), *most.shape))
    for rows in (table.run_index == run for run in np.unique(table.run_index)):
        time = table.time_s[rows]
        step_s = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
        for place, count in enumerate(lags_rows):
            for column in range(most.shape[1]):
                lagged[place, rows, column] = lag(time, most[rows, column], count * step_s)
    return np.column_stack((table.X, most**2, most**3, *(most - lagged)))


def _averaged(table: TrainingTable, labels: IndexArray, most_rows: int) -> tuple[TrainingTable, IndexArray]:
    """A table of at most about so many rows, neighbours of one run averaged; and their labels."""
    width = -(-len(table) // most_rows)
    if width == 1:
        return table, labels
    within = np.arange(len(table)) - np.searchsorted(table.run_index, table.run_index)
    firsts = np.flatnonzero(within % width == 0)
    count = np.diff(firsts, append=len(table))
    values = np.column_stack((table.X, table.y, table.time_s))
    means = np.add.reduceat(values, firsts, axis=0) / count[:, None]
    taken = replace(table.take(firsts), X=means[:, :-2], y=means[:, -2], time_s=means[:, -1])
    return replace(taken, averaging_s=width * table.averaging_s), labels[:, firsts]
