r"""A linear mixed-effects model of drift: a part that all runs share, and a part that is each run's own.

The averaged drift y of run r at time t is

.. math:: y = \beta_0 + \sum_g X_g c_g + o_r + d_r(t) + f_r(t) + \varepsilon,\qquad
          c_g \sim N(0, s_g^2),

with columns :math:`X_g` of groups g of features, the run's own shift :math:`o_r`, its slow drift
:math:`d_r` (Gaussian covariance over a third of a run) and faster drift :math:`f_r` (exponential, a
twentieth), and white noise. Only :math:`\beta_0 + \sum X_g c_g` compensates: what is a run's own can't be
known beforehand, so it takes weight from the shared part, and is never subtracted. Sizes are the maximum of
the evidence times log-normal priors (empirical Bayes: Rasmussen & Williams, Gaussian Processes for Machine
Learning, 2006, ch. 5; mixed effects: Laird & Ware, Biometrics 38, 1982). Below, priors of these sizes, and
columns whose sizes mean what the priors say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky
from scipy.optimize import minimize

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.features.atoms import MEMORIES
from fogml.features.terms import Term
from fogml.models.linear import LinearRegressor
from fogml.models.size_priors import SizePriors
from fogml.models.table import TrainingTable


class ScaledColumns(NamedTuple):
    """Columns that are centred, scaled and pulled apart, and how they come from features.

    Attributes
    ----------
    shift
        Means of the features, shape (k,).
    mix
        Columns are ``(features - shift) @ mix``, shape (k, k).
    groups
        Group of each column, shape (k,).
    medians
        Prior median of each group's size, shape (g,).
    """

    shift: FloatArray
    mix: FloatArray
    groups: IndexArray
    medians: FloatArray


def basis_of(X: FloatArray, terms: Sequence[Term], priors: SizePriors) -> ScaledColumns:
    """Columns whose prior sizes mean something: standardised, powers orthogonal, memories as differences.

    A power of a signal is taken orthogonal to the lower ones over the training rows, and its prior falls as
    one over the degree; a lag or a play is taken as its difference from the signal it follows, in products
    too; a product with a signal as that with the signal less its mean. What is linear in a signal goes on
    with what lies beyond its bounds, which training rows can't tell.
    """
    shift, count = X.mean(axis=0), len(terms)
    medians: list[float] = []
    mix, groups = np.eye(count), np.empty(count, dtype=np.intp)
    place = {term.factors: i for i, term in enumerate(terms)}
    group_of: dict[object, int] = {}
    degrees = np.ones(count)

    def group(key: object, median: float) -> int:
        if key not in group_of:
            group_of[key] = len(medians)
            medians.append(median)
        return group_of[key]

    for i, term in enumerate(terms):
        (atom, power), *others = term.factors
        plain = atom.operator == "value" and not others
        if plain and power > 1:
            groups[i] = group(("curved", atom), priors.curved)
            degrees[i] = power
        elif plain and not atom.signal.is_difference:
            groups[i] = group(("linear", atom), priors.linear)
        elif atom.operator == "beyond":
            groups[i] = group(term, priors.other)
            continue
        elif atom.operator == "since_on" and not others:
            groups[i] = group("since_on", priors.other)
        else:
            groups[i] = group(term, priors.other)
        if atom.operator in MEMORIES and not others:
            followed = next((j for j, t in enumerate(terms) if _is_value_of(t, atom.signal)), None)
            if followed is not None and atom.operator != "since_on":
                mix[followed, i] = -1.0
        elif atom.operator == "value" and others and power == 1:
            partner = place.get(tuple(others))
            alone = next((j for j, t in enumerate(terms) if _is_value_of(t, atom.signal)), None)
            if partner is not None and alone is not None:
                mix[partner, i] -= shift[alone]
                other, _ = others[0]
                square = place.get(((atom, 2),))
                if other.operator in MEMORIES and other.signal == atom.signal and square is not None:
                    mix[square, i], mix[alone, i] = -1.0, shift[alone]
    centred = X - shift
    order = sorted(range(count), key=lambda i: degrees[i])
    for i in order:
        atom = terms[i].factors[0][0]
        if degrees[i] > 1:
            lower = [j for j in order if degrees[j] < degrees[i] and _same_signal(terms[j], atom)]
            if lower:
                columns = centred @ mix[:, lower]
                along, *_ = np.linalg.lstsq(columns, centred @ mix[:, i], rcond=None)
                mix[:, i] -= mix[:, lower] @ along
        size = float(np.sqrt(np.mean((centred @ mix[:, i]) ** 2)))
        still = size <= 1e-9 * (1.0 + float(np.abs(shift) @ np.abs(mix[:, i])))
        mix[:, i] *= 0.0 if still else 1.0 / (size * degrees[i])
    for i, term in enumerate(terms):
        atom = term.factors[0][0]
        followed = next((j for j, t in enumerate(terms) if _is_value_of(t, atom.signal)), None)
        if atom.operator == "beyond" and len(term.factors) == 1 and followed is not None:
            mix[i] = 0.0
            mix[i, followed] = mix[followed, followed]
    return ScaledColumns(shift, mix, groups, np.array(medians))


def _is_value_of(term: Term, signal: object) -> bool:
    (atom, power), *others = term.factors
    return not others and power == 1 and atom.operator == "value" and atom.signal == signal


def _same_signal(term: Term, atom: object) -> bool:
    return len(term.factors) == 1 and term.factors[0][0] == atom


_SMALLEST, _LARGEST, _LEAST_NOISE = 1e-4, 30.0, 2e-3
# Bounds of sizes, for a well-conditioned covariance.
_STEPS = 40
OWN_PARTS = ("own shift", "own slow drift", "own faster drift")
"""Names of the sizes of a run's own parts."""


