r"""The drift model of known causes: a twin's constants, and a group of features for each that acts beside.

.. math:: y = F \beta + \sum_g Z_g c_g + n, \qquad c_g \sim N(0, s_g^2 C_g)

with F free, n the rows' own noise, and Z_g scaled so that each of its columns has a whitened length of 1
beside F: a size s_g is then how many standard errors long a group is. Sizes are those of most evidence
(empirical Bayes: Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, ch. 5), so that a wide
group costs what it is not needed for, and one that the rows do not confirm goes to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.grammar import parse_terms
from fogml.features.signal import check_holds
from fogml.features.terms import Term
from fogml.models.box import unsuited
from fogml.models.feature_model import FeatureModel, resolve_features
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import linear_regressor
from fogml.models.row_noise import noise_of_rows, stretches_of
from fogml.models.table import RunRows, TrainingTable, table_of_rows
from fogml.numerals import short
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel, flicker_ladder
from fogml.signals.random_noise import LONGEST_S
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

    def __init__(self, table: TrainingTable, groups: IndexArray, noise: NoiseModel) -> None:
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
    def _members(self) -> list[IndexArray]:
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


MOST_ROWS = 2400
"""Rows that it is fitted to: enough for 30 s in two runs of ten hours, as no thermal effect is faster."""


class CauseModel(FeatureModel):
    """Drift as constants of a twin and as causes, each of which is a group of features with its own size.

    Linear in its features, so that whatever is written of a linear model is written of it. Sizes are what the
    training runs' evidence says (`fogml.models.causes`): a cause that is not confirmed takes no part.

    Parameters
    ----------
    constants
        Text of the constants' features.
    causes
        Name of each cause to the text of its features; a feature that several have is the first one's.
    kind
        Name by which reports call the model.

    Attributes
    ----------
    lengths_ : dict
        Whitened length of each cause, from 0.1, which is nothing.
    """

    kind: str = "causes"
    form: ClassVar[str] = "features"
    tells_covariance: ClassVar[bool] = True

    def __init__(
        self,
        constants: str = "T, T^2",
        causes: Mapping[str, str] | None = None,
        kind: str = "causes",
    ) -> None:
        self.constants = constants
        self.causes = causes
        self.kind = kind
        self.features = ", ".join(term.text for term in self._grouped())
        self.regressor = None
        self.max_rows = MOST_ROWS

    def _grouped(self) -> dict[Term, int]:
        """Every term, and the group that it is of."""
        grouped: dict[Term, int] = {}
        for group, text in enumerate((self.constants, *(self.causes or {}).values())):
            for term in parse_terms(text):
                grouped.setdefault(term, group)
        return grouped

    def _chosen_features(self, runs: Sequence[Run]) -> Features:
        """All features but those of causes that the runs can tell nothing of, such as too long lags."""
        assert isinstance(self.features, str)
        grouped = self._grouped()
        for run in runs:
            check_holds(
                run, {name for t in grouped for a in t.atoms for name in a.signal.sensors}, self.features
            )
        suited = [t for t, g in grouped.items() if not g or not any(unsuited(a, runs) for a in t.atoms)]
        return resolve_features(", ".join(term.text for term in suited), runs)

    def _fit_rows(self, rows: Sequence[RunRows], features: Features) -> int:
        table = table_of_rows(rows, features.compose, self.max_rows)
        grouped = self._grouped()
        self._groups: IndexArray = np.array([grouped[term] for term in features.terms], dtype=np.intp)
        told = noise_of_rows(table)
        if told is None:
            raise InputError(
                f"{len(table)} rows are too few for {len(features)} features of causes; train on longer runs"
            )
        self._noise: NoiseModel = told.mean
        held = GroupedRows(table, self._groups, self._noise)
        self._lengths = held.likeliest()
        self.lengths_ = dict(zip(self.causes or {}, self._lengths))
        self.regressor_ = self._solved(held, table)
        return len(table)

    def _solved(self, held: GroupedRows, table: TrainingTable) -> LinearRegressor:
        found = held.fit(self._lengths)
        left = table.y - table.X @ found.coef - found.intercept
        return linear_regressor(found.coef, found.intercept, found.covariance, float(np.std(left)))

    def _refitted(self, table: TrainingTable) -> LinearRegressor:
        """Fitted to other rows, with the sizes and the noise as they were found."""
        return self._solved(GroupedRows(table, self._groups, self._noise), table)

    def _fit_notes(self) -> list[str]:
        told = ", ".join(f"{name} {short(length)}" for name, length in self.lengths_.items())
        return [f"whitened lengths of causes, 3 and less being little: {told}"] if told else []

    def describe(self) -> dict[str, Any]:
        """As of any model, with the causes and how long each is."""
        return {**super().describe(), "causes": dict(self.lengths_)}
