r"""Several linear descriptions of one drift, fitted without parts of the training runs, and combined.

Left out in turn are whole runs where others tell them; else halves, either direction of temperature, and
shorter blocks of time. `fogml.models.weights` weighs what members predict of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Protocol

import numpy as np

from fogml.arrays import FloatArray
from fogml.features.atoms import Atom
from fogml.features.features import Features
from fogml.features.operators import beyond
from fogml.features.parse import parse_features
from fogml.features.terms import Term
from fogml.models.box import learn_box
from fogml.models.folds import Fold, time_folds, told_by_each_other
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import MixedEffects, linear_regressor
from fogml.models.regressors import goes_on_linearly, predict_rows, refit
from fogml.models.table import TrainingTable

LEAST_WEIGHT = 0.02
"""Weight below which a member is left out: it costs windows and operations, and tells next to nothing."""
BLOCKS = 10
"""Folds of blocks of time."""
LEAST_ROWS = 10
"""Fewest averages that a part left out, and the rest, must hold."""


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What members predict of a part left out, less the mean of the rows fitted to [deg/h].

    Attributes
    ----------
    kind
        ``runs``, ``halves``, ``directions`` or ``blocks``.
    predicted, told
        Predictions of m members and the output, shapes (n, m) and (n,).
    errors
        Standard errors of what each member predicts, noise included [deg/h], shape (n, m).
    fold
        Indices of the rows fitted to, and of the part's.
    """

    kind: str
    predicted: FloatArray
    told: FloatArray
    errors: FloatArray
    fold: Fold


class Member(Protocol):
    """A linear description of the drift, refitted to any rows."""

    @property
    def features(self) -> Features:
        """What it is linear in."""
        ...

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's; its standard errors."""
        ...


@dataclass(frozen=True, eq=False)
class SharedMember:
    """A mixed-effects model as a member: sizes are kept, the shared part is found again."""

    features: Features
    found: MixedEffects

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's; its standard errors."""
        coef, intercept, covariance = self.found.given(rest)
        return held @ coef + intercept, standard_errors(held, covariance, self.found.own_variance)


@dataclass(frozen=True, eq=False)
class FittedMember:
    """Any fitted regressor of features as a member."""

    features: Features
    regressor: object

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's; its standard errors."""
        fitted = refit(self.regressor, rest)
        drift = predict_rows(fitted, held)
        if not isinstance(fitted, LinearRegressor):
            return drift, np.full(len(held), np.nan)
        return drift, standard_errors(held, fitted.covariance_, fitted.residual_std_**2)


def standard_errors(columns: FloatArray, covariance: FloatArray, noise: float) -> FloatArray:
    """Standard errors [deg/h] of rows of columns (n, k), of their coefficients' covariance and of the noise.

    The covariance is that of the coefficients, (k, k), or of an intercept before them.
    """
    if len(covariance) > columns.shape[1]:
        columns = np.column_stack([np.ones(len(columns)), columns])
    squares = np.einsum("ij,jk,ik->i", columns, covariance, columns)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) + noise))


def left_out_parts(table: TrainingTable, temperature: FloatArray) -> list[tuple[str, Fold]]:
    """Parts to leave out: whole runs; else halves of each, either direction of temperature, blocks of time.

    Whole runs where there are several that tell each other.
    """
    runs = [np.flatnonzero(table.run_index == run) for run in np.unique(table.run_index)]
    rising = np.zeros(len(table), dtype=np.bool_)
    for rows in runs:
        if len(rows) > 1:
            rising[rows] = np.gradient(temperature[rows]) > 0.0
    everything = np.arange(len(table))
    parts = [
        (kind, (np.setdiff1d(everything, rows), rows))
        for kind, groups in (
            ("runs", runs if told_by_each_other(table.run_index, temperature[:, None]) else []),
            ("halves", [half for rows in runs for half in np.array_split(rows, 2)]),
            ("directions", [np.flatnonzero(rising), np.flatnonzero(~rising)]),
        )
        for rows in groups
    ]
    if len(table) >= BLOCKS * LEAST_ROWS:
        parts += [("blocks", fold) for fold in time_folds(table, BLOCKS, blocks_per_fold=2)]
    told = [(kind, fold) for kind, fold in parts if min(len(rows) for rows in fold) >= LEAST_ROWS]
    # Where runs can be left out nothing is asked of parts of them.
    return [part for part in told if part[0] == "runs"] or told