@dataclass(frozen=True, eq=False)
class MixedEffects:
    """The shared part as the data tell it, and what a run's own part may add.

    Attributes
    ----------
    coef, intercept
        Coefficients [deg/h per unit of the features], shape (k,), and intercept [deg/h].
    covariance
        Of intercept and coefficients, shape (k + 1, k + 1).
    sizes
        Size of each group of features and of each own part, by name [deg/h].
    """

    coef: FloatArray
    intercept: float
    covariance: FloatArray
    sizes: dict[str, float]
    _scale: _Scale
    _relative: FloatArray

    def given(self, table: TrainingTable) -> tuple[FloatArray, float, FloatArray]:
        """Coefficients, intercept [deg/h] and their covariance of other rows, with the sizes as found."""
        return _posterior(table, self._scale, self._relative)

    @property
    def own_variance(self) -> float:
        """Variance of what is a run's own, and of the noise [(deg/h)^2]."""
        return sum(self.sizes[name] ** 2 for name in (*OWN_PARTS, "noise"))

    def regressor(self) -> LinearRegressor:
        """The shared part as a linear regressor."""
        return linear_regressor(self.coef, self.intercept, self.covariance, self.sizes["noise"])


def linear_regressor(
    coef: FloatArray, intercept: float, covariance: FloatArray, residual_std: float
) -> LinearRegressor:
    """A fitted linear regressor of coefficients found elsewhere."""
    regressor = LinearRegressor()
    regressor.coef_, regressor.intercept_ = coef, float(intercept)
    regressor.n_features_in_, regressor.ridge_, regressor.rank_ = len(coef), 0.0, len(coef)
    regressor.residual_std_, regressor.covariance_ = residual_std, covariance
    regressor.shrinkage_ = 0.0 * covariance[0]
    return regressor


def fit_mixed_effects(
    table: TrainingTable, terms: Sequence[Term], priors: SizePriors | None = None
) -> MixedEffects:
    """Fit a mixed-effects model to averaged rows.

    Parameters
    ----------
    table
        A few hundred averages with their runs and times; the cost grows with the cube of their number.
    terms
        The k terms that the table's columns are.
    priors
        Priors of the sizes.
    """
    priors = SizePriors() if priors is None else priors
    basis = basis_of(table.X, terms, priors)
    scale = _Scale(basis, priors, float(table.y.std()) or 1.0)
    kernels = scale.kernels(table)
    z = (table.y - table.y.mean()) / scale.spread
    medians = np.concatenate([basis.medians, [priors.shift, priors.slow, priors.fast, priors.noise]])
    relative = _evidence_maximum(kernels, z, medians, priors)
    coef, intercept, covariance = _posterior(table, scale, relative, kernels)
    return MixedEffects(coef, intercept, covariance, scale.named_sizes(relative, terms), scale, relative)


