"""What rows tell of coefficients, their noise counted as it is: white, flicker, a random walk, a run's shift.

Rows are whitened by the noise that they speak for themselves (`fogml.models.row_noise`), so that equations of
unit noise are left, a triangle for each run (A. C. Aitken, Proc. R. Soc. Edinb. 55, 1935). What shifts a run
as a whole is added to these, whose column of the constant it moves along.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.row_noise import noise_of_rows
from fogml.models.table import TrainingTable
from fogml.processes import one_thread
from fogml.signals.noise_model import Ladder, NoiseModel, flicker_ladder
from fogml.signals.random_noise import LONGEST_S
from fogml.signals.whitening import Whitener


@dataclass(frozen=True)
class RunsNoise:
    """The noise of a table's rows.

    Attributes
    ----------
    model
        The mean over all noise models that the rows speak for.
    step_s
        What rows are means over [s].
    ladder
        Flicker states, up to three lengths of the longest run.
    """

    model: NoiseModel
    step_s: float
    ladder: Ladder

    @property
    def unseen_shift(self) -> float:
        """Standard deviation [deg/h] of flicker slower than the ladder: it shifts a run as a whole."""
        slowest_s = float(self.ladder.time_constants_s[-1]) * np.exp(0.5 * self.ladder.step)
        return self.model.B * float(np.sqrt(max(np.log(LONGEST_S / slowest_s), 0.0) / np.pi))

    def triangles(self, table: TrainingTable, columns: FloatArray) -> FloatArray:
        """Equations of unit noise of each of r runs, without shifts of runs.

        Parameters
        ----------
        table
            Rows in time order, run after run.
        columns
            Columns of the coefficients, the constant 1 first, shape (n, k).

        Returns
        -------
        ndarray
            Columns and target, shape (r, k + 1, k + 1).
        """
        return _triangles(self._runs(table), np.column_stack([columns, table.y]))

    def like_others(self, table: TrainingTable, others: NoiseModel, spread: float) -> RunsNoise:
        """This white noise with the slow noise of others, as much larger or smaller as the rows tell.

        The mean over a log-normal prior of the slow noise's size times the restricted likelihood of the rows.

        Parameters
        ----------
        table
            The rows.
        others
            Whose flicker and random walk are looked at.
        spread
            Standard deviation of the logarithm of the size, between one and others.
        """
        scale = np.where(np.ptp(table.X, axis=0) > 0.0, np.std(table.X, axis=0), 1.0)
        columns = (table.X - table.X.mean(axis=0)) / scale
        whole = np.column_stack([np.ones(len(table)), columns, table.y])
        runs = self._runs(table)
        # A constant of each run is free: what shifts it says nothing of its noise.
        free = 1e3 * float(table.y.std()) + 1e-12

        def model(size: float) -> NoiseModel:
            return NoiseModel(self.model.N, size * others.B, size * others.K)

        def likelihood(size: float) -> float:
            sized = [(rows, whitener.with_noise(model(size))) for rows, whitener in runs]
            level = sum(whitener.log_det for _, whitener in sized)
            return _restricted(_triangles(sized, whole), free) - level

        sizes, weights = _weighed_sizes(likelihood, 1.0, spread)
        return replace(self, model=model(float(np.sqrt(weights @ sizes**2))))

    def _runs(self, table: TrainingTable) -> list[tuple[slice, Whitener]]:
        """Rows of each run and what whitens them."""
        edges = np.flatnonzero(np.diff(table.run_index)) + 1
        every = [slice(low, high) for low, high in pairwise([0, *edges.tolist(), len(table)])]
        return [(rows, Whitener(self.model, table.time_s[rows], self.step_s, self.ladder)) for rows in every]


def _triangles(runs: Sequence[tuple[slice, Whitener]], whole: FloatArray) -> FloatArray:
    """Triangle of each run's whitened columns."""
    found = []
    for rows, whitener in runs:
        corner = np.linalg.qr(whitener.whiten(whole[rows]), mode="r")
        found.append(np.pad(corner, ((0, whole.shape[1] - len(corner)), (0, 0))))
    return np.array(found)


