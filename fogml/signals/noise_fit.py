"""Noise coefficients and their uncertainty from static runs or soaks.

Restricted likelihood: the constants of given columns are integrated out. A long series is split
into averages, whose likelihood is exact, and the differences inside them, level by level (Haar's
wavelets, in which flicker and white noise are nearly independent: G. W. Wornell and A. V. Oppenheim,
IEEE Trans. SP-40 (1992) 611), so that an evaluation takes the same time at any length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.distributions import chi2_ppf, normal_ppf, root_of
from fogml.signals.noise_fit_data import FitData, Level, Part, fit_data
from fogml.signals.noise_model import NoiseModel
from fogml.signals.noise_terms import FLICKER_FLOOR
from fogml.signals.whitening import Whitener

NAMES = ("N", "B", "K")
"""The fitted coefficients, in the order of `NoiseFit.covariance`."""
_WIDE = 10.0
_STEP = 0.05
"""Step of the second differences, in the logarithm."""
_ROUNDS, _POINTS = 2, 64
"""Rounds of importance sampling, each about the moments of the one before, and points of each."""
_FEWEST = 12.0
"""Points that have to matter for their moments to be taken."""
_ENOUGH = 40.0
"""Where so many matter, the guess was like the posterior, and another round would bring nothing."""
_TAILS, _WIDER = 5.0, 1.3
"""Degrees of freedom of its Student's t, and its width over the guess."""