@dataclass(frozen=True, eq=False)
class _Scale:
    """What sizes are relative to: the columns' scale and the spread of the training averages [deg/h]."""

    basis: ScaledColumns
    priors: SizePriors
    spread: float

    def columns(self, table: TrainingTable) -> FloatArray:
        return np.asarray((table.X - self.basis.shift) @ self.basis.mix)

    def kernels(self, table: TrainingTable) -> FloatArray:
        """Covariances of unit size: of each group, of a run's own parts, and of noise; (g, n, n)."""
        columns = self.columns(table)
        members = [columns[:, self.basis.groups == g] for g in range(len(self.basis.medians))]
        own = _own_kernels(table)
        return np.array([part @ part.T for part in members] + own + [np.eye(len(table))])

    def named_sizes(self, relative: FloatArray, terms: Sequence[Term]) -> dict[str, float]:
        """Sizes [deg/h] by the first term of each group, and of a run's own parts."""
        groups = self.basis.groups
        names = [terms[int(np.argmax(groups == g))].text for g in range(len(self.basis.medians))]
        names += [*OWN_PARTS, "noise"]
        return dict(zip(names, (self.spread * relative).tolist(), strict=True))


def _posterior(
    table: TrainingTable, scale: _Scale, relative: FloatArray, kernels: FloatArray | None = None
) -> tuple[FloatArray, float, FloatArray]:
    """Coefficients per unit of the features, intercept and their covariance [deg/h], of sizes stated."""
    kernels = scale.kernels(table) if kernels is None else kernels
    basis, offset, count = scale.basis, scale.priors.offset, len(table)
    mean = float(table.y.mean())
    z = (table.y - mean) / scale.spread
    total = np.full((count, count), offset**2) + np.tensordot(relative**2, kernels, 1)
    factor = cho_factor(total, lower=True)
    design = np.column_stack([np.ones(count), scale.columns(table)])
    prior = np.concatenate([[offset], relative[basis.groups]]) ** 2
    weights = prior * (design.T @ cho_solve(factor, z))
    scaled = design * prior
    covariance = np.diag(prior) - scaled.T @ cho_solve(factor, scaled)
    coef = scale.spread * (basis.mix @ weights[1:])
    back = np.zeros_like(covariance)
    back[1:, 1:], back[0, 0] = basis.mix, 1.0
    back[0, 1:] = -basis.shift @ basis.mix
    intercept = float(mean + scale.spread * weights[0] - basis.shift @ coef)
    return coef, intercept, np.asarray(scale.spread**2 * back @ covariance @ back.T)


def _own_kernels(table: TrainingTable) -> list[FloatArray]:
    """Covariances of unit size of a run's own shift, slow and faster drift, each (n, n)."""
    same: BoolArray = table.run_index[:, None] == table.run_index[None, :]
    spans = [np.ptp(table.time_s[table.run_index == run]) for run in np.unique(table.run_index)]
    span = max(float(np.median(spans)), 1e-9)
    apart = np.abs(table.time_s[:, None] - table.time_s[None, :]) / span
    slow, fast = np.exp(-0.5 * (3.0 * apart) ** 2), np.exp(-20.0 * apart)
    return [np.where(same, 1.0, 0.0), np.where(same, slow, 0.0), np.where(same, fast, 0.0)]


def _evidence_maximum(
    kernels: FloatArray, z: FloatArray, medians: FloatArray, priors: SizePriors
) -> FloatArray:
    """Sizes at the maximum of evidence times prior; kernels of shape (g, n, n), the noise's last."""
    spreads = np.full(len(medians), priors.spread)
    spreads[-1 - len(OWN_PARTS) :] = [*[priors.own_spread] * len(OWN_PARTS), priors.noise_spread]
    level = np.full(kernels.shape[1:], priors.offset**2)
    flat, one = kernels.reshape(len(kernels), -1), np.eye(len(z))
    first = np.log(medians)

    def loss(log_sizes: FloatArray) -> tuple[float, FloatArray]:
        power = np.exp(2.0 * log_sizes)
        triangle = cholesky(level + (power @ flat).reshape(level.shape), lower=True, check_finite=False)
        inverse = cho_solve((triangle, True), one, check_finite=False)
        along = inverse @ z
        off = (log_sizes - first) / spreads
        value = 0.5 * z @ along + np.log(np.diag(triangle)).sum() + 0.5 * off @ off
        slope = power * (flat @ (inverse - np.outer(along, along)).ravel()) + off / spreads
        return float(value), slope

    bounds = [(np.log(_SMALLEST), np.log(_LARGEST))] * (len(medians) - 1)
    bounds.append((np.log(_LEAST_NOISE), np.log(_LARGEST)))
    found = minimize(loss, first, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": _STEPS})
    return np.asarray(np.exp(found.x))
