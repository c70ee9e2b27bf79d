r"""Several linear descriptions of one drift, weighed on what is left out, and combined.

Left out in turn are whole runs, halves of each run, either direction of temperature, and shorter blocks of
time. With predictions :math:`p_m` of the members and outputs z on a part left out, all less the mean of the
rows fitted to, the weights are

.. math:: \min_{w \ge 0,\ \sum w = 1}\ \operatorname{mean}_\text{parts}
          \frac{\overline{(z - \sum_m w_m p_m)^2}}{\min_m \overline{(z - p_m)^2}}
          + \kappa \sum_m (w_m - \bar w)^2,

stacked regression (Breiman, Machine Learning 24, 1996) with weights drawn together where members tie, times
the skill :math:`\sum \overline{pz} / \sum \overline{p^2}` of their sum p within 0 and 1: no compensation is
its limit 0. Where temperature moves both ways, runs and blocks of time are asked: a half or a direction left
out says how a fit of the rest goes on, which is not how a fit of both does. Where it moves one way only, runs
and halves are all that there is. Of several runs the skill is asked of those left out alone: parts of a run
are told by the rest of it whatever it is that moved the drift, time included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from statistics import NormalDist
from typing import Protocol

import numpy as np
from scipy.optimize import minimize

from fogml.features.atoms import Atom
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.features.terms import Term
from fogml.models.box import distance_outside, learn_box
from fogml.models.folds import Fold, time_folds
from fogml.models.intervals import LEVELS, Intervals
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects import MixedEffects, linear_regressor
from fogml.models.regressors import goes_on_linearly, predict_rows, refit
from fogml.models.table import TrainingTable
from fogml.runs.run import FloatArray
from fogml.signals.memory import Beyond

UNSEEN_SHIFT = 2.0**0.5
"""Widening where no run can be left out: how a run is shifted from the next is not seen in one, and is taken
to have the variance of what is left within it."""
LEAST_WEIGHT = 0.02
"""Weight below which a member is left out: it costs windows and operations, and tells next to nothing."""
DRAWN_TOGETHER = 0.02
"""Weight kappa of equal weights, against squared errors as shares of the best member's."""
WIDENING_PER_SPAN = 1.0
"""Growth of the half-width per box span outside the box, as a share of itself: errors of parts left out that
lie outside the box of the rest are compared with those inside at this ratio (development data: the shipped
thermal cycle, simulated tactical units)."""
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
    excess
        Distance of the rows from the box of those fitted to, as a share of its span, shape (n,).
    """

    kind: str
    predicted: FloatArray
    told: FloatArray
    excess: FloatArray


class Member(Protocol):
    """A linear description of the drift, refitted to any rows."""

    @property
    def features(self) -> Features:
        """What it is linear in."""
        ...

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> FloatArray:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's."""
        ...


@dataclass(frozen=True, eq=False)
class SharedMember:
    """A mixed-effects model as a member: sizes are kept, the shared part is found again."""

    features: Features
    found: MixedEffects

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> FloatArray:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's."""
        coef, intercept = self.found.given(rest)
        return held @ coef + intercept


@dataclass(frozen=True, eq=False)
class FittedMember:
    """Any fitted regressor of features as a member."""

    features: Features
    regressor: object

    def on(self, own: Features, rest: TrainingTable, held: FloatArray) -> FloatArray:
        """Drift [deg/h] of feature columns held out (n, k), of a fit to the rest's."""
        return predict_rows(refit(self.regressor, rest), held)