def runs_noise(table: TrainingTable, otherwise: float) -> RunsNoise:
    """The noise of a table's values beside its columns.

    Parameters
    ----------
    table
        Rows in time order, run after run.
    otherwise
        Standard deviation of a row [deg/h], taken to be white where the rows tell no noise.
    """
    # Products of some hundred rows: threads within BLAS would only wait for each other.
    with one_thread("blas"):
        told = noise_of_rows(table)
    inside = np.diff(table.run_index) == 0
    steps = np.diff(table.time_s)[inside]
    step_s = told.step_s if told is not None else float(np.median(steps)) if len(steps) else 1.0
    model = told.mean if told is not None else NoiseModel(otherwise * np.sqrt(step_s) / 60.0)
    length = max(float(np.ptp(table.time_s[table.run_index == run])) for run in np.unique(table.run_index))
    return RunsNoise(model, step_s, flicker_ladder(step_s, length + step_s))


def shifted(triangles: FloatArray, shift: float) -> FloatArray:
    """Equations of unit noise where each run is shifted by itself too.

    Parameters
    ----------
    triangles
        As `RunsNoise.triangles` gives, shape (r, m, k + 1).
    shift
        Standard deviation of a run's own shift [deg/h].

    Returns
    -------
    ndarray
        All runs' equations, columns and target, shape (r m, k + 1).
    """
    level = triangles[:, :, :1]
    square = np.sum(level**2, axis=1, keepdims=True)
    # The inverse root of 1 + shift^2 l l' takes so much of what lies along l.
    share = (1.0 - 1.0 / np.sqrt(1.0 + shift**2 * square)) / np.maximum(square, 1e-300)
    whitened = triangles - level * (share * np.sum(level * triangles, axis=1, keepdims=True))
    return np.asarray(whitened.reshape(-1, triangles.shape[-1]))


def shift_of_runs(units: Sequence[FloatArray], median: float, spread: float) -> float:
    """Size of a run's own shift [deg/h], as runs of one unit and of several tell it.

    The mean over a log-normal prior times the restricted likelihood of all units, each with coefficients of
    its own.

    Parameters
    ----------
    units
        Triangles of each unit's runs; a unit of one run tells nothing.
    median, spread
        Median [deg/h] and standard deviation of the logarithm, of the prior.
    """
    several = [runs for runs in units if len(runs) > 1]
    sizes, weights = _weighed_sizes(
        lambda size: sum(_restricted(runs, size) for runs in several), median, spread
    )
    return float(weights @ sizes)


def beside_constants(
    noise: RunsNoise, table: TrainingTable, columns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coefficients of columns (n, k) beside a constant of each run, and their standard errors, (k,) each."""
    triangles = noise.triangles(table, np.column_stack((np.ones(len(table)), columns)))
    # Without the first row of each triangle the run's constant is free.
    parts = np.concatenate([triangle[1:, 1:] for triangle in triangles])
    corner: FloatArray = np.asarray(np.linalg.qr(parts, mode="r"))
    inverse = np.linalg.pinv(corner[:-1, :-1], rcond=1e-12)
    return inverse @ corner[:-1, -1], np.linalg.norm(inverse, axis=1)


def _weighed_sizes(
    likelihood: Callable[[float], float], median: float, spread: float, reach: float = 4.0, count: int = 41
) -> tuple[FloatArray, FloatArray]:
    """Sizes, and their weights by a log-normal prior and a likelihood, shape (count,) each.

    They go as far as `reach` deviations of the prior's logarithm either way: beyond lies 6e-5 of it, and
    `count` puts five into each deviation.
    """
    places = np.linspace(-reach, reach, count)
    sizes = median * np.exp(spread * places)
    logs = np.array([likelihood(size) for size in sizes.tolist()]) - 0.5 * places**2
    weights = np.exp(logs - logs.max())
    return sizes, weights / weights.sum()


def _restricted(triangles: FloatArray, shift: float) -> float:
    """Logarithm of the restricted likelihood of a unit's runs under a shift, but for a constant."""
    squares = np.sum(triangles[:, :, 0] ** 2, axis=1)
    corner = np.linalg.qr(shifted(triangles, shift), mode="r")
    diagonal = np.abs(np.diag(corner))
    told = diagonal[:-1] > 1e-12 * diagonal.max()
    left = float(np.log1p(shift**2 * squares).sum()) + float(diagonal[-1] ** 2)
    return -0.5 * left - float(np.log(diagonal[:-1][told]).sum())
