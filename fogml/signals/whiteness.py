"""Whether innovations are white and of variance 1, as a right noise model leaves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.signals.distributions import chi2_cdf, chi2_sf

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
        If there are fewer than 32 innovations, or one is not finite.
    """
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
        f"the variance of means over {scale * sample_s:g} s is {ratio:.3g} times what the model expects"
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
