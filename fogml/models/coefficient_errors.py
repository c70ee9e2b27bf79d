"""What least squares tells of coefficients under the noise that a gyro has, which is not white."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fogml.models.linear import LinearRegressor
from fogml.models.row_noise import noise_of_rows, shape_models
from fogml.models.table import Compose, RunRows, TrainingTable, averaged_table, recorded_s
from fogml.runs.run import FloatArray
from fogml.signals.flicker import LONGEST_S
from fogml.signals.noise_model import flicker_ladder
from fogml.signals.whitening import Whitener

ROWS = 8192
"""Rows of all runs that the noise is told from and the columns are looked at."""


@dataclass(frozen=True)
class Told:
    """What rows tell of coefficients: as many equations as there are, their noise of unit covariance.

    Attributes
    ----------
    columns, target
        The equations ``columns @ coefficients = target + noise``, shapes (k, k) and (k,).
    noise
        Covariance of their noise under each noise model that the rows speak for, shape (m, k, k); on average
        the identity.
    weights
        Probabilities of those models, shape (m,).
    freedom
        Degrees of freedom behind the variances.
    """

    columns: FloatArray
    target: FloatArray
    noise: FloatArray
    weights: FloatArray
    freedom: float

    @property
    def information(self) -> FloatArray:
        """Inverse covariance of the coefficients, shape (k, k)."""
        return self.columns.T @ self.columns

    @property
    def image(self) -> FloatArray:
        """Information times the coefficients' estimate, shape (k,)."""
        return self.columns.T @ self.target


def told_by_rows(table: TrainingTable) -> Told:
    """What a table's values tell of the coefficients of its columns ``X``, by least squares.

    The noise is that of :func:`fogml.models.row_noise.noise_of_rows`; where rows are too few to tell it, all
    that moves is noise, and white.
    """
    basis, root = np.linalg.qr(table.X)
    noise = noise_of_rows(replace(table, X=_moving(table.X)))
    if noise is None:
        spread = max(float(np.std(table.y)), 1e-12)
        width = len(root)
        return Told(root / spread, basis.T @ table.y / spread, np.eye(width)[None], np.ones(1), 1.0)
    shapes = _shapes(basis, table, noise.step_s)
    half = np.linalg.cholesky(np.einsum("s,sij->ij", noise.weights @ noise.squares, shapes))
    rows = np.linalg.solve(half, np.column_stack((root, basis.T @ table.y)))
    whitened = np.array([np.linalg.solve(half, np.linalg.solve(half, shape).T) for shape in shapes])
    models = np.einsum("ms,sij->mij", noise.squares, whitened)
    return Told(rows[:, :-1], rows[:, -1], models, noise.weights, noise.freedom)


def noise_covariance(
    rows: Sequence[RunRows], compose: Compose, regressor: LinearRegressor
) -> FloatArray | None:
    """Covariance of (intercept, coefficients), shape (k + 1, k + 1), for noise of the residuals' spectrum.

    The sandwich ``G X'CX G'`` of least squares, with C the covariance of the rows' noise at their true times,
    the mean over the noise models that what the columns leave speaks for.

    Parameters
    ----------
    rows
        Training rows of each run.
    compose
        Columns from atoms.
    regressor
        Fitted to them.

    Returns
    -------
    ndarray or None
        None where the rows are too few, or hold no noise.

    Notes
    -----
    What else moves a run as a whole from one to the next is no part of it. Flicker slower than the run moves
    its constant in one piece, which no run shows: it is taken to go on to `fogml.signals.flicker.LONGEST_S`.
    """
    averaging_s = 0.0 if sum(len(part.y) for part in rows) <= ROWS else recorded_s(rows) / ROWS
    table = averaged_table(rows, compose, averaging_s)
    noise = noise_of_rows(table)
    if noise is None:
        return None
    scale = np.std(table.X, axis=0)
    scale[scale == 0.0] = 1.0
    shift = table.X.mean(axis=0) if regressor.fit_intercept else np.zeros(len(scale))
    columns = (table.X - shift) / scale
    if regressor.fit_intercept:
        columns = np.column_stack((np.ones(len(columns)), columns))
    basis, root = np.linalg.qr(columns)
    middle = np.einsum("s,sij->ij", noise.weights @ noise.squares, _shapes(basis, table, noise.step_s))
    penalty = np.full(columns.shape[1], np.sqrt(regressor.ridge_ * len(columns)))
    penalty[: columns.shape[1] - len(scale)] = 0.0
    gain = np.linalg.pinv(np.vstack((root, np.diag(penalty))), rcond=1e-12)[:, : len(root)]
    # Back to raw columns: (x - shift) / scale.
    back = np.zeros((len(scale) + 1, columns.shape[1]))
    if regressor.fit_intercept:
        back[0, 0] = 1.0
        back[0, 1:] = -shift / scale
    back[1:, -len(scale) :] = np.diag(1.0 / scale)
    gain = back @ gain
    return np.asarray(gain @ middle @ gain.T)


def _moving(columns: FloatArray) -> FloatArray:
    """Columns without the constant one, of which a stretch has its own."""
    return columns[:, np.ptp(columns, axis=0) > 0.0]


def _shapes(basis: FloatArray, table: TrainingTable, step_s: float) -> FloatArray:
    """``Q'CQ`` of white noise, flicker and a random walk of unit squares, runs apart, shape (3, k, k)."""
    found = np.zeros((3, basis.shape[1], basis.shape[1]))
    edges = np.flatnonzero(np.diff(table.run_index)) + 1
    for low, high in pairwise([0, *edges.tolist(), len(table)]):
        ladder = flicker_ladder(step_s, LONGEST_S)
        for place, model in enumerate(shape_models()):
            whitener = Whitener(model, table.time_s[low:high], step_s, ladder)
            half = whitener.colour_adjoint(basis[low:high])
            found[place] += half.T @ half
    found[1:] -= found[0]
    return found
