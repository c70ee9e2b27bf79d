"""How much the runs so far speak for a change of one figure, for every run that it may have begun with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import solve_triangular

from fogml.arrays import FloatArray, IndexArray
from fogml.monitor.marginal import about_usual, gain, marginal
from fogml.settings_check import check_numbers
from fogml.signals.distributions import students_ppf
from fogml.signals.noise_model import flicker_ladder

Shape = Literal["step", "ramp"]
SHAPES: tuple[Shape, ...] = ("step", "ramp")
_KINDS = 1 + len(SHAPES)
"""What is judged of each run: whether it alone is off, and the changes that may begin with it."""

_ROWS = 128
"""Runs that are judged at once: few, so that the tables of all onsets stay small."""


@dataclass(frozen=True)
class ChangePrior:
    """What is taken for granted of changes.

    Attributes
    ----------
    baseline_runs
        Runs before any change can show: a deviation needs two, and with three its estimate is no longer off
        by orders of magnitude. It may have begun with any of them but the first.
    sizes
        Deviations that a step's size may have, or what a run alone is off by, in deviations of the figure
        between runs; equally likely. In octaves from what hides between runs to what nobody overlooks.
    ramp_sizes
        The same of what a ramp adds in the mean interval between the baseline's runs.
    between
        Shares of a figure's variance in the first runs that may be theirs and not that of telling it: from
        nothing to all, in steps that no likelihood of tens of runs tells apart.
    wander
        Variances that flicker between runs may have per factor e of time, in the variance of the first runs.
    longest_wander
        Slowest flicker, in mean intervals between the baseline's runs.
    confirming_runs
        Runs that have to show a change, the one it begins with among them: one alone may be an outlier, of
        which the normal distribution knows nothing. A change that the runs do not speak for without the last
        of these counts no more than one that nothing is known of.
    """

    baseline_runs: int = 3
    sizes: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0)
    ramp_sizes: tuple[float, ...] = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
    between: tuple[float, ...] = (0.0, 0.1, 0.5, 0.9, 1.0)
    wander: tuple[float, ...] = (0.0, 1 / 16, 1 / 4, 1.0)
    longest_wander: float = 1000.0
    confirming_runs: int = 2

    def __post_init__(self) -> None:
        check_numbers(self, may_be_0=("between", "wander"), above_1=("longest_wander",))

    def steady(self) -> ChangePrior:
        """The same where figures are known not to wander between runs."""
        return replace(self, wander=(0.0,))


def flicker_covariance(t: FloatArray, longest: float) -> FloatArray:
    """Covariance of flicker at n times t, shape (n, n), of variance 1 for each factor e of time constants.

    The sum of Gauss-Markov processes of `fogml.signals.noise_model.flicker_ladder`, from a tenth of the unit
    of t to `longest`; what is slower is constant.
    """
    ladder = flicker_ladder(1.0, longest)
    apart = np.abs(t[:, None] - t)
    total = np.zeros_like(apart)
    for time_constant in ladder.time_constants_s:
        total += np.exp(-apart / time_constant)
    return np.asarray(ladder.step * total)


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
    moves
        Whether the figure may as well go along a line over the age, so that what departs from both is a
        change. Runs before the first are one more, and what they make of a line's slope is where it begins:
        from them on both are as likely (J. O. Berger & L. R. Pericchi, J. Am. Stat. Assoc. 91, 1996).

    Attributes
    ----------
    logs
        Log evidence by onset (each told run but the first that enough have followed) and shape, shape (m, 2);
        (0, 2) until there are more runs than the baseline's.
    alone
        Log evidence that a run alone is off, by told run that enough have followed, shape (k,).
    """

    def __init__(
        self,
        values: FloatArray,
        age: FloatArray,
        first: int,
        prior: ChangePrior,
        errors: FloatArray | None,
        *,
        moves: bool = False,
    ) -> None:
        told = np.isfinite(values[first:])
        if errors is not None:
            told &= np.isfinite(errors[first:])
        self._rows = first + np.flatnonzero(told)
        self._baseline = prior.baseline_runs + moves
        self._unconfirmed = prior.confirming_runs - 1
        self._done = 0
        self.logs: FloatArray = np.empty((0, len(SHAPES)))
        self.alone: FloatArray = np.empty(0)
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
        self._usual = np.column_stack((np.ones(n), self._t))
        self._sizes = np.square(np.array([prior.sizes, prior.sizes, prior.ramp_sizes]))
        own = None if errors is None else np.square(errors[self._rows])
        between = np.array(prior.between)
        if own is None or not np.all(own[:start] > 0.0):
            own, between = np.zeros(n), np.ones(1)
        else:
            # No run is told so well that all others count for nothing beside it.
            own = np.maximum(own / np.exp(np.mean(np.log(own[:start]))), 1e-9)
        widths = range(1, 2 + moves)
        w, q, width = (part.ravel() for part in np.meshgrid(between, prior.wander, widths))
        order = np.argsort(width, kind="stable")
        w, q, self._widths = w[order], q[order], width[order]
        self._white = w[:, None] + (1.0 - w[:, None]) * own
        self._wander, self._flicker = q, flicker_covariance(self._t, prior.longest_wander)
        self._judge()

    def _whitened(self, model: int, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns by a covariance's root, shape (n, k), and its determinant's logarithm, run by run, (n,).

        Whitened by Cholesky's root, what the first runs tell does not depend on those that follow.
        """
        covariance = self._wander[model] * self._flicker + np.diag(self._white[model])
        root = np.linalg.cholesky(covariance)
        return solve_triangular(root, columns, lower=True), np.cumsum(np.log(np.diag(root)))

    def _columns(self) -> FloatArray:
        """What each run adds to all: itself alone, a step and a ramp from it on; shape (n, 3 n)."""
        n = len(self._y)
        onsets = np.arange(n, dtype=np.intp)
        # No change begins with the first run: there is none before it.
        changes = [self._shape(onsets, s) * (onsets > 0) for s in range(len(SHAPES))]
        return np.stack([np.eye(n), *changes], axis=-1).reshape(n, -1)

    def _judge(self) -> None:
        """Log evidence by the first 1 to n told runs; covariance by covariance, as all take much room."""
        n, start = len(self._y), self._baseline
        count, known = np.arange(1.0, n + 1.0), np.column_stack((self._y, self._usual))
        plain, least = np.empty((len(self._wander), n)), np.full(n, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for model, width in enumerate(self._widths):
                z, log_dets = self._whitened(model, known[:, : 1 + width])
                _, volume, _, about = about_usual(z)
                least = np.minimum(least, about)
                plain[model] = marginal(log_dets + volume, about, np.maximum(count - width, 0.5))
        silent = ~(least > count * np.maximum.accumulate(self._least))
        plain[:, silent] = 0.0
        # Constants and lines are as likely from the first runs on.
        kinds = [np.logaddexp.reduce(plain[self._widths == width, start - 1]) for width in self._widths]
        self._shift = np.array(kinds)
        weights = plain - self._shift[:, None]
        weights -= np.logaddexp.reduce(weights)
        columns = self._columns()
        sizes = np.tile(self._sizes, (n, 1))
        valid = np.repeat(np.arange(n), _KINDS)
        self._all = np.full(columns.shape, -np.inf)
        for model, width in enumerate(self._widths):
            z, _ = self._whitened(model, np.column_stack((known[:, : 1 + width], columns)))
            turn, _, along, about = about_usual(z[:, : 1 + width])
            about[silent] = 1.0
            sums = np.sum(_products(z[:start], width), axis=1)
            for first in range(start, n, _ROWS):
                rows = slice(first, min(first + _ROWS, n))
                # What begins later adds nothing yet.
                begun = slice(0, _KINDS * rows.stop)
                products = _products(z[rows, : 1 + width + begun.stop], width)
                products = sums[:, None, begun] + np.cumsum(products, axis=1)
                sums[:, begun] = products[:, -1]
                of_usual = np.einsum("nij,jnm->inm", turn[rows], products[2:])
                v = np.maximum(products[0] - np.sum(of_usual**2, axis=0), 0.0)
                b = products[1] - np.einsum("inm,ni->nm", of_usual, along[rows])
                explained = np.square(b) / about[rows, None]
                freedom = 0.5 * (count[rows, None] - width)
                later = count[rows, None] <= valid[begun]
                for size in sizes.T:
                    ratios = weights[model, rows, None] + gain(size[begun], v, explained, freedom)
                    ratios[later] = -np.inf
                    self._all[rows, begun] = np.logaddexp(self._all[rows, begun], ratios)
        self._all -= np.log(len(sizes.T))
        self._all[silent] = -np.inf

    def _shape(self, onsets: IndexArray, shape: int) -> FloatArray:
        """What a change adds to each run, per size, for each onset; shape (n, m)."""
        after = np.arange(len(self._y))[:, None] >= onsets
        ramp = self._t[:, None] - self._t[onsets - 1]
        return np.where(after, 1.0 if shape == 0 else ramp, 0.0)

    def go_to(self, place: int) -> None:
        """Take the runs up to and with index `place`."""
        self._done = int(np.searchsorted(self._rows, place, side="right"))
        onsets = self._done - self._unconfirmed
        if onsets > self._baseline:
            known = slice(0, _KINDS * onsets)
            logs = self._all[self._done - 1, known].reshape(-1, _KINDS)
            before = self._all[self._done - 1 - self._unconfirmed : self._done - 1, known]
            self.alone, logs = logs[:, 0], logs[1:, 1:] - np.log(len(SHAPES))
            if len(before):
                before = before.min(axis=0).reshape(-1, _KINDS)[1:, 1:] - np.log(len(SHAPES))
                logs = np.where(before > 0.0, logs, np.minimum(logs, 0.0))
            self.logs = logs

    def onset(self, change: int) -> int:
        """Index of the run that a change begins with."""
        return int(self._rows[1 + change])

    def run(self, told: int) -> int:
        """Index of a told run."""
        return int(self._rows[told])

    def off_quantiles(self, levels: tuple[float, ...], told: int) -> list[float]:
        """Quantiles of what a told run alone is off by."""
        return self._quantiles(levels, np.eye(len(self._y))[:, [told]], self._sizes[0])

    def size_quantiles(self, levels: tuple[float, ...], shape: int) -> list[float]:
        """Quantiles of a change's size: for each covariance and each onset by least squares, weighed."""
        onsets = np.arange(1, self._done - self._unconfirmed)
        found = self._quantiles(levels, self._shape(onsets, shape), self._sizes[1 + shape])
        age, t = self._age[: self._done], self._t[: self._done]
        unit = float(np.ptp(age) / np.ptp(t)) if shape == 1 and np.ptp(age) > 0.0 else 1.0
        return [value / unit for value in found]

    def _quantiles(
        self, levels: tuple[float, ...], columns: FloatArray, sizes_before: FloatArray
    ) -> list[float]:
        """Of the size of one of some columns."""
        n = self._done
        parts = []
        for model, width in enumerate(self._widths):
            free = n - float(width)
            table = np.column_stack((self._y, self._usual[:, :width], columns))
            z, log_dets = self._whitened(model, table)
            z = z[:n]
            # Of each column and of the values what is left beside what is usual.
            basis, upper = np.linalg.qr(z[:, 1 : 1 + width])
            left = z - basis @ (basis.T @ z)
            y, x = left[:, 0], left[:, 1 + width :]
            about, v = float(y @ y), np.sum(x**2, axis=0)
            told = v > 1e-18 * np.sum(z[:, 1 + width :] ** 2, axis=0)
            if not told.any() or not about > 0.0:
                continue
            v, products = v[told], y @ x[:, told]
            sizes = products / v
            residual = np.maximum(about - products * sizes, 0.0)
            logs = np.logaddexp.reduce(gain(sizes_before[:, None], v, products**2 / about, 0.5 * free))
            volume = float(np.sum(np.log(np.abs(np.diag(upper)))))
            plain = marginal(log_dets[n - 1] + volume, about, free) - self._shift[model]
            scales = np.sqrt(residual / (free - 1.0) / v)
            parts.append((logs + plain, sizes, scales, np.full_like(sizes, free - 1.0)))
        if not parts:
            return [0.0 if level == 0.5 else float(np.copysign(np.inf, level - 0.5)) for level in levels]
        logs, sizes, scales, freedom = (np.concatenate(part) for part in zip(*parts))
        scales = np.maximum(scales, np.spacing(np.abs(sizes)))
        shares = np.exp(logs - np.logaddexp.reduce(logs))
        kept = shares > 1e-12
        shares = shares[kept] / shares[kept].sum()
        found = students_ppf(levels, shares, sizes[kept], scales[kept], freedom[kept])
        return [float(value) for value in found]


def _products(z: FloatArray, width: int) -> FloatArray:
    """Of whitened [values, what is usual, columns]: each column by itself, the values and what is usual."""
    columns = z[:, 1 + width :]
    return np.stack([columns**2, *(columns * z[:, i, None] for i in range(1 + width))])
