"""The noise of a model's rows, as told by what its columns leave of them.

A grid of models, white noise with flicker and a random walk, weighed by restricted likelihood
(`fogml.signals.restricted`): a short run tells little of slow noise, so all that count are averaged over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.linear import LinearRegressor
from fogml.models.table import Compose, RunRows, TrainingTable, averaged_table, averaging_of, recorded_s
from fogml.processes import one_thread
from fogml.signals.noise_model import NoiseModel, flicker_ladder
from fogml.signals.noise_spectrum import Spectrum, spectrum_of
from fogml.signals.output_filters import SpectrumTerms, term_shapes
from fogml.signals.random_noise import LONGEST_S
from fogml.signals.restricted import absent_or_not, weighed_models
from fogml.signals.whitening import Whitener

_GAP = 1.5
"""Steps longer than this many usual ones part a run, or tell lost rows."""
_MOST_LOST = 0.5
"""Share of a run's rows from which on rows that are followed by longer steps are its usual ones."""
_FEWEST = 8
"""Degrees of freedom that columns must leave for a noise to be told."""
_LIGHT = 1e-4
"""Weight, in the greatest, below which a model no longer counts."""
_OCTAVES_BEYOND = 2
"""Octaves above the highest frequency at which flicker or walk may still equal the white noise."""


@dataclass(frozen=True)
class RowNoise:
    """Noise models that rows speak for.

    Attributes
    ----------
    squares
        N^2 [(deg/h)^2 s, white density], B^2 [(deg/h)^2] and K^2 [(deg/h)^2/s] of each model, shape (m, 3).
    weights
        Posterior probabilities, shape (m,).
    freedom
        Degrees of freedom behind the variances.
    step_s
        Interval of the rows [s].
    """

    squares: FloatArray
    weights: FloatArray
    freedom: float
    step_s: float

    @property
    def mean(self) -> NoiseModel:
        """The model whose covariance is the mean of all models', as that is straight in the squares."""
        n, b, k = np.sqrt(self.weights @ self.squares)
        return NoiseModel(float(n) / 60.0, float(b), 60.0 * float(k))


def stretches_of(table: TrainingTable) -> tuple[list[slice], float]:
    """Rows of one run without a gap each, and the time that a row stands for [s].

    Rows that a run lost at random make no gap: of n rows of which a share p is followed by lost ones, chance
    makes at most about ln(n) / ln(1 / p) in a row. Those that are left stand for their time too.
    """
    inside = np.diff(table.run_index) == 0
    if not np.any(inside):
        return [slice(i, i + 1) for i in range(len(table))], 1.0
    step_s = float(np.median(np.diff(table.time_s)[inside]))
    steps, run = np.diff(table.time_s) / step_s, table.run_index[1:]
    count = np.bincount(run, inside)
    lost = np.bincount(run, inside & (steps > _GAP)) / np.maximum(count, 1.0)
    # A run of other steps than most has lost nothing.
    told = (lost > 0.0) & (lost < _MOST_LOST)
    longest = np.full(len(lost), _GAP)
    longest[told] -= np.log(count[told]) / np.log(lost[told])
    joined = inside & (steps <= longest[run])
    step_s *= float(np.mean(np.maximum(np.rint(steps[joined]), 1.0))) if np.any(joined) else 1.0
    cuts = np.flatnonzero(~joined) + 1
    return [slice(int(p[0]), int(p[-1]) + 1) for p in np.split(np.arange(len(table)), cuts)], step_s


def _joined(table: TrainingTable, skipped_share: float) -> tuple[list[slice], float]:
    """Stretches of three rows or more, those across short gaps as one; and the time a row stands for [s]."""
    parts, step_s = stretches_of(table)
    lacking = np.array([_rows_apart(table, *pair, step_s) - 1.0 for pair in pairwise(parts)])
    order = np.argsort(lacking, kind="stable")
    cut = np.ones(len(lacking), dtype=np.bool_)
    cut[order] = np.cumsum(lacking[order]) > skipped_share * len(table)
    step_s *= 1.0 + float(lacking[~cut].sum()) / len(table)
    starts = [0, *(part.start for part, apart in zip(parts[1:], cut.tolist(), strict=True) if apart)]
    every = [slice(start, stop) for start, stop in pairwise([*starts, len(table)])]
    return [part for part in every if part.stop - part.start >= 3], step_s


def _rows_apart(table: TrainingTable, last: slice, part: slice, step_s: float) -> float:
    """From the end of a stretch to the begin of another, in steps; infinite from run to run."""
    before, after = last.stop - 1, part.start
    if table.run_index[before] != table.run_index[after]:
        return np.inf
    return max(float(np.round((table.time_s[after] - table.time_s[before]) / step_s)), 1.0)


