r"""A linear mixed-effects model of drift: a part that all runs share, and a part that is each run's own.

The averaged drift y of run r at time t is

.. math:: y = \beta_0 + \sum_g X_g c_g + o_r + d_r(t) + f_r(t) + \varepsilon,\qquad
          c_g \sim N(0, s_g^2),

with columns :math:`X_g` of groups g of features, the run's own shift :math:`o_r`, its slow drift
:math:`d_r` (Gaussian covariance over a third of a run) and faster drift :math:`f_r` (exponential, a
twentieth), and white noise. Only :math:`\beta_0 + \sum X_g c_g` compensates: what is a run's own can't be
known beforehand, so it takes weight from the shared part and widens the interval, and is never
subtracted. Sizes are the maximum of the evidence times log-normal priors (empirical Bayes: Rasmussen &
Williams, Gaussian Processes for Machine Learning, 2006, ch. 5; mixed effects: Laird & Ware, Biometrics 38,
1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky
from scipy.optimize import minimize

from fogml.features.terms import Term
from fogml.models.intervals import LEVELS, Intervals
from fogml.models.linear import LinearRegressor
from fogml.models.mixed_effects_basis import ScaledColumns, SizePriors, basis_of
from fogml.models.table import TrainingTable
from fogml.runs.run import BoolArray, FloatArray

_SMALLEST, _LARGEST, _LEAST_NOISE = 1e-4, 30.0, 2e-3
# Bounds of sizes, for a well-conditioned covariance.
_STEPS = 40


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
    own_std, shared_std
        Standard deviation of a new run's own part with noise, and of the shared part over the training rows
        [deg/h].
    noise_std
        White noise of the averages [deg/h].
    """

    coef: FloatArray
    intercept: float
    covariance: FloatArray
    sizes: dict[str, float]
    own_std: float
    shared_std: float
    noise_std: float

    def shrunk(self, mean: float, skill: float) -> LinearRegressor:
        """The shared part about a mean [deg/h], taken by a share `skill` of it."""
        regressor = LinearRegressor()
        regressor.coef_ = skill * self.coef
        regressor.intercept_ = mean + skill * (self.intercept - mean)
        regressor.n_features_in_, regressor.ridge_, regressor.rank_ = len(self.coef), 0.0, len(self.coef)
        regressor.residual_std_ = self.noise_std
        regressor.covariance_ = skill**2 * self.covariance
        return regressor

    def intervals(self, skill: float, left_std: float, averaging_s: float, count: int) -> Intervals:
        """Half-widths for averages of another run: the own part, the shared part's error, and noise.

        Parameters
        ----------
        skill
            Share of the shared part that is taken.
        left_std
            Rms of what is left on runs left out [deg/h], which the half-width does not fall below.
        averaging_s
            Of the averages [s].
        count
            Number of averages.
        """
        total = np.sqrt(max(self.own_std**2 + (skill * self.shared_std) ** 2, left_std**2))
        half = tuple(float(total * NormalDist().inv_cdf(0.5 + level / 2.0)) for level in LEVELS)
        return Intervals(float(averaging_s), half, count, "between runs")


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
    found = _Posterior.of(table, basis_of(table.X, terms, priors), priors)
    coef, intercept = found.in_features()
    return MixedEffects(
        coef,
        intercept,
        found.covariance_in_features(),
        found.named_sizes(terms),
        found.own_std,
        found.shared_std,
        float(found.spread * found.noise),
    )


