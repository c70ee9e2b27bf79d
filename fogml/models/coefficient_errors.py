"""What least squares tells of coefficients under the noise that a gyro has, which is not white."""

from __future__ import annotations

from collections.abc import Sequence
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
