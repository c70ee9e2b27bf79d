"""How common a cause is on a line, and which units differ: from each unit's evidence.

Units are exchangeable. Each has a cause with the probability pi, the share of the line, whose prior is
Jeffreys'; the data of a unit are likelier by the Bayes factor B with the cause than without, so that those of
all have the likelihood prod (pi B + 1 - pi). Probabilities that a diagnosis states of one unit alone rest on
how rare causes are among all gyros: on a line where most have one, the same data say more. A unit stands
apart where its size does not fit what the others foretell (`fogml.signals.distributions`); of all units told
so no more than the stated share is wrong in the mean (Y. Benjamini & Y. Hochberg, J. R. Stat. Soc. B 57,
1995).

How far units' constants are spread about their fleet's, each unit seen through noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.intervals import TAILS
from fogml.signals.distributions import student_ppf, student_sf
from fogml.signals.restricted import random_effects

_DEVIATIONS = np.geomspace(0.03, 10.0, 60)
# Deviations that are weighed, in units of the one found and of the noise it was seen through together.


def least_squares(seen: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Own constants of each unit, told apart by a little ridge, and their standard errors, (u, k + 1)."""
    width = len(seen[0][1])
    inverses = [
        np.linalg.inv(information + 1e-9 * np.trace(information) / width * np.eye(width))
        for information, _ in seen
    ]
    own = np.array([inverse @ image for inverse, (_, image) in zip(inverses, seen, strict=True)])
    return own, np.sqrt([np.diag(inverse) for inverse in inverses])


