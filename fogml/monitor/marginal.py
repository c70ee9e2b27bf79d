"""Marginal likelihoods of normal values with unknown constants and deviation, run by run."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln

from fogml.arrays import FloatArray


def gain(size: FloatArray, v: FloatArray, explained: FloatArray, freedom: FloatArray | float) -> FloatArray:
    """Log evidence that a column adds: squares `v` beside the mean, of size before the data, and the share of
    the values' squares over `v` that it explains."""
    wide = 1.0 + size * v
    # Rounding aside, what a column explains is less than all.
    gained = np.minimum(size * explained / wide, 1.0 - 1e-15)
    return np.asarray(-0.5 * np.log(wide) - freedom * np.log1p(-gained))


def marginal(log_volume: FloatArray, about: FloatArray | float, freedom: FloatArray | float) -> FloatArray:
    """Log likelihood of squares about what is usual, its constants and the deviation integrated out."""
    half = 0.5 * freedom
    return np.asarray(gammaln(half) - log_volume - half * np.log(np.pi * about))


def about_usual(z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Of whitened values and the columns of what is usual, one or two, run by run.

    Returns
    -------
    turn
        What makes sums of products with the columns orthonormal, shape (n, columns, columns).
    volume
        Logarithm of what the columns span, shape (n,).
    along
        Products of the values with the orthonormal columns, shape (n, columns).
    about
        Squares of what the values are beside the columns, shape (n,).
    """
    y, usual = z[:, 0], z[:, 1:]
    width = usual.shape[1]
    products = np.cumsum(usual[:, :, None] * z[:, None, :], axis=0)
    turn = np.zeros((len(z), width, width))
    turn[:, 0, 0] = 1.0 / np.sqrt(products[:, 0, 1])
    if width == 2:
        share = products[:, 0, 2] / products[:, 0, 1]
        rest = products[:, 1, 2] - share * products[:, 0, 2]
        # A line through one run, or through runs of one age, is none.
        told = rest > 1e-12 * products[:, 1, 2]
        turn[told, 1, 1] = 1.0 / np.sqrt(rest[told])
        turn[:, 1, 0] = -share * turn[:, 1, 1]
    sizes = np.diagonal(turn, axis1=1, axis2=2)
    volume = -np.sum(np.log(np.where(sizes > 0.0, sizes, 1.0)), axis=1)
    along = np.einsum("nij,nj->ni", turn, products[:, :, 0])
    return turn, volume, along, np.cumsum(y**2) - np.sum(along**2, axis=1)