def skill_of(pairs: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    r"""Share of the shared part that left-out runs confirm, and the rms that is left on them [deg/h].

    With predictions p and outputs z of each left-out run, both less the mean of the other runs, the share is
    :math:`\sum \overline{p z} / \sum \overline{p^2}` within 0 and 1: the least-squares factor, each run
    counting alike. No pairs leave the part as it is.

    Parameters
    ----------
    pairs
        p and z [deg/h] of each left-out run, shapes (n,).
    """
    if not pairs:
        return 1.0, 0.0
    product = sum(float(np.mean(predicted * told)) for predicted, told in pairs)
    square = sum(float(np.mean(predicted * predicted)) for predicted, _ in pairs)
    skill = float(np.clip(product / square, 0.0, 1.0)) if square > 0.0 else 0.0
    left = np.concatenate([told - skill * predicted for predicted, told in pairs])
    return skill, float(np.sqrt(np.mean(left**2)))


@dataclass(frozen=True, eq=False)
class _Posterior:
    """The posterior of the shared part, in units of the outputs' spread."""

    basis: ScaledColumns
    mean: float
    spread: float
    weights: FloatArray
    covariance: FloatArray
    sizes: FloatArray
    own: FloatArray
    noise: float
    columns: FloatArray

    @classmethod
    def of(cls, table: TrainingTable, basis: ScaledColumns, priors: SizePriors) -> _Posterior:
        mean, spread = float(table.y.mean()), float(table.y.std()) or 1.0
        z = (table.y - mean) / spread
        columns = (table.X - basis.shift) @ basis.mix
        members = [columns[:, basis.groups == g] for g in range(len(basis.medians))]
        kernels = [part @ part.T for part in members] + _own_kernels(table) + [np.eye(len(z))]
        medians = np.concatenate([basis.medians, [priors.shift, priors.slow, priors.fast, priors.noise]])
        sizes = _evidence_maximum(np.array(kernels), z, medians, priors)
        total = np.full((len(z), len(z)), priors.offset**2) + np.tensordot(sizes**2, np.array(kernels), 1)
        factor = cho_factor(total, lower=True)
        design = np.column_stack([np.ones(len(z)), columns])
        prior = np.concatenate([[priors.offset], sizes[basis.groups]]) ** 2
        weights = prior * (design.T @ cho_solve(factor, z))
        scaled = design * prior
        covariance = np.diag(prior) - scaled.T @ cho_solve(factor, scaled)
        g = len(basis.medians)
        return cls(basis, mean, spread, weights, covariance, sizes[:g], sizes[g:-1], float(sizes[-1]), design)

    def in_features(self) -> tuple[FloatArray, float]:
        """Coefficients per unit of the features, and the intercept [deg/h]."""
        coef = self.spread * (self.basis.mix @ self.weights[1:])
        return coef, float(self.mean + self.spread * self.weights[0] - self.basis.shift @ coef)

    def covariance_in_features(self) -> FloatArray:
        """Covariance of intercept and coefficients, shape (k + 1, k + 1)."""
        back = np.zeros((len(self.weights), len(self.weights)))
        back[1:, 1:] = self.basis.mix
        back[0, 0] = 1.0
        back[0, 1:] = -self.basis.shift @ self.basis.mix
        return np.asarray(self.spread**2 * back @ self.covariance @ back.T)

    @property
    def own_std(self) -> float:
        """Standard deviation of a new run's own part and of the noise of an average [deg/h]."""
        return float(self.spread * np.sqrt(np.sum(self.own**2) + self.noise**2))

    @property
    def shared_std(self) -> float:
        """Root mean square of the shared part's standard deviation over the training rows [deg/h]."""
        variance = np.einsum("ij,jk,ik->i", self.columns, self.covariance, self.columns)
        return float(self.spread * np.sqrt(np.mean(variance)))

    def named_sizes(self, terms: Sequence[Term]) -> dict[str, float]:
        """Sizes [deg/h] by the first term of each group, and of a run's own parts."""
        names = [terms[int(np.argmax(self.basis.groups == g))].text for g in range(len(self.sizes))]
        own = dict(zip(("own shift", "own slow drift", "own faster drift"), self.own.tolist()))
        found = {**dict(zip(names, self.sizes.tolist())), **own, "noise": self.noise}
        return {name: float(self.spread * size) for name, size in found.items()}


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
    spreads[-1] = priors.noise_spread
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
