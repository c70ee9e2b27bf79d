"""A linear model with normal priors and unit noise: evidence, conditioning, posterior, prediction.

With whitened data y and blocks of columns F_i whose coefficients are normal with variance s_i^2 ::

    y = sum_i F_i c_i + e,    log p(y) = -1/2 (y'y - |Q'y|^2) - sum log diag L

Q spans, scaled, what the blocks can do: inner products beside all of them are A'B - (A'Q)(Q'B)
(C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, 2006, ch. 2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import log_ndtr

from fogml.arrays import FloatArray


def prior_factor(gram: FloatArray) -> FloatArray:
    """Lower Cholesky factor of I + G, of inner products G of columns of unit priors, shape (k, k).

    Where columns are so great that rounding of G exceeds the prior's I, values under 1 are taken for 1.
    """
    return _factor(np.eye(len(gram)) + 0.5 * (gram + gram.T), 1.0)


def _factor(matrix: FloatArray, least: float) -> FloatArray:
    """Lower Cholesky factor of a matrix whose eigenvalues are `least` or more but for rounding."""
    try:
        return np.asarray(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(matrix)
        upper = np.linalg.qr(np.sqrt(np.maximum(values, least))[:, None] * vectors.T, mode="r")
        return np.asarray((upper * np.sign(np.diagonal(upper))[:, None]).T)


@dataclass(frozen=True, eq=False)
class LinearGaussian:
    """Data beside blocks of columns that are integrated out.

    Attributes
    ----------
    data
        Whitened, shape (n,).
    basis
        Q, shape (n, q).
    half_log_det
        Sum of the logarithms of the diagonals of L.
    """

    data: FloatArray
    basis: FloatArray
    half_log_det: float = 0.0

    @classmethod
    def of(cls, data: FloatArray) -> LinearGaussian:
        """Data with nothing beside."""
        return cls(data, np.empty((len(data), 0)))

    def beside(self, columns: FloatArray, size: float = 1.0) -> LinearGaussian:
        """With a block of columns of prior standard deviation `size` more, shape (n, k)."""
        left = size * (columns - self.basis @ (self.basis.T @ columns))
        gram = size * (columns.T @ left)
        factor = prior_factor(gram)
        more = solve_triangular(factor, left.T, lower=True).T
        log_det = self.half_log_det + float(np.log(np.diagonal(factor)).sum())
        return LinearGaussian(self.data, np.concatenate([self.basis, more], axis=1), log_det)

    @property
    def log_evidence(self) -> float:
        """Logarithm of the density of the data, less that of unit noise at zero."""
        along = self.basis.T @ self.data
        return float(-0.5 * (self.data @ self.data - along @ along)) - self.half_log_det

    def fits(self, columns: FloatArray) -> FloatArray:
        """Inner products of columns with the data beside all blocks, shape (k,)."""
        return np.asarray(columns.T @ self.data - (columns.T @ self.basis) @ (self.basis.T @ self.data))

    def gram(self, columns: FloatArray) -> FloatArray:
        """Inner products of columns beside all blocks, shape (k, k)."""
        across = self.basis.T @ columns
        return np.asarray(columns.T @ columns - across.T @ across)

    def length(self, series: FloatArray) -> float:
        """Length of a series beside all blocks."""
        along = self.basis.T @ series
        return math.sqrt(max(float(series @ series - along @ along), 0.0))


def size_gains(gram: FloatArray, fits: FloatArray, sizes: FloatArray) -> FloatArray:
    """Gain in log evidence of a block at each size.

    Inner products beside all else, shape (..., k, k), those with the data (..., k), and sizes (..., s), to
    (..., s).
    """
    square = sizes**2
    if gram.shape[-1] == 2:
        # By the determinant, far faster than eigenvectors.
        a, b, d = np.maximum(gram[..., 0, 0], 0.0), gram[..., 0, 1], np.maximum(gram[..., 1, 1], 0.0)
        f, g = fits[..., 0], fits[..., 1]
        area = np.maximum(a * d - b * b, 0.0)[..., None]
        both = np.asarray(f * f + g * g)[..., None]
        turned = np.asarray(f * f * d - 2.0 * f * g * b + g * g * a)[..., None]
        scaled = 1.0 + square * np.asarray(a + d)[..., None] + square**2 * area
        return np.asarray(0.5 * (square * (both + square * turned) / scaled - np.log(scaled)))
    if gram.shape[-1] == 1:
        values, along = np.maximum(gram[..., 0], 0.0), fits**2
    else:
        values, vectors = np.linalg.eigh(gram)
        values = np.maximum(values, 0.0)
        along = np.einsum("...ki,...k->...i", vectors, fits) ** 2
    scaled = 1.0 + square[..., :, None] * values[..., None, :]
    gained = square[..., :, None] * along[..., None, :] / scaled
    return np.asarray(0.5 * np.sum(gained - np.log(scaled), axis=-1))


def sign_gains(gram: FloatArray, fits: FloatArray, sizes: FloatArray) -> FloatArray:
    """What a block gains by knowing that its first coefficient is positive; shapes as `size_gains`.

    The prior is a normal density twice over on the half space: its evidence is the normal one's times twice
    the posterior probability of that half space.
    """
    square = sizes[..., None, None] ** 2
    scaled = np.eye(gram.shape[-1]) + square * gram[..., None, :, :]
    first = np.zeros(gram.shape[-1])
    first[0] = 1.0
    both = np.stack([fits, np.broadcast_to(first, fits.shape)], axis=-1)[..., None, :, :]
    found = square * np.linalg.solve(scaled, np.broadcast_to(both, (*scaled.shape[:-1], 2)))
    mean, variance = found[..., 0, 0], found[..., 0, 1]
    return np.asarray(math.log(2.0) + log_ndtr(mean / np.sqrt(np.maximum(variance, 1e-300))))


def wide_gains(
    values: FloatArray, vectors: FloatArray, beside: FloatArray, fits: FloatArray, sizes: FloatArray
) -> FloatArray:
    """The same of one wide block, by the eigenvalues (k,) and eigenvectors (k, k) of its inner products.

    What else is held takes ``beside @ beside.T`` away from those, shape (k, q): with W the block's posterior
    covariance without it, its determinant and inverse follow from I - beside' W beside, of shape (q, q);
    where that is the larger one, from its own inner products.
    """
    across, along = vectors.T @ beside, vectors.T @ fits
    found = []
    if across.shape[1] >= len(values):
        gram = np.diag(values) - across @ across.T
        for size in sizes.tolist():
            factor = prior_factor(size**2 * gram)
            more = solve_triangular(factor, size * along, lower=True, check_finite=False)
            found.append(float(0.5 * more @ more - np.log(np.diagonal(factor)).sum()))
        return np.array(found)
    for size in sizes.tolist():
        scaled = 1.0 + size**2 * values
        posterior = size**2 / scaled
        gained = 0.5 * float(np.sum(posterior * along**2 - np.log(scaled)))
        if across.shape[1]:
            weighed = posterior[:, None] * across
            factor = _factor(np.eye(across.shape[1]) - across.T @ weighed, float(np.finfo(np.float64).eps))
            more = solve_triangular(factor, weighed.T @ along, lower=True, check_finite=False)
            gained += float(0.5 * more @ more - np.log(np.diagonal(factor)).sum())
        found.append(gained)
    return np.array(found)


def log_sum_exp(values: FloatArray) -> float:
    """Logarithm of the sum of exponentials."""
    most = float(values.max())
    return most if most == -np.inf else most + float(np.log(np.exp(values - most).sum()))


@dataclass(frozen=True, eq=False)
class Posterior:
    """Coefficients of a design of unit priors, given the data: mean (q,), covariance (q, q)."""

    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, design: FloatArray, data: FloatArray) -> Posterior:
        """Of a whitened design, prior standard deviations multiplied in, shape (n, q)."""
        factor = prior_factor(design.T @ design)
        covariance = cho_solve((factor, True), np.eye(design.shape[1]))
        return cls(covariance @ (design.T @ data), covariance)


def log_evidence(gram: FloatArray, fits: FloatArray, square: float) -> float:
    """Log evidence from a design's inner products (q, q), with the data (q,), and the data's square."""
    factor = prior_factor(gram)
    along = solve_triangular(factor, fits, lower=True)
    return float(-0.5 * (square - along @ along) - np.log(np.diagonal(factor)).sum())


def left_out_log_density(design: FloatArray, data: FloatArray, parts: Sequence[slice]) -> float:
    """Sum over parts of the log density of each given all others, noise of unit variance.

    By p(y_r | the rest) = p(y) / p(the rest), constants of 2 pi left out.
    """
    grams = [design[p].T @ design[p] for p in parts]
    fits = [design[p].T @ data[p] for p in parts]
    squares = [float(data[p] @ data[p]) for p in parts]
    total = log_evidence(sum(grams), sum(fits), sum(squares))  # type: ignore[arg-type]
    return sum(
        total - log_evidence(sum(grams) - g, sum(fits) - f, sum(squares) - s)
        for g, f, s in zip(grams, fits, squares)
    )