def left_out_parts(table: TrainingTable, temperature: FloatArray) -> list[tuple[str, Fold]]:
    """Parts to leave out: whole runs, halves of each run, either direction of temperature, blocks of time.

    Parameters
    ----------
    table
        Averages, run after run.
    temperature
        Their temperature [degC], shape (n,).
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
            ("runs", runs if len(runs) > 1 else []),
            ("halves", [half for rows in runs for half in np.array_split(rows, 2)]),
            ("directions", [np.flatnonzero(rising), np.flatnonzero(~rising)]),
        )
        for rows in groups
    ]
    if len(table) >= BLOCKS * LEAST_ROWS:
        parts += [("blocks", fold) for fold in time_folds(table, BLOCKS, blocks_per_fold=2)]
    return [(kind, fold) for kind, fold in parts if min(len(rows) for rows in fold) >= LEAST_ROWS]


def left_out(
    members: Sequence[Member], union: Features, table: TrainingTable, parts: Sequence[tuple[str, Fold]]
) -> list[LeftOut]:
    """What members predict of each part, fitted to the rest and limited to its box.

    Parameters
    ----------
    members
        The members.
    union
        Features that hold all atoms of the members.
    table
        Averages of the union's atoms.
    parts
        As `left_out_parts` gives.
    """
    found = []
    for kind, (fitted, held) in parts:
        rest, part = table.take(fitted), table.take(held)
        mean = float(rest.y.mean())
        predicted, excess = [], np.zeros(len(part))
        for member in members:
            places = [union.atoms.index(atom) for atom in member.features.atoms]
            own, of_rest, of_part = _bounded(member.features, rest.X[:, places], part.X[:, places])
            learn_box(own, [of_rest])
            linear = goes_on_linearly(getattr(member, "regressor", None)) or isinstance(member, SharedMember)
            limited, outside = own.limit(of_part, np.ones(len(part), dtype=np.bool_), linear=linear)
            excess = np.maximum(excess, distance_outside(of_part, outside, own))
            columns = replace(rest, X=own.compose(of_rest))
            predicted.append(member.on(own, columns, own.compose(limited)) - mean)
        found.append(LeftOut(kind, np.column_stack(predicted), part.y - mean, excess))
    return found


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
        beyond = Beyond(low, high)
        for values_of in (rest, part):
            values_of[:, i] = beyond.push(values_of[:, values], values_of[:, values])[0]
    terms = [Term(tuple((moved.get(a, a), power) for a, power in t.factors)) for t in features.terms]
    return Features.from_terms(terms) if moved else parse_features(features.text), rest, part


def weights_of(parts: Sequence[LeftOut], members: int, both_ways: bool) -> FloatArray:
    """Weights of members that left-out parts confirm, shape (m,); equal shares where there are none.

    Parameters
    ----------
    parts
        What members predict of each part.
    members
        Their number m.
    both_ways
        Whether temperature moves both ways in training.
    """
    equal = np.full(members, 1.0 / members)
    asked = [part for part in parts if part.kind in ("runs", "blocks" if both_ways else "halves")]
    kinds = [part.kind for part in asked]
    square, product = DRAWN_TOGETHER * (np.eye(members) - 1.0 / members), np.zeros(members)
    for part in asked:
        least = float(np.mean((part.told[:, None] - part.predicted) ** 2, axis=0).min())
        if least > 0.0:
            share = 1.0 / (len(part.told) * least * kinds.count(part.kind) * len(set(kinds)))
            square = square + share * part.predicted.T @ part.predicted
            product = product + share * part.predicted.T @ part.told
    size = max(float(np.trace(square)), 1e-300)
    found = minimize(
        lambda w: ((0.5 * w @ square @ w - product @ w) / size, (square @ w - product) / size),
        equal,
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * members,
        constraints=[{"type": "eq", "fun": lambda w: w.sum() - 1.0, "jac": lambda w: np.ones(members)}],
    )
    weights = np.clip(np.asarray(found.x), 0.0, 1.0)
    weights = np.where(weights < LEAST_WEIGHT, 0.0, weights)
    weights /= weights.sum()
    return weights * skill_of([part for part in asked if part.kind == "runs"] or asked, weights)


def skill_of(parts: Sequence[LeftOut], weights: FloatArray) -> float:
    r"""Share of the weighed sum that left-out parts confirm, 0 to 1; all of it where there are none.

    With predictions p and outputs z of each part, both less the mean of the rows fitted to, it is
    :math:`\sum \overline{p z} / \sum \overline{p^2}`: the least-squares factor, each part counting alike.
    """
    sums = [(part.predicted @ weights, part.told) for part in parts]
    product = sum(float(np.mean(predicted * told)) for predicted, told in sums)
    square = sum(float(np.mean(predicted * predicted)) for predicted, _ in sums)
    if not square > 0.0:
        return 1.0
    skill = float(np.clip(product / square, 0.0, 1.0))
    return skill if skill >= LEAST_WEIGHT else 0.0


def intervals_of(
    parts: Sequence[LeftOut], weights: FloatArray, table: TrainingTable, both_ways: bool
) -> Intervals:
    """Half-widths from what is left on the parts left out: of each kind of part, the widest.

    Of one run they are widened for the shift to the next, `UNSEEN_SHIFT`.

    Errors are taken relative to how the half-width grows outside the box, so that the half-width inside it is
    told by parts that had to be told from elsewhere too.

    Parameters
    ----------
    parts, weights
        What members predict of each part, and their weights, shape (m,).
    table
        The averages.
    both_ways
        Whether temperature moves both ways in training; else nothing can be verified of the way back, and
        the interval is at least as wide as the drift that the runs hold.
    """
    kinds = dict.fromkeys(part.kind for part in parts)
    half = np.max([np.zeros(len(LEVELS)), *(_quantiles(parts, weights, kind) for kind in kinds)], axis=0)
    if not both_ways or not parts:
        drift = float(table.y.std())
        half = np.maximum(half, [drift * NormalDist().inv_cdf(0.5 + level / 2.0) for level in LEVELS])
    if "runs" not in kinds:
        half = UNSEEN_SHIFT * half
    told = f"{' and '.join(kinds)} left out" if kinds else "none"
    averaging_s, half_widths = float(table.averaging_s), tuple(half.tolist())
    return Intervals(averaging_s, half_widths, len(table), told, LEVELS, WIDENING_PER_SPAN)


def _quantiles(parts: Sequence[LeftOut], weights: FloatArray, kind: str) -> FloatArray:
    """Quantiles at `LEVELS` of what is left on the parts of a kind [deg/h], each part counting alike."""
    lefts = [
        np.abs(part.told - part.predicted @ weights) / (1.0 + WIDENING_PER_SPAN * part.excess)
        for part in parts
        if part.kind == kind
    ]
    sizes = np.concatenate(lefts)
    shares = np.concatenate([np.full(len(left), 1.0 / (len(left) * len(lefts))) for left in lefts])
    order = np.argsort(sizes)
    places = np.searchsorted(np.cumsum(shares[order]), np.array(LEVELS) - 1e-9)
    return np.asarray(sizes[order][np.minimum(places, len(sizes) - 1)])


def combined(
    members: Sequence[tuple[Features, LinearRegressor]], weights: FloatArray, mean: float
) -> tuple[Features, LinearRegressor]:
    """The members' weighed sum about a mean [deg/h] as one linear regressor of all their features."""
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
        covariance[np.ix_(rows, rows)] += weight**2 * regressor.covariance_
        noise = max(noise, regressor.residual_std_)
    return union, linear_regressor(coef, intercept, covariance, noise)
