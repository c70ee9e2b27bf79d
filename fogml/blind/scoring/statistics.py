"""Proportions, medians and means with their intervals; curves of an open set; calibration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import binom

from fogml.arrays import FloatArray
from fogml.signals.distributions import student_ppf

LEVEL = 0.95
"""Coverage of every interval of a score."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its interval at `LEVEL` and the number of things that it rests on.

    ``value`` is None where there is nothing to rest on, the ends are where so few things tell none.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int


NOTHING = Estimate(None, None, None, 0)


def wilson(hits: int, n: int, level: float = LEVEL) -> Estimate:
    """A proportion with Wilson's score interval (E. B. Wilson, JASA 22 (1927) 209)."""
    if n == 0:
        return NOTHING
    z = float(ndtri(0.5 + 0.5 * level))
    share, weight = hits / n, z * z / n
    middle = (share + 0.5 * weight) / (1.0 + weight)
    half = z * math.sqrt(share * (1.0 - share) / n + 0.25 * weight / n) / (1.0 + weight)
    # Rounding must not push the bounds past the proportion itself.
    return Estimate(share, max(0.0, min(middle - half, share)), min(1.0, max(middle + half, share)), n)


def proportion(hits: Sequence[bool]) -> Estimate:
    """The share of hits with Wilson's interval."""
    return wilson(sum(hits), len(hits))


def median(values: ArrayLike, level: float = LEVEL) -> Estimate:
    """The median with the interval that order statistics give, whatever the distribution.

    Of five values and fewer not even the outermost hold it in 95 of 100 cases: then it has none.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    n = len(ordered)
    if n == 0:
        return NOTHING
    # P(X_(r) <= median <= X_(s)) from the binomial law.
    below = int(binom.ppf(0.5 * (1.0 - level), n, 0.5)) - 1
    middle = float(np.median(ordered))
    if below < 0:
        return Estimate(middle, None, None, n)
    return Estimate(middle, float(ordered[below]), float(ordered[n - 1 - below]), n)


def mean(values: ArrayLike, level: float = LEVEL) -> Estimate:
    """The mean with the interval of Student's t, exact for normal values."""
    found = np.asarray(values, dtype=np.float64)
    if found.size == 0:
        return NOTHING
    middle = float(found.mean())
    if found.size == 1:
        return Estimate(middle, None, None, 1)
    half = float(student_ppf(0.5 + 0.5 * level, found.size - 1) * found.std(ddof=1) / math.sqrt(found.size))
    return Estimate(middle, middle - half, middle + half, found.size)


@dataclass(frozen=True)
class OpenSet:
    """How well a score tells positives from negatives.

    Attributes
    ----------
    auroc
        Area under the curve, ties counted half, with DeLong's interval; where every positive lies on one side
        of every negative, Wilson's of as many pairs as share no case.
    fpr95
        Share of negatives at or above the threshold that 95 % of the positives reach.
    false_positive, true_positive
        The curve, from (0, 0) to (1, 1).
    """

    auroc: Estimate
    fpr95: Estimate
    false_positive: FloatArray
    true_positive: FloatArray


def open_set(scores: ArrayLike, positive: ArrayLike, level: float = LEVEL) -> OpenSet:
    """The receiver operating characteristic of a score, shape (n,), against truth, shape (n,).

    The interval is DeLong's (E. R. DeLong et al., Biometrics 44 (1988) 837).
    """
    score, truth = np.asarray(scores, dtype=np.float64), np.asarray(positive, dtype=bool)
    up, down = score[truth], score[~truth]
    n = len(score)
    if len(up) == 0 or len(down) == 0:
        return OpenSet(Estimate(None, None, None, n), Estimate(None, None, None, n), np.zeros(0), np.zeros(0))
    # Each positive's share of negatives below it, and the other way round.
    above = _share_below(up, down)
    under = 1.0 - _share_below(down, up)
    area = float(above.mean())
    spread = sum(float(part.var(ddof=1)) / len(part) for part in (above, under) if len(part) > 1)
    half = float(ndtri(0.5 + 0.5 * level)) * math.sqrt(spread)
    thresholds = np.unique(score)[::-1]
    false_positive = np.concatenate(([0.0], _share_from(down, thresholds)))
    true_positive = np.concatenate(([0.0], _share_from(up, thresholds)))
    first = int(np.argmax(true_positive >= 0.95 - 1e-12))
    fpr = wilson(round(false_positive[first] * len(down)), len(down), level)
    auroc = Estimate(area, max(0.0, area - half), min(1.0, area + half), n)
    if area in (0.0, 1.0):
        # DeLong's has no width there. Pairs without a common case are independent.
        pairs = min(len(up), len(down))
        auroc = replace(wilson(int(area) * pairs, pairs, level), n=n)
    return OpenSet(auroc, fpr, false_positive, true_positive)


@dataclass(frozen=True)
class Bin:
    """A bin of a reliability diagram: stated probabilities from..to, their mean, and how often true."""

    low: float
    high: float
    stated: float
    found: Estimate


def reliability(probabilities: ArrayLike, true: ArrayLike, bins: int = 10) -> list[Bin]:
    """Stated probability against frequency in bins of equal width over 0..1; empty ones left out."""
    stated, hit = np.asarray(probabilities, dtype=np.float64), np.asarray(true, dtype=bool)
    place = np.minimum((stated * bins).astype(np.intp), bins - 1)
    found = []
    for index in range(bins):
        inside = place == index
        if inside.any():
            share = wilson(int(hit[inside].sum()), int(inside.sum()))
            found.append(Bin(index / bins, (index + 1) / bins, float(stated[inside].mean()), share))
    return found


def calibration_error(bins: Sequence[Bin]) -> Estimate:
    """Expected calibration error: mean of ``|stated - found|`` over the bins, by their numbers.

    It has no simple interval; chance alone makes it about ``sum_b sqrt(n_b p_b (1 - p_b)) / n``.
    """
    n = sum(part.found.n for part in bins)
    if n == 0:
        return NOTHING
    total = sum(part.found.n * abs(part.stated - (part.found.value or 0.0)) for part in bins)
    return Estimate(total / n, None, None, n)


def overlap(found: Sequence[tuple[float, float]], true: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Length of what two sets of intervals share, and of what either covers."""
    edges = np.unique(np.array([edge for part in (*found, *true) for edge in part], dtype=np.float64))
    if len(edges) < 2:
        return 0.0, 0.0
    lengths, middles = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    inside = []
    for parts in (found, true):
        covered = np.zeros(len(middles), dtype=bool)
        for low, high in parts:
            covered |= (low <= middles) & (middles <= high)
        inside.append(covered)
    return float(lengths[inside[0] & inside[1]].sum()), float(lengths[inside[0] | inside[1]].sum())


def _share_below(values: FloatArray, others: FloatArray) -> FloatArray:
    ordered = np.sort(others)
    left, right = (np.searchsorted(ordered, values, side) for side in ("left", "right"))
    return 0.5 * (left + right) / len(ordered)


def _share_from(values: FloatArray, thresholds: FloatArray) -> FloatArray:
    ordered = np.sort(values)
    return 1.0 - np.searchsorted(ordered, thresholds, "left") / len(ordered)
