"""The mean square that a noise model leaves in averages, with or without fitted columns taken out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.noise_model import Ladder, NoiseModel
from fogml.signals.whitening import Whitener

_COLUMNS = 64


@dataclass(frozen=True)
class Fitted:
    """Columns whose constants are fitted to the averages.

    Attributes
    ----------
    columns
        Averaged in the same windows, shape (n, p), independent of each other.
    deviations
        Prior standard deviations of their constants, shape (p,), infinite for free ones; all
        are free if None.
    ordinary
        Ordinary least squares, without priors, in place of generalised: a column of ones is then the
        mean. For noise that wanders, generalised least squares leaves much more.
    """

    columns: ArrayLike
    deviations: ArrayLike | None = None
    ordinary: bool = False


def expected_mean_square(
    model: NoiseModel,
    time: ArrayLike,
    averaging_s: ArrayLike,
    *,
    fitted: Fitted | None = None,
    ladder: Ladder | None = None,
) -> float:
    """Expected mean square of averages of the noise [(deg/h)^2], in closed form.

    Parameters
    ----------
    model
        The noise; its random walk starts where the first window begins.
    time
        Times at which the windows end [s], shape (n,).
    averaging_s
        Lengths of the windows [s], a number or shape (n,).
    fitted
        What has been fitted to these very averages. What generalised least squares leave of the
        noise has covariance ``C - X V X'``, V the constants' covariance after the fit.
    ladder
        Flicker states; those for the length of `time` if None. Flicker slower than they are is
        constant over a run.

    Notes
    -----
    For constants known from other runs with covariance V, add the mean of ``sum((X @ V) * X, axis=1)``.
    """
    whitener = Whitener(model, time, averaging_s, ladder)
    total = model.variances(time, averaging_s, whitener.ladder)
    if fitted is None:
        return float(np.mean(total))
    columns = _columns(fitted, len(whitener))
    if fitted.ordinary:
        taken = whitener.colour_adjoint(np.linalg.qr(columns)[0])
    else:
        root = np.asarray(np.linalg.qr(_with_prior(whitener.whiten(columns), fitted), mode="r"))
        # X V X' = (X R^-1) (X R^-1)'.
        taken = np.linalg.solve(root.T, columns.T)
    return float((np.sum(total) - np.sum(taken**2)) / len(whitener))


def floor_square(model: NoiseModel, time: ArrayLike, averaging_s: ArrayLike) -> float:
    """Square of the noise floor of a noise model in given averages, as `fogml.signals.floor` defines it.

    The expected variance of the averages about their mean; parameters as in `expected_mean_square`.
    """
    ones = np.ones((len(np.asarray(time)), 1))
    # Of one average it is nothing but rounding.
    return max(expected_mean_square(model, time, averaging_s, fitted=Fitted(ones, ordinary=True)), 0.0)


def mean_square_draws(
    model: NoiseModel,
    time: ArrayLike,
    averaging_s: ArrayLike,
    draws: int,
    rng: np.random.Generator,
    *,
    fitted: Fitted | None = None,
) -> FloatArray:
    """Mean squares that the noise leaves in averages of so many drawn runs, shape (draws,).

    As `expected_mean_square`; their scatter is what one run's floor is worth. Constants with a prior
    are at its mean here and scatter with it there, where residuals are a little larger.
    """
    whitener = Whitener(model, time, averaging_s)
    n = len(whitener)
    basis, ordinary = None, fitted is not None and fitted.ordinary
    if fitted is not None:
        columns = _columns(fitted, n)
        stacked = columns if ordinary else _with_prior(whitener.whiten(columns), fitted)
        basis = np.linalg.qr(stacked)[0][:n]
    squares = np.empty(draws)
    for low in range(0, draws, _COLUMNS):
        noise = rng.standard_normal((n, min(_COLUMNS, draws - low)))
        if basis is not None and not ordinary:
            noise -= basis @ (basis.T @ noise)
        noise = whitener.colour(noise)
        if basis is not None and ordinary:
            noise -= basis @ (basis.T @ noise)
        squares[low : low + noise.shape[1]] = np.mean(noise**2, axis=0)
    return squares


def _columns(fitted: Fitted, rows: int) -> FloatArray:
    columns = np.asarray(fitted.columns, dtype=np.float64)
    columns = columns.reshape(len(columns), -1)
    if len(columns) != rows:
        raise InputError(f"expected mean square: columns of {len(columns)} rows for {rows} windows")
    return columns


def _with_prior(whitened: FloatArray, fitted: Fitted) -> FloatArray:
    """Whitened columns over the rows that the priors add."""
    if fitted.deviations is None:
        return whitened
    deviations = np.asarray(fitted.deviations, dtype=np.float64)
    if deviations.shape != (whitened.shape[1],) or not np.all(deviations > 0.0):
        raise InputError(
            f"expected mean square: {whitened.shape[1]} positive prior deviations were expected, "
            f"not {deviations}"
        )
    return np.vstack((whitened, np.diag(1.0 / deviations)))
