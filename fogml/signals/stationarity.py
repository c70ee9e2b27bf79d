"""Whether a series' noise is the same from beginning to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

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
    from scipy.stats import f_oneway

    means = [np.asarray(y, dtype=np.float64) for y in stretches]
    found: list[tuple[float, float, tuple[float, ...]]] = []
    tau_s = sample_s
    while True:
        pairs = [m[: len(m) // 2 * 2].reshape(-1, 2) for m in means if len(m) >= 2]
        squares = np.concatenate([(p[:, 1] - p[:, 0]) ** 2 for p in pairs]) if pairs else np.empty(0)
        per_block = len(squares) // (PARTS * BLOCKS)
        if per_block < _PER_BLOCK:
            break
        blocks = squares[: per_block * PARTS * BLOCKS].reshape(PARTS, BLOCKS, per_block).mean(axis=2)
        if np.all(blocks > 0.0):
            logarithms = np.log(blocks)
            chance = float(f_oneway(*logarithms).pvalue) if np.ptp(logarithms) > 0.0 else 1.0
            shares = np.sqrt(blocks.mean(axis=1) / blocks.mean())
            found.append((chance, tau_s, tuple(float(s) for s in shares)))
        means = [m[: len(m) // 4 * 4].reshape(-1, 4).mean(axis=1) for m in means if len(m) >= 4]
        tau_s *= 4.0
    if not found:
        return Stationarity(1.0, None, ())
    chance, tau_s, shares = min(found)
    return Stationarity(min(1.0, chance * len(found)), tau_s, shares)