@dataclass(frozen=True)
class NoisePrior:
    """Log-normal priors of N, B and K.

    Attributes
    ----------
    centre
        Medians. One that is zero holds its coefficient at zero; Q is held at the centre's.
    factor
        One standard deviation is a factor of this, above 1; one number or one each.
    """

    centre: NoiseModel
    factor: float | tuple[float, float, float] = 3.0

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the logarithms, shape (3,)."""
        return np.log(np.broadcast_to(np.asarray(self.factor, dtype=np.float64), (3,)))

    def __post_init__(self) -> None:
        if not np.all(self.deviations > 0.0):
            raise InputError(f"noise prior: a factor above 1 was expected, not {self.factor}")


@dataclass(frozen=True)
class NoiseFit:
    """Fitted noise.

    Attributes
    ----------
    model
        Posterior means of the logarithms.
    covariance
        Posterior covariance of log N, log B and log K, shape (3, 3); zero for one that is held.
    prior
        What was assumed.
    """

    model: NoiseModel
    covariance: FloatArray
    prior: NoisePrior

    @property
    def standard_errors(self) -> FloatArray:
        """Of log N, log B and log K, shape (3,)."""
        return np.sqrt(np.diag(self.covariance))

    def draw(self, rng: np.random.Generator, count: int) -> list[NoiseModel]:
        """Models from the posterior, normal in the logarithms."""
        factors = np.exp(rng.standard_normal((count, 3)) @ root_of(self.covariance).T)
        return [_scaled(self.model, row) for row in factors]


def fit_noise(
    time: Sequence[ArrayLike],
    series: Sequence[ArrayLike],
    columns: Sequence[ArrayLike] | None = None,
    *,
    prior: NoisePrior | None = None,
    averaging_s: float | None = None,
    most: int = 4096,
) -> NoiseFit:
    """Fit N, B and K to one or several series.

    Each series has a free constant of its own; so stretches of one run, its soaks for instance,
    go as series each.

    Parameters
    ----------
    time, series
        Sample times [s] and values [deg/h] of each series, shape (n,) each.
    columns
        Regressors of each series, shape (n, p), whose constants all series share.
    prior
        None: wide log-normal priors, a factor of 10 about what the Allan variance shows at a glance.
    averaging_s
        What samples are means over [s]; the median step of the first series if None.
    most
        Longest series whose likelihood is exact; longer ones are averaged to at most as many.

    Raises
    ------
    InputError
        If shapes do not agree, values are not finite, or no series has 16 samples.

    Notes
    -----
    Inside averages the columns are regressed on level by level. Spikes and steps count as noise:
    leave them out before. Where the data show no B or K, the prior decides on its size, and its
    standard error says so.
    """
    from scipy.optimize import minimize

    data = fit_data(time, series, columns, averaging_s, most)
    prior = _glance(data) if prior is None else prior
    centre = np.array([getattr(prior.centre, name) for name in NAMES])
    free = np.flatnonzero(centre > 0.0)
    spread = prior.deviations[free]
    data = _orthonormal(data, prior.centre)

    def objective(units: FloatArray) -> float:
        """Negative log posterior at so many prior standard deviations from the centre."""
        factors = np.ones(3)
        factors[free] = np.exp(np.clip(units * spread, -30.0, 30.0))
        return 0.5 * float(units @ units) - _log_likelihood(data, _scaled(prior.centre, factors))

    found = minimize(objective, np.zeros(len(free)), method="BFGS", options={"gtol": 1e-3})
    curvature = _curvature(objective, found.x, _STEP / spread)
    # Curvature below the prior's, of a likelihood that bends the other way, is no knowledge.
    values, vectors = np.linalg.eigh(curvature)
    mean, inverse = found.x, (vectors / np.maximum(values, 1.0)) @ vectors.T
    for _ in range(_ROUNDS):
        mean, inverse, matter = _moments(objective, mean, inverse, float(found.fun))
        if matter >= _ENOUGH:
            break
    covariance = np.zeros((3, 3))
    covariance[np.ix_(free, free)] = inverse * np.outer(spread, spread)
    factors = np.ones(3)
    factors[free] = np.exp(mean * spread)
    return NoiseFit(_scaled(prior.centre, factors), covariance, prior)


def _scaled(model: NoiseModel, factors: FloatArray) -> NoiseModel:
    n, b, k = (float(v) for v in factors)
    return replace(model, N=model.N * n, B=model.B * b, K=model.K * k)


def _log_likelihood(data: FitData, model: NoiseModel) -> float:
    """Restricted log-likelihood up to a constant."""
    from scipy.linalg import solve_triangular

    total = _levels_log_likelihood(data.levels, model)
    width = data.parts[0].table.shape[1]
    gram = np.zeros((width, width))
    for part in data.parts:
        whitener, white = _whitened(part, model)
        gram += white.T @ white
        total -= whitener.log_det
    root = np.linalg.cholesky(gram[:-1, :-1])
    along = solve_triangular(root, gram[:-1, -1], lower=True)
    square = max(float(gram[-1, -1] - along @ along), 0.0)
    return total - 0.5 * square - float(np.sum(np.log(np.diag(root)))) - data.log_det


def _whitened(part: Part, model: NoiseModel) -> tuple[Whitener, FloatArray]:
    whitener = part.whitener.with_noise(model)
    return whitener, whitener.whiten(part.table)


def _orthonormal(data: FitData, model: NoiseModel) -> FitData:
    """The same with columns that are orthonormal, and values beside them, when whitened by a model.

    By other models they are nearly so: then inner products tell as much as the columns themselves.
    """
    from scipy.linalg import solve_triangular

    whitened = [_whitened(part, model)[1] for part in data.parts]
    root = np.array(np.linalg.qr(np.vstack(whitened), mode="r"))
    # Values keep their size, also where the columns hold all of them.
    last = float(root[-1, -1]) or 1.0
    root[-1, -1] = last
    change = solve_triangular(root, np.diag([*np.ones(len(root) - 1), last]))
    parts = tuple(replace(part, table=part.table @ change) for part in data.parts)
    log_det = float(np.sum(np.log(np.abs(np.diag(root)[:-1]))))
    return replace(data, parts=parts, log_det=log_det)


def _levels_log_likelihood(levels: Sequence[Level], model: NoiseModel) -> float:
    total = 0.0
    for level in levels:
        variance = float(model.allan_variance(level.averaging_s))
        total -= 0.5 * (level.freedom * math.log(variance) + level.squares / variance)
    return total


def _moments(
    objective: Callable[[FloatArray], float], mean: FloatArray, covariance: FloatArray, least: float
) -> tuple[FloatArray, FloatArray, float]:
    """Mean and covariance of the posterior by importance sampling about a guess; how many points matter.

    Where the data bound a coefficient from above alone, the posterior leans, and curvature at its
    top says too little. The points are those of a Sobol sequence, always the same, for
    Student's t with five degrees of freedom, wider than the guess.
    """
    from scipy.stats import qmc

    k = len(mean)
    uniform = qmc.Sobol(k + 1, scramble=False).random(2 * _POINTS)[_POINTS:]
    normal = normal_ppf(uniform[:, :k] + 0.25 / _POINTS)
    t = normal * np.sqrt(_TAILS / chi2_ppf(uniform[:, k] + 0.25 / _POINTS, _TAILS))[:, None]
    points = mean + _WIDER * t @ np.linalg.cholesky(covariance).T
    proposal = -0.5 * (_TAILS + k) * np.log1p(np.sum(t**2, axis=1) / _TAILS)
    weight = np.array([least - objective(point) for point in points]) - proposal
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    matter = float(1.0 / np.sum(weight**2))
    if matter < _FEWEST:
        # The guess is the better one.
        return mean, covariance, matter
    centre = weight @ points
    return centre, (weight[:, None] * (points - centre)).T @ (points - centre), matter


def _curvature(function: Callable[[FloatArray], float], at: FloatArray, steps: FloatArray) -> FloatArray:
    """Second derivatives by central differences, shape (k, k)."""
    k = len(at)
    offsets = np.diag(steps)
    middle = function(at)
    matrix = np.empty((k, k))
    for i in range(k):
        up, down = function(at + offsets[i]), function(at - offsets[i])
        matrix[i, i] = (up - 2.0 * middle + down) / steps[i] ** 2
        for j in range(i):
            mixed = (
                function(at + offsets[i] + offsets[j])
                - function(at + offsets[i] - offsets[j])
                - function(at - offsets[i] + offsets[j])
                + function(at - offsets[i] - offsets[j])
            )
            matrix[i, j] = matrix[j, i] = mixed / (4.0 * steps[i] * steps[j])
    return matrix


def _glance(data: FitData) -> NoisePrior:
    """Wide priors about the shortest, the least and the longest of the Allan variances."""
    seen = [level for level in data.glance if level.squares > 0.0]
    if not seen:
        raise InputError("noise fit: the series are constant, there is no noise to fit")
    tau = np.array([level.averaging_s for level in seen])
    variance = np.array([level.squares / level.freedom for level in seen])
    white = math.sqrt(variance[0] * tau[0]) / 60.0
    flicker = math.sqrt(variance.min()) / FLICKER_FLOOR
    walk = 60.0 * math.sqrt(3.0 * variance[-1] / tau[-1])
    return NoisePrior(NoiseModel(white, 0.5 * flicker, 0.5 * walk), _WIDE)