def each_unit(
    seen: Sequence[tuple[FloatArray, FloatArray]], centres: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Posterior mean and covariance of every unit, and its expected squared distance from its centre."""
    inverse = np.linalg.inv(covariance)
    means, spreads, distances = [], [], []
    for (information, image), mean in zip(seen, centres, strict=True):
        spread = np.linalg.inv(information + inverse)
        own = spread @ (image + inverse @ mean)
        means.append(own)
        spreads.append(spread)
        distances.append(float((own - mean) @ inverse @ (own - mean) + np.trace(inverse @ spread)))
    return np.array(means), np.array(spreads), np.array(distances)


def widening(
    seen: Sequence[tuple[FloatArray, FloatArray]],
    centres: FloatArray,
    covariance: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Factors by which deviations between units are larger in the mean than where they are likeliest.

    Few units tell a deviation badly, and one hidden by the noise of runs comes out as next to none in some
    fleets. So each constant's is averaged over, all deviations beforehand alike (A. Gelman, Bayesian Anal. 1
    (2006) 515), the rest of the covariance held.

    Parameters
    ----------
    seen
        Information and image of the rows of each of u units.
    centres
        What the fleet expects of each, shape (u, k + 1).
    covariance
        Of units about their centres, as found, shape (k + 1, k + 1).
    weights
        Of the units; the covariance of one that lies far out is so much larger, shape (u,).

    Returns
    -------
    ndarray
        Roots of the mean squares over those found, shape (k + 1,).
    """
    information = np.array([one for one, _ in seen])
    apart = np.array([image - one @ mean for (one, image), mean in zip(seen, centres, strict=True)])
    found = np.sqrt(np.diag(covariance))
    _, errors = least_squares(seen)
    factors = np.ones(len(found))
    for place, deviation in enumerate(found.tolist()):
        sizes = _DEVIATIONS * np.hypot(deviation, np.median(errors[:, place]))
        likelihood = np.empty(len(sizes))
        for at, size in enumerate(sizes.tolist()):
            scale = np.ones(len(found))
            scale[place] = size / deviation
            inverse = np.linalg.inv(covariance * np.outer(scale, scale))
            whole = information + weights[:, None, None] * inverse
            root = np.linalg.cholesky(whole)
            along = np.linalg.solve(root, apart[..., None])
            levels = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum()
            level = -len(seen) * float(np.linalg.slogdet(inverse)[1])
            likelihood[at] = 0.5 * (float(np.sum(along**2)) - levels - level)
        belief = np.exp(likelihood - likelihood.max()) * sizes
        factors[place] = np.sqrt(belief @ sizes**2 / belief.sum()) / deviation
    return factors


_STEPS = 4000
_SHARES: FloatArray = np.sin(0.5 * np.pi * (np.arange(_STEPS) + 0.5) / _STEPS) ** 2
"""Shares that are equally likely by Jeffreys' prior, told to a thousandth."""


@dataclass(frozen=True)
class Prevalence:
    """Share of the line's units that have a cause: mean, 90 % interval, probability of over one half."""

    mean: float
    ci90: tuple[float, float]
    over_half: float


def bayes_factor(probability: float, prior: float) -> float:
    """How much likelier a unit's data are with a cause, from its probability after them and before."""
    return probability * (1.0 - prior) / max((1.0 - probability) * prior, 1e-300)


def prevalence(factors: ArrayLike) -> Prevalence:
    """Share of a line's units that have a cause, from the Bayes factor of each of n units."""
    logs = _log_likelihood(factors)
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    # Within a step of the grid the distribution is even.
    below = np.cumsum(weights)
    low, high = np.interp((0.05, 0.95), below, _SHARES)
    return Prevalence(
        float(weights @ _SHARES), (float(low), float(high)), float(weights[_SHARES > 0.5].sum())
    )


def probability_of_difference(groups: Sequence[ArrayLike]) -> float:
    """Probability that groups of units have a cause at shares of their own rather than at one.

    Even odds before; marginal likelihoods of the groups' Bayes factors with Jeffreys' prior.
    """
    apart = sum(_log_evidence(group) for group in groups)
    together = _log_evidence(np.concatenate([np.asarray(group) for group in groups]))
    return float(1.0 / (1.0 + np.exp(np.clip(together - apart, -700.0, 700.0))))


def share_interval(parts: ArrayLike, wholes: ArrayLike) -> tuple[float, float]:
    """90 % interval of the share that parts make of wholes on a line, from those of n units.

    By Student's t about the logit, its error by leaving each unit out in turn (a jackknife: R. G. Miller,
    Biometrika 61 (1974) 1): few units whose wholes differ tell less than resampling them shows. Its lower end
    is 0 where without one unit nothing is left of the parts; one unit tells nothing.
    """
    part, whole = np.asarray(parts, dtype=np.float64), np.asarray(wholes, dtype=np.float64)
    count, total = len(part), float(whole.sum())
    share = float(part.sum()) / total if total > 0.0 else 0.0
    without = whole.sum() - whole
    if count < 2 or np.any(without <= 0.0):
        return 0.0, 1.0
    if not 0.0 < share < 1.0:
        return share, share
    others = (part.sum() - part) / without
    error = float(np.sqrt((count - 1.0) / count * np.sum((others - others.mean()) ** 2)))
    reach = float(student_ppf(TAILS[1], count - 1)) * error / (share * (1.0 - share))
    middle = np.log(share / (1.0 - share))
    low, high = 1.0 / (1.0 + np.exp(-(middle + np.clip([-reach, reach], -700.0, 700.0))))
    return float(low) if others.min() > 0.0 else 0.0, float(high)


def _log_likelihood(factors: ArrayLike) -> FloatArray:
    b = np.asarray(factors, dtype=np.float64)[:, None]
    return np.asarray(np.log(_SHARES * b + (1.0 - _SHARES)).sum(axis=0))


def _log_evidence(factors: ArrayLike) -> float:
    """Log likelihood of the factors, the share of the line unknown."""
    logs = _log_likelihood(factors)
    return float(logs.max() + np.log(np.mean(np.exp(logs - logs.max()))))


def apart(values: ArrayLike, errors: ArrayLike) -> FloatArray:
    """Two-sided p-value of each of n sizes against what the others foretell, shape (n,); 1 of under four."""
    x, se = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    told = np.ones(len(x))
    if len(x) < 4:
        return told
    for place in range(len(x)):
        others = np.arange(len(x)) != place
        line = random_effects(x[others], se[others])
        spread = np.sqrt(line.between**2 + se[place] ** 2 + line.se**2)
        if spread > 0.0:
            told[place] = 2.0 * student_sf(abs(x[place] - line.mean) / spread, len(x) - 2)
    return told


def discoveries(p_values: ArrayLike, false_share: float) -> FloatArray:
    """Which of n p-values are told, shape (n,) of 0 and 1, that at most such a share of them is false."""
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p)
    passed = np.flatnonzero(p[order] <= false_share * (np.arange(len(p)) + 1) / max(len(p), 1))
    told = np.zeros(len(p))
    if len(passed):
        told[order[: passed[-1] + 1]] = 1.0
    return told
