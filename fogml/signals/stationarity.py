"""Whether a series' noise is the same from beginning to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals import large
from fogml.signals.distributions import variances_sf

PARTS, BLOCKS = 3, 8
"""Parts of the series that are compared, and blocks of each whose scatter says what chance does."""
_PER_BLOCK = 8
"""Differences that a block needs."""


@dataclass(frozen=True)
class Stationarity:
    """Comparison of the thirds of a series.

    Attributes
    ----------
    p_value
        Least p-value over averaging times, times their number (Bonferroni), at most 1.
    tau_s
        Averaging time of that one [s]; None where the series is too short to tell.
    thirds
        Root mean square of differences of neighbouring averages over `tau_s` in each third, over that of all.
    """

    p_value: float
    tau_s: float | None
    thirds: tuple[float, ...]


def stationarity(stretches: Sequence[FloatArray], sample_s: float) -> Stationarity:
    """Compare the thirds of a series by the noise at several averaging times.

    Analysis of variance of the logarithms of mean squares of blocks: their own scatter stands for chance, so
    that noise of any spectrum is judged alike. Differences cross no gap.

    Parameters
    ----------
    stretches
        Evenly sampled values in order of time.
    sample_s
        Sample interval [s].
    """
    means = [np.asarray(y, dtype=np.float64) for y in stretches]
    found: list[tuple[float, float, tuple[float, ...]]] = []
    tau_s = sample_s
    while True:
        squares = _squares(means)
        per_block = len(squares) // (PARTS * BLOCKS)
        if per_block < _PER_BLOCK:
            break
        blocks = squares[: per_block * PARTS * BLOCKS].reshape(PARTS, BLOCKS, per_block).mean(axis=2)
        if np.all(blocks > 0.0):
            logarithms = np.log(blocks)
            chance = _by_parts(logarithms) if np.ptp(logarithms) > 0.0 else 1.0
            shares = np.sqrt(blocks.mean(axis=1) / blocks.mean())
            found.append((chance, tau_s, tuple(float(s) for s in shares)))
        means = [_means_of_four(m) for m in means if len(m) >= 4]
        tau_s *= 4.0
    if not found:
        return Stationarity(1.0, None, ())
    chance, tau_s, shares = min(found)
    return Stationarity(min(1.0, chance * len(found)), tau_s, shares)


def _by_parts(values: FloatArray) -> float:
    """Chance of parts whose means lie as far apart, by one-way analysis of variance, shape (parts, m)."""
    parts, count = values.shape
    means = values.mean(axis=1, keepdims=True)
    between = count * float(np.sum((means - means.mean()) ** 2))
    within = float(np.sum((values - means) ** 2))
    freedom = parts * (count - 1)
    return (
        variances_sf(between / (parts - 1) / (within / freedom), parts - 1, freedom) if within > 0.0 else 0.0
    )


def _squares(stretches: Sequence[FloatArray]) -> FloatArray:
    """Squared differences of pairs of neighbours, one stretch after the other."""
    found = large.empty(sum(len(y) // 2 for y in stretches))
    filled = 0
    for y in stretches:
        for part in large.pieces(y[: len(y) // 2 * 2], least=2):
            pairs = y[part].reshape(-1, 2)
            found[filled : filled + len(pairs)] = (pairs[:, 1] - pairs[:, 0]) ** 2
            filled += len(pairs)
    return found


def _means_of_four(y: FloatArray) -> FloatArray:
    found = large.empty(len(y) // 4)
    for part in large.pieces(y[: len(y) // 4 * 4], least=4):
        found[part.start // 4 : part.stop // 4] = y[part].reshape(-1, 4).mean(axis=1)
    return found