def noise_of_rows(
    table: TrainingTable, *, skipped_share: float = 1.0, slowest_corner_hz: float = 1e-5
) -> RowNoise | None:
    """Noise of a table's values beside its columns and a constant of each stretch; None where they tell none.

    Parameters
    ----------
    table
        Rows in time order, run after run.
    skipped_share
        Rows lacking in gaps that are passed over, the shortest first, as a share of those there are. Were a
        stretch to end with each dropped row or turn of the table, slower noise would not be seen. Rows stand
        for the time of those that lack, so that white noise stays white and slow noise is as slow on the
        whole; that holds as long as more rows are there than lack.
    slowest_corner_hz
        Lowest frequency at which flicker or walk may equal the white noise, however short the rows are [Hz]:
        a day's. Of a gyro it is between 1e-5 and 1e-2 Hz, and minutes of rows are white as a rule.

    Notes
    -----
    What moves a run as a whole from one to the next is no part of it. A form that is wrong leaves residuals
    that count as slow noise. Beforehand, flicker is as likely there as not, and so is the walk; the frequency
    at which one that is there equals the white noise is as likely in any octave.
    """
    if len(table) < 3:
        return None
    scale = np.std(table.X, axis=0)
    columns = (table.X - table.X.mean(axis=0)) / np.where(scale > 0.0, scale, 1.0)
    parts, step_s = _joined(table, skipped_share)
    if not parts:
        return None
    spectrum = spectrum_of([table.y[p] for p in parts], step_s, [columns[p] for p in parts])
    if not np.any(spectrum.power > 0.0):
        return None
    lowest, half = min(float(spectrum.frequency_hz.min()), slowest_corner_hz), 0.5 / step_s
    corners = lowest * 2.0 ** np.arange(np.log2(half / lowest) + _OCTAVES_BEYOND + 1.0)
    flicker = np.concatenate(([0.0], 2.0 * np.pi * corners))
    walk = np.concatenate(([0.0], 4.0 * np.pi**2 * corners**2))
    ratios = np.array([(1.0, b, k) for b in flicker for k in walk])
    return _weighed(spectrum, ratios)


def _weighed(spectrum: Spectrum, ratios: FloatArray) -> RowNoise | None:
    """Models of squares in given ratios, whose scale is unknown."""
    shapes = term_shapes(spectrum.frequency_hz, spectrum.sample_s, SpectrumTerms(("N", "B", "K")))
    shapes = shapes.mean(axis=1)
    single = len(spectrum.values)
    basis, _ = spectrum.basis
    if float(spectrum.count.sum()) - basis.shape[1] < _FEWEST:
        return None
    density = ratios @ shapes.T
    rest, count = density[:, single:], spectrum.count[single:]
    models = weighed_models(
        density[:, :single],
        basis,
        spectrum.values,
        absent_or_not(ratios[:, 1:]),
        squares=(1.0 / rest) @ (count * spectrum.power[single:]),
        log_determinants=np.log(rest) @ count,
        freedom=float(count.sum()),
    )
    live = models.weights > _LIGHT * models.weights.max()
    weights = models.weights[live] / models.weights[live].sum()
    return RowNoise(ratios[live] * models.variances[live, None], weights, models.freedom, spectrum.sample_s)


def shape_models() -> Sequence[NoiseModel]:
    """White noise of N^2 = 1, alone, with flicker of B^2 = 1, and with a walk of K^2 = 1."""
    white = 1.0 / 60.0
    return NoiseModel(white), NoiseModel(white, B=1.0), NoiseModel(white, K=60.0)


MEANS_A_STAY = 32
"""Means over a stay or a plateau that its noise is told from: enough for its slope over frequency, few enough
that rounding to counts has averaged out."""
ROWS = 8192
"""Rows of all runs that the noise is told from and the columns are looked at."""


def noise_covariance(
    rows: Sequence[RunRows], compose: Compose, regressor: LinearRegressor, averaging_s: float | None = None
) -> FloatArray | None:
    """Covariance of (intercept, coefficients), shape (k + 1, k + 1), for noise of the residuals' spectrum.

    The sandwich ``G X'CX G'`` of least squares, with C the covariance of the rows' noise at their true times,
    the mean over the noise models that what the columns leave speaks for. What a ridge draws coefficients by
    is in it as their bias: they scatter less for it.

    Parameters
    ----------
    rows
        Training rows of each run.
    compose
        Columns from atoms.
    regressor
        Fitted to them.
    averaging_s
        What the noise is told from are means over this time [s]; by default as many rows as `ROWS`.

    Returns
    -------
    ndarray or None
        None where the rows are too few, or hold no noise.

    Notes
    -----
    What else moves a run as a whole from one to the next is no part of it. Flicker slower than the run moves
    its constant in one piece, which no run shows: it is taken to go on to
    `fogml.signals.random_noise.LONGEST_S`.
    """
    if averaging_s is None:
        few = sum(len(part.y) for part in rows) <= ROWS
        averaging_s = 0.0 if few else averaging_of(rows, recorded_s(rows) / ROWS)
    table = averaged_table(rows, compose, averaging_s)
    # Products of some hundred rows: threads within BLAS would only wait for each other.
    with one_thread("blas"):
        noise = noise_of_rows(table)
        if noise is None:
            return None
        return _sandwich(table, noise, regressor) + np.outer(regressor.shrinkage_, regressor.shrinkage_)


def _sandwich(table: TrainingTable, noise: RowNoise, regressor: LinearRegressor) -> FloatArray:
    scale = np.std(table.X, axis=0)
    scale[scale == 0.0] = 1.0
    shift = table.X.mean(axis=0) if regressor.fit_intercept else np.zeros(len(scale))
    columns = (table.X - shift) / scale
    if regressor.fit_intercept:
        columns = np.column_stack((np.ones(len(columns)), columns))
    basis, root = np.linalg.qr(columns)
    middle = np.einsum("s,sij->ij", noise.weights @ noise.squares, noise_products(basis, table, noise.step_s))
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


def noise_products(basis: FloatArray, table: TrainingTable, step_s: float) -> FloatArray:
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
