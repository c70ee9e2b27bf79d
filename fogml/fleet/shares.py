"""How common a cause is on a line, and which units differ: from each unit's posterior.

Units are exchangeable. How many of n have a cause is a sum of independent events with the units' own
probabilities (Poisson-binomial); the share of the line is then Beta distributed for each count, with
Jeffreys' prior. A unit stands apart where its size does not fit what the others foretell
(`fogml.signals.random_effects`); of all units told so no more than the stated share is wrong in the mean (Y.
Benjamini & Y. Hochberg, J. R. Stat. Soc. B 57, 1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import betaln
from scipy.stats import beta
from scipy.stats import t as student

from fogml.runs.run import FloatArray
from fogml.signals.random_effects import random_effects

JEFFREYS = 0.5


@dataclass(frozen=True)
class Prevalence:
    """Share of the line's units that have a cause: mean, 90 % interval, probability of over one half."""

    mean: float
    ci90: tuple[float, float]
    over_half: float


def count_distribution(probabilities: ArrayLike) -> FloatArray:
    """Probability that k of n units have a cause, shape (n + 1,), from that of each."""
    counts = np.ones(1)
    for p in np.asarray(probabilities, dtype=np.float64):
        counts = np.convolve(counts, (1.0 - p, p))
    return counts


def prevalence(probabilities: ArrayLike) -> Prevalence:
    """Share of a line's units that have a cause, from the probability of each of n units."""
    counts = count_distribution(probabilities)
    n = len(counts) - 1
    k = np.arange(n + 1)
    a, b = k + JEFFREYS, n - k + JEFFREYS

    def below(share: float) -> float:
        return float(counts @ beta.cdf(share, a, b))

    low, high = (float(brentq(lambda x, q=q: below(x) - q, 0.0, 1.0)) for q in (0.05, 0.95))
    return Prevalence(float(counts @ (a / (a + b))), (low, high), 1.0 - below(0.5))


def probability_of_difference(groups: Sequence[ArrayLike]) -> float:
    """Probability that groups of units have a cause at shares of their own rather than at one.

    Even odds before; marginal likelihoods of the counts with Jeffreys' prior, averaged over the counts.
    """
    apart = sum(_log_evidence(count_distribution(group)) for group in groups)
    together = _log_evidence(count_distribution(np.concatenate([np.asarray(group) for group in groups])))
    return float(1.0 / (1.0 + np.exp(np.clip(together - apart, -700.0, 700.0))))


def _log_evidence(counts: FloatArray) -> float:
    """Log probability of which units have a cause, the share of the line unknown, counts being uncertain."""
    n = len(counts) - 1
    k = np.arange(n + 1)
    each = betaln(k + JEFFREYS, n - k + JEFFREYS) - betaln(JEFFREYS, JEFFREYS)
    held = counts > 0.0
    return float(np.logaddexp.reduce(np.log(counts[held]) + each[held]))


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
            told[place] = 2.0 * student.sf(abs(x[place] - line.mean) / spread, len(x) - 2)
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
