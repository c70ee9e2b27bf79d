"""Covariance of least-squares coefficients under the noise that a gyro has, which is not white."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fogml.models.linear import LinearRegressor
from fogml.models.table import Compose, RunRows, averaged_table, recorded_s
from fogml.runs.run import FloatArray
from fogml.signals.noise_spectrum import spectrum_of
from fogml.signals.spectrum_fit import SpectrumFit, SpectrumModel, SpectrumTerms, term_shapes

ROWS = 8192
"""Rows of all runs that the noise is told from and the columns are transformed at: slow ones are all that the
coefficients of temperatures feel."""
_FEWEST = 32
_GAP = 1.5
"""Steps longer than this many usual ones part a run."""
_OWN = SpectrumTerms(("N", "B", "K"))


def noise_covariance(
    rows: Sequence[RunRows], compose: Compose, regressor: LinearRegressor
) -> FloatArray | None:
    """Covariance of (intercept, coefficients), shape (k + 1, k + 1), for noise of the residuals' spectrum.

    The sandwich ``G X'CX G'`` of least squares, with C the covariance of white noise, flicker and random walk
    that are fitted to what the columns leave, their constants integrated out. In the cosine transform of each
    stretch C is diagonal: the density at its frequencies.

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
    What moves a run as a whole from one to the next is no part of it. A form that is wrong leaves residuals
    that count as slow noise.
    """
    averaging_s = 0.0 if sum(len(part.y) for part in rows) <= ROWS else recorded_s(rows) / ROWS
    table = averaged_table(rows, compose, averaging_s)
    steps = np.diff(table.time_s)
    inside = np.diff(table.run_index) == 0
    if len(table) < _FEWEST + 2 * table.X.shape[1] or not np.any(inside):
        return None
    step_s = float(np.median(steps[inside]))
    edges = np.concatenate(([0], np.flatnonzero(~inside | (steps > _GAP * step_s)) + 1, [len(table)]))
    parts = [slice(int(a), int(b)) for a, b in pairwise(edges) if b - a >= 3]
    if not parts:
        return None
    scale = np.std(table.X, axis=0)
    scale[scale == 0.0] = 1.0
    columns = (table.X - table.X.mean(axis=0)) / scale
    spectrum = spectrum_of([table.y[p] for p in parts], step_s, [columns[p] for p in parts])
    if not np.any(spectrum.power > 0.0):
        return None
    fit = SpectrumModel(spectrum, _OWN).fit()
    if regressor.fit_intercept:
        columns = np.column_stack((np.ones(len(columns)), columns))
    else:
        columns = table.X / scale
    middle = sum(_filling(columns[p], fit, step_s) for p in parts)
    information = columns.T @ columns
    penalty = np.full(len(scale), regressor.ridge_ * len(columns))
    information += np.diag(np.concatenate(([0.0], penalty)) if regressor.fit_intercept else penalty)
    gain = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
    covariance = gain @ middle @ gain
    # Back to raw columns: (x - mean) / scale.
    width = len(scale)
    back = np.zeros((width + 1, covariance.shape[0]))
    if regressor.fit_intercept:
        back[0, 0] = 1.0
        back[0, 1:] = -table.X.mean(axis=0) / scale
    back[1:, -width:] = np.diag(1.0 / scale)
    return np.asarray(back @ covariance @ back.T)


def _filling(columns: FloatArray, fit: SpectrumFit, step_s: float) -> FloatArray:
    """``X'CX`` of one stretch."""
    from scipy.fft import dct

    n = len(columns)
    transformed = dct(columns, axis=0, norm="ortho")
    # The mean of a stretch moves by noise slower than it: as at half the lowest frequency.
    order = np.concatenate(([0.5], np.arange(1, n)))
    frequency = order / (2.0 * n * step_s)
    density = term_shapes(frequency, step_s, fit.terms) @ fit.coefficients
    return np.asarray((transformed * (density / (2.0 * step_s))[:, None]).T @ transformed)
