"""Whether innovations are white and of variance 1, and a noise the same from beginning to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.intervals import check_level
from fogml.numerals import short
from fogml.signals import large
from fogml.signals.clock import check_interval
from fogml.signals.distributions import chi2_cdf, chi2_sf, variances_sf

_FEWEST_BLOCKS = 8
_FEWEST = 32


@dataclass(frozen=True)
class Whiteness:
    """Result of a check of innovations.

    Attributes
    ----------
    white
        Whether nothing failed at `level`.
    p_value
        The least p-value times the number of tests (Bonferroni), at most 1.
    level
        Chance of a false alarm for a right model, at most.
    lags, autocorrelation, lag_p_values
        Lags in samples, the autocorrelation at each, and the p-value of all up to it together
        (G. M. Ljung and G. E. P. Box, Biometrika 65 (1978) 297), shape (l,).
    scales, variance_ratio, scale_p_values
        Lengths of blocks in samples, the variance of block means over what it should be, and
        its two-sided chi-square p-value, shape (s,).
    failed
        What failed, in words; empty where nothing did.
    """

    white: bool
    p_value: float
    level: float
    lags: IntArray
    autocorrelation: FloatArray
    lag_p_values: FloatArray
    scales: IntArray
    variance_ratio: FloatArray
    scale_p_values: FloatArray
    failed: tuple[str, ...]


def whiteness(
    innovations: ArrayLike | Sequence[ArrayLike],
    *,
    sample_s: float = 1.0,
    longest_lag: int = 64,
    level: float = 0.01,
) -> Whiteness:
    """Check innovations for autocorrelation and for their variance at all time scales.

    Autocorrelation tells a wrong shape of the spectrum at short times, the variance of block
    means one at long times, where a portmanteau is blind. With 10^6 samples a misfit of 0.5 % is
    significant: look at `variance_ratio` for what it is worth.

    Parameters
    ----------
    innovations
        Whitened values of a series, shape (n,), or of several.
    sample_s
        Sample interval [s], for the words.
    longest_lag
        Longest lag [samples]; lags are powers of two up to it.
    level
        Level of the test as a whole.

    Raises
    ------
    InputError
        If there are fewer than 32 innovations, one is not finite, the sample interval is not positive, or the
        level is no share.
    """
    check_interval(sample_s, "whiteness")
    check_level(level, "whiteness")
    series = [np.asarray(part, dtype=np.float64) for part in _parts(innovations)]
    count = sum(len(part) for part in series)
    if count < _FEWEST:
        raise InputError(f"whiteness: {count} innovations, at least {_FEWEST} are needed")
    if not all(np.all(np.isfinite(part)) for part in series):
        raise InputError("whiteness: an innovation is not finite")
    squares = sum(float(part @ part) for part in series)

    longest = min(longest_lag, count // 8)
    every = np.array([_products(series, lag) for lag in range(1, longest + 1)])
    pairs = np.array([sum(max(len(part) - lag, 0) for part in series) for lag in range(1, longest + 1)])
    correlation = every / (squares or 1.0)
    portmanteau = count * (count + 2.0) * np.cumsum(correlation**2 / np.maximum(pairs, 1))
    lags = 2 ** np.arange(int(np.log2(longest)) + 1, dtype=np.int64)
    lag_p = chi2_sf(portmanteau[lags - 1], lags)

    scales, ratios, scale_p = [], [], []
    scale = 1
    while True:
        blocks = [_block_sums(part, scale) for part in series]
        number = sum(len(part) for part in blocks)
        if number < _FEWEST_BLOCKS:
            break
        found = sum(float(part @ part) for part in blocks) / scale
        scales.append(scale)
        ratios.append(found / number)
        scale_p.append(min(1.0, 2.0 * min(chi2_cdf(found, number), chi2_sf(found, number))))
        scale *= 2

    p_values = np.concatenate((lag_p, scale_p))
    overall = float(min(1.0, len(p_values) * p_values.min()))
    threshold = level / len(p_values)
    failed = [
        f"the variance of means over {scale * sample_s:g} s is {short(ratio)} times what the model expects"
        for scale, ratio, p in zip(scales, ratios, scale_p)
        if p < threshold
    ]
    low = np.flatnonzero(lag_p < threshold)
    if len(low):
        upto = int(lags[low[0]])
        worst = int(np.argmax(np.abs(correlation[:upto])))
        failed.append(
            "neighbouring innovations are correlated: "
            f"{correlation[worst]:+.3f} at {(worst + 1) * sample_s:g} s"
        )
    return Whiteness(
        not failed,
        overall,
        level,
        lags,
        correlation[lags - 1],
        lag_p,
        np.array(scales, dtype=np.int64),
        np.array(ratios),
        np.array(scale_p),
        tuple(failed),
    )


def _parts(innovations: ArrayLike | Sequence[ArrayLike]) -> list[FloatArray]:
    if isinstance(innovations, np.ndarray):
        return [innovations]
    parts = [np.asarray(part, dtype=np.float64) for part in innovations]  # type: ignore[union-attr]
    return [np.array(parts)] if parts and parts[0].ndim == 0 else parts


def _products(series: Sequence[FloatArray], lag: int) -> float:
    return sum(float(part[lag:] @ part[:-lag]) for part in series if len(part) > lag)


def _block_sums(part: FloatArray, scale: int) -> FloatArray:
    whole = len(part) // scale
    return np.asarray(part[: whole * scale].reshape(whole, scale).sum(axis=1))


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
    check_interval(sample_s, "stationarity")
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
