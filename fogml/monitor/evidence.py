"""How much the runs so far speak for a change of one figure, for every run that it may have begun with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import solve_triangular

from fogml.arrays import FloatArray, IndexArray
from fogml.signals.distributions import students_ppf
from fogml.signals.noise_model import flicker_ladder

Shape = Literal["step", "ramp"]
SHAPES: tuple[Shape, ...] = ("step", "ramp")


@dataclass(frozen=True)
class ChangePrior:
    """What is taken for granted of changes.

    Attributes
    ----------
    baseline_runs
        Runs before the first that a change can begin with: a deviation needs two, and with three its
        estimate is no longer off by orders of magnitude.
    sizes
        Deviations that a step's size may have, in deviations of the figure between runs; equally likely. In
        octaves from what hides between runs to what nobody overlooks.
    ramp_sizes
        The same of what a ramp adds in the mean interval between the baseline's runs.
    between
        Shares of a figure's variance in the first runs that may be theirs and not that of telling it: from
        nothing to all, in steps that no likelihood of tens of runs tells apart.
    wander
        Variances that flicker between runs may have per factor e of time, in the variance of the first runs.
    longest_wander
        Slowest flicker, in mean intervals between the baseline's runs.
    """

    baseline_runs: int = 3
    sizes: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0)
    ramp_sizes: tuple[float, ...] = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
    between: tuple[float, ...] = (0.0, 0.1, 0.5, 0.9, 1.0)
    wander: tuple[float, ...] = (0.0, 1 / 16, 1 / 4, 1.0)
    longest_wander: float = 1000.0

    def steady(self) -> ChangePrior:
        """The same where figures are known not to wander between runs."""
        return replace(self, wander=(0.0,))


def flicker_covariance(t: FloatArray, longest: float) -> FloatArray:
    """Covariance of flicker at n times t, shape (n, n), of variance 1 for each factor e of time constants.

    The sum of Gauss-Markov processes of `fogml.signals.noise_model.flicker_ladder`, from a tenth of the unit
    of t to `longest`; what is slower is constant.
    """
    ladder = flicker_ladder(1.0, longest)
    apart = np.abs(t[:, None] - t)[..., None]
    return np.asarray(ladder.step * np.sum(np.exp(-apart / ladder.time_constants_s), axis=-1))


class FigureEvidence:
    """Evidence of change of one figure, run by run; see `fogml.monitor.changes` for what it is.

    Parameters
    ----------
    values
        The figure at each run, shape (n,); NaN where a run does not tell it.
    age
        Age of the unit at each run, shape (n,).
    first
        Index of the run to begin with.
    prior
        What is taken for granted.
    errors
        Standard error of each value, shape (n,); None for values that are told alike.

    Attributes
    ----------
    logs
        Log evidence by onset (each told run after the baseline) and shape, shape (m, 2); (0, 2) before.
    """

    def __init__(
        self, values: FloatArray, age: FloatArray, first: int, prior: ChangePrior, errors: FloatArray | None
    ) -> None:
        told = np.isfinite(values[first:])
        if errors is not None:
            told &= np.isfinite(errors[first:])
        self._rows = first + np.flatnonzero(told)
        self._baseline = prior.baseline_runs
        self._done = 0
        self.logs: FloatArray = np.empty((0, len(SHAPES)))
        n = len(self._rows)
        if n <= self._baseline:
            return
        self._age = age[self._rows]
        # Exact where values are equal, and well conditioned where they are large.
        self._y = values[self._rows] - values[self._rows[0]]
        self._least = np.square(np.spacing(np.abs(values[self._rows])))
        start = self._baseline
        interval = (self._age[start - 1] - self._age[0]) / (start - 1)
        self._t = (self._age - self._age[0]) / interval if interval > 0.0 else np.arange(float(n))
        self._sizes = np.square(np.array([prior.sizes, prior.ramp_sizes]))
        own = None if errors is None else np.square(errors[self._rows])
        between = np.array(prior.between)
        if own is None or not np.all(own[:start] > 0.0):
            own, between = np.zeros(n), np.ones(1)
        else:
            # No run is told so well that all others count for nothing beside it.
            own = np.maximum(own / np.exp(np.mean(np.log(own[:start]))), 1e-9)
        w, q = (part.ravel() for part in np.meshgrid(between, prior.wander))
        white = w + (1.0 - w) * own[:, None]
        flicker = flicker_covariance(self._t, prior.longest_wander)
        covariances = flicker * q[:, None, None] + np.einsum("ng,nm->gnm", white, np.eye(n))
        roots = np.linalg.cholesky(covariances)
        columns = [self._shape(np.arange(start, n, dtype=np.intp), s) for s in range(len(SHAPES))]
        # Whitened by Cholesky's root, what the first runs tell does not depend on those that follow.
        table = np.column_stack((self._y, np.ones(n), np.stack(columns, axis=-1).reshape(n, -1)))
        self._innovations = solve_triangular(roots, table[None], lower=True)
        self._log_dets = np.cumsum(np.log(np.diagonal(roots, axis1=1, axis2=2)), axis=1)
        self._of_mean, self._of_values, self._squares = np.zeros((3, len(q), table.shape[1]))

    def _shape(self, onsets: IndexArray, shape: int) -> FloatArray:
        """What a change adds to each run, per size, for each onset; shape (n, m)."""
        after = np.arange(len(self._y))[:, None] >= onsets
        ramp = self._t[:, None] - self._t[onsets - 1]
        return np.where(after, 1.0 if shape == 0 else ramp, 0.0)

    def go_to(self, place: int) -> None:
        """Take the runs up to and with index `place`."""
        if len(self._rows) <= self._baseline:
            return
        while self._done < len(self._rows) and self._rows[self._done] <= place:
            row = self._innovations[:, self._done]
            self._of_values += row * row[:, :1]
            self._of_mean += row * row[:, 1:2]
            self._squares += row**2
            self._done += 1
            if self._done > self._baseline:
                self.logs = self._evidence(self._done)

    def _evidence(self, n: int) -> FloatArray:
        """Log evidence of each onset and shape by the first n told runs, shape (m, 2)."""
        count = n - self._baseline
        ones = self._of_mean[:, 1]
        about = self._of_values[:, 0] - self._of_values[:, 1] ** 2 / ones
        if np.min(about) <= n * np.max(self._least[:n]):
            return np.full((count, len(SHAPES)), -np.inf)
        plain = -self._log_dets[:, n - 1] - 0.5 * np.log(ones) - 0.5 * (n - 1) * np.log(about)
        part = slice(2, 2 + count * len(SHAPES))
        by_mean = self._of_mean[:, part]
        v = self._squares[:, part] - by_mean**2 / ones[:, None]
        b = self._of_values[:, part] - by_mean * (self._of_values[:, 1] / ones)[:, None]
        v, b = (one.reshape(len(ones), count, len(SHAPES), 1) for one in (v, b))
        wide = 1.0 + self._sizes * np.maximum(v, 0.0)
        gained = self._sizes * b**2 / wide / about[:, None, None, None]
        # Rounding aside, what a column explains is less than all.
        ratios = -0.5 * np.log(wide) - 0.5 * (n - 1) * np.log1p(-np.minimum(gained, 1.0 - 1e-15))
        ratios += (plain - np.logaddexp.reduce(plain))[:, None, None, None]
        self._best = int(np.argmax(np.max(ratios, axis=(1, 2, 3))))
        summed = np.logaddexp.reduce(np.logaddexp.reduce(ratios, axis=3), axis=0)
        return np.asarray(summed - np.log(self._sizes.size))

    def onset(self, change: int) -> int:
        """Index of the run that a change begins with."""
        return int(self._rows[self._baseline + change])

    def size_quantile(self, level: float, shape: int, shares: FloatArray) -> float:
        """Quantile of a change's size, whose onset has the probabilities `shares`, shape (m,)."""
        n, onsets = self._done, np.flatnonzero(shares)
        whitened = self._innovations[self._best, :n]
        # A line through whitened runs: of each column and of the values what is left beside the mean.
        mean = whitened[:, 1] / np.linalg.norm(whitened[:, 1])
        left = whitened - np.outer(mean, mean @ whitened)
        columns, y = left[:, 2 + len(SHAPES) * onsets + shape], left[:, 0]
        if shape == 1 and np.ptp(self._age[:n]) > 0.0:
            columns *= np.ptp(self._age[:n]) / np.ptp(self._t[:n])
        lengths = np.linalg.norm(columns, axis=0)
        told = lengths > 1e-9 * np.linalg.norm(whitened[:, 2 + len(SHAPES) * onsets + shape], axis=0)
        if not told.any():
            return 0.0 if level == 0.5 else float(np.copysign(np.inf, level - 0.5))
        columns, lengths, weights = columns[:, told], lengths[told], shares[onsets[told]]
        sizes = y @ columns / lengths**2
        scales = np.linalg.norm(y[:, None] - columns * sizes, axis=0) / np.sqrt(n - 2) / lengths
        scales = np.maximum(scales, np.spacing(np.abs(sizes)))
        return students_ppf(level, weights / weights.sum(), sizes, scales, n - 2)