def left_out(
    members: Sequence[Member], union: Features, table: TrainingTable, parts: Sequence[tuple[str, Fold]]
) -> list[LeftOut]:
    """What members predict of each part, fitted to the rest and limited to its box."""
    found = []
    for kind, (fitted, held) in parts:
        rest, part = table.take(fitted), table.take(held)
        mean = float(rest.y.mean())
        predicted, errors = [], []
        for member in members:
            places = [union.atoms.index(atom) for atom in member.features.atoms]
            own, of_rest, of_part = _bounded(member.features, rest.X[:, places], part.X[:, places])
            learn_box(own, [of_rest])
            linear = goes_on_linearly(getattr(member, "regressor", None)) or isinstance(member, SharedMember)
            limited, _ = own.limit(of_part, np.ones(len(part), dtype=np.bool_), linear=linear)
            columns = replace(rest, X=own.compose(of_rest))
            drift, error = member.on(own, columns, own.compose(limited))
            predicted.append(drift - mean)
            errors.append(error)
        told = part.y - mean
        found.append(LeftOut(kind, np.column_stack(predicted), told, np.column_stack(errors), (fitted, held)))
    return found


def errors_of_all(members: Sequence[Member], union: Features, table: TrainingTable) -> FloatArray:
    """Standard errors of what members predict of the rows that they are fitted to [deg/h], shape (n, m).

    Noise is included.
    """
    errors = []
    for member in members:
        own = member.features
        columns = own.compose(table.X[:, [union.atoms.index(atom) for atom in own.atoms]])
        errors.append(member.on(own, replace(table, X=columns), columns)[1])
    return np.column_stack(errors)


def temperatures_of(table: TrainingTable, features: Features) -> FloatArray:
    """T [degC] of averages of atoms; of the first column where T is not among them."""
    values = [i for i, atom in enumerate(features.atoms) if atom.operator == "value"]
    named = [i for i in values if features.atoms[i].signal.text == "T"]
    return table.X[:, (named or values or [0])[0]]


def _bounded(
    features: Features, rest: FloatArray, part: FloatArray
) -> tuple[Features, FloatArray, FloatArray]:
    """Features whose bounds are those of the rest, with their atoms' values there and in the part."""
    moved: dict[Atom, Atom] = {}
    rest, part = rest.copy(), part.copy()
    for i, atom in enumerate(features.atoms):
        if atom.bounds is None:
            continue
        values = features.atoms.index(Atom("value", atom.signal))
        low, high = float(rest[:, values].min()), float(rest[:, values].max())
        if not low < high:
            continue
        moved[atom] = Atom("beyond", atom.signal, bounds=(low, high))
        for values_of in (rest, part):
            values_of[:, i] = beyond(values_of[:, values], low, high)
    terms = [Term(tuple((moved.get(a, a), power) for a, power in t.factors)) for t in features.terms]
    return Features.from_terms(terms) if moved else parse_features(features.text), rest, part


def combined(
    members: Sequence[tuple[Features, LinearRegressor]], weights: FloatArray, mean: float
) -> tuple[Features, LinearRegressor]:
    """The members' weighed sum about a mean [deg/h] as one linear regressor of all their features.

    Members err by the same noise of the same rows: of weights w that add up to W, the covariance of the sum
    is at most W times the weighed sum of covariances (Jensen), which it is of members that err alike.
    """
    union = reduce(add, (features for features, _ in members))
    place = {term: i for i, term in enumerate(union.terms)}
    coef, intercept = np.zeros(len(union)), mean * (1.0 - float(weights.sum()))
    covariance = np.zeros((len(union) + 1, len(union) + 1))
    noise = 0.0
    for (features, regressor), weight in zip(members, weights.tolist(), strict=True):
        at = np.array([place[term] for term in features.terms])
        coef[at] += weight * regressor.coef_
        intercept += weight * regressor.intercept_
        rows = np.concatenate([[0], at + 1])
        covariance[np.ix_(rows, rows)] += weight * float(weights.sum()) * regressor.covariance_
        noise = max(noise, regressor.residual_std_)
    return union, linear_regressor(coef, intercept, covariance, noise)
