r"""Linear least squares under coloured noise, groups of columns each with a size that the rows tell.

.. math:: y = F \beta + \sum_g Z_g c_g + n, \qquad c_g \sim N(0, s_g^2 C_g)

with F free, n the rows' own noise, and Z_g scaled so that each of its columns has a whitened length of 1
beside F: a size s_g is then how many standard errors long a group is. Sizes are those of most evidence
(empirical Bayes: Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, ch. 5), so that a wide
group costs what it is not needed for, and one that the rows do not confirm goes to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fogml.models.row_noise import stretches_of
from fogml.models.table import TrainingTable
from fogml.runs.run import FloatArray
from fogml.signals.flicker import LONGEST_S
from fogml.signals.noise_model import NoiseModel, flicker_ladder
from fogml.signals.whitening import Whitener

LENGTHS: tuple[float, ...] = (0.1, *np.geomspace(1.0, 1000.0, 13).tolist())
"""Whitened lengths that a group may have: from nothing to all of any gap, in steps of 1.8."""
SWEEPS = 4
"""Times that the size of each group is chosen beside the others'."""
IN_SPAN = 1e-5
"""Share of a column's whitened length beside the free ones under which it lies in their span."""


@dataclass(frozen=True)
class GroupedFit:
    """Coefficients of all columns and what they are uncertain by.

    Attributes
    ----------
    coef, intercept
        [deg/h per unit of a column], shape (k,), and [deg/h].
    covariance
        Of intercept and coefficients, shape (k + 1, k + 1).
    lengths
        Whitened length of each group, shape (g,).
    """

    coef: FloatArray
    intercept: float
    covariance: FloatArray
    lengths: FloatArray


class GroupedRows:
    """Whitened rows of a table, ready for any sizes.

    Parameters
    ----------
    table
        Rows with their runs and times.
    groups
        Group of each of the k columns, shape (k,): 0 free, others from 1 on.
    noise
        Of the rows.
    """

    def __init__(self, table: TrainingTable, groups: NDArray[np.intp], noise: NoiseModel) -> None:
        self.groups = groups
        columns = np.column_stack([table.y, np.ones(len(table)), table.X])
        white = _whitened(columns, table, noise)
        free = np.concatenate([[True], groups == 0])
        self._free, self._grouped = np.flatnonzero(free), np.flatnonzero(~free)
        fixed = white[:, 1:][:, free]
        scale = np.linalg.norm(fixed, axis=0)
        self._scale = np.where(scale > 0.0, scale, 1.0)
        left, strength, right = np.linalg.svd(fixed / self._scale, full_matrices=False)
        held = strength > 1e-10 * strength.max(initial=0.0)
        self._basis, self._back = left[:, held], (right[held].T / strength[held]) / self._scale[:, None]
        others = white[:, 1:][:, ~free]
        self._along = self._basis.T @ others
        beside = others - self._basis @ self._along
        length, whole = np.linalg.norm(beside, axis=0), np.linalg.norm(others, axis=0)
        self._unit = np.where(length > IN_SPAN * whole, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)
        beside *= self._unit
        self._y_along = self._basis.T @ white[:, 0]
        target = white[:, 0] - self._basis @ self._y_along
        self._gram, self._fits = beside.T @ beside, beside.T @ target

    @cached_property
    def _members(self) -> list[NDArray[np.intp]]:
        own = self.groups[self.groups > 0]
        return [np.flatnonzero(own == g) for g in range(1, int(self.groups.max(initial=0)) + 1)]

    def _deviations(self, lengths: Sequence[float]) -> FloatArray:
        """Prior standard deviation of each scaled coefficient."""
        sd = np.zeros(len(self._fits))
        for members, length in zip(self._members, lengths):
            sd[members] = length / math.sqrt(max(int(np.count_nonzero(self._unit[members])), 1))
        return sd

    def log_evidence(self, lengths: Sequence[float]) -> float:
        """Of lengths of the groups, but for a constant."""
        sd = self._deviations(lengths)
        inner = np.eye(len(sd)) + sd[:, None] * self._gram * sd
        factor = cho_factor(inner, lower=True)
        fits = sd * self._fits
        return float(0.5 * fits @ cho_solve(factor, fits) - np.log(np.diag(factor[0])).sum())

    def likeliest(self) -> tuple[float, ...]:
        """Lengths of most evidence, one group after the other, until none changes."""
        lengths = [LENGTHS[len(LENGTHS) // 2]] * len(self._members)
        for _ in range(SWEEPS):
            before = list(lengths)
            for g in range(len(lengths)):
                told = [self.log_evidence([*lengths[:g], s, *lengths[g + 1 :]]) for s in LENGTHS]
                lengths[g] = LENGTHS[int(np.argmax(told))]
            if lengths == before:
                break
        return tuple(lengths)

    def fit(self, lengths: Sequence[float]) -> GroupedFit:
        """Posterior mean and covariance of the coefficients at lengths of the groups."""
        sd = self._deviations(lengths)
        inner = cho_factor(np.eye(len(sd)) + sd[:, None] * self._gram * sd, lower=True)
        scaled = sd * cho_solve(inner, sd * self._fits)
        spread = sd[:, None] * cho_solve(inner, np.diag(sd))
        width = len(self.groups) + 1
        values, covariance = np.zeros(width), np.zeros((width, width))
        to_free = -self._back @ self._along * self._unit
        values[self._grouped] = self._unit * scaled
        values[self._free] = self._back @ self._y_along + to_free @ scaled
        mix = np.zeros((width, len(sd)))
        mix[self._grouped, np.arange(len(sd))] = self._unit
        mix[self._free] = to_free
        covariance[np.ix_(self._free, self._free)] = self._back @ self._back.T
        covariance += mix @ spread @ mix.T
        return GroupedFit(values[1:], float(values[0]), covariance, np.array(lengths))


def _whitened(columns: FloatArray, table: TrainingTable, noise: NoiseModel) -> FloatArray:
    """Columns of a table's rows, each stretch whitened by itself."""
    parts, step_s = stretches_of(table)
    ladder = flicker_ladder(step_s, LONGEST_S)
    return np.concatenate(
        [
            Whitener(noise, table.time_s[p], step_s, ladder).whiten(np.ascontiguousarray(columns[p]))
            for p in parts
        ]
    )
