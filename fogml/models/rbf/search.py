"""The search for a network's shape: starts, sizes, tuning, and which is kept."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.models.rbf.blocks import AveragedRows
from fogml.models.rbf.centres import kmeans_centres, ols_centres, thinned
from fogml.models.rbf.objective import Objective, Shape
from fogml.models.rbf.stopping import Watch, held_out_rows
from fogml.models.rbf.tuning import TuningSettings, tune_own, tune_shared
from fogml.models.tall_least_squares import one_blas_thread

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

_WIDE = 3.0  # wide widths start e^3 times wider
_ROWS_PER_CENTRE = 3
_MANY_INPUTS = 6  # more inputs than this are not tried one by one
_START_ROWS = 1500
_START_STEPS = 30
_ROUNDING = 1e-9  # of the target's standard deviation
_VALIDATION_RIDGE = 1e-6
_NEARLY_INDEPENDENT = 0.7  # a greater share of independent rows changes nothing


@dataclass(frozen=True)
class Frame:
    """Mean and standard deviation of the inputs, shape (k,), and of the target."""

    shift: FloatArray
    scale: FloatArray
    target_shift: float
    target_scale: float

    @classmethod
    def of(cls, inputs: FloatArray, target: FloatArray) -> Frame:
        """The frame of training rows; what does not vary is left unscaled."""
        shift, scale = inputs.mean(axis=0), inputs.std(axis=0)
        scale = np.where(scale > 1e-12 * np.maximum(np.abs(shift), 1e-300), scale, 1.0)
        deviation = float(target.std())
        return cls(shift, scale, float(target.mean()), deviation if deviation > 0.0 else 1.0)


@dataclass(frozen=True)
class SearchSettings:
    """What the search may do; fields as the parameters of `RBFRegressor`."""

    sizes: tuple[int, ...]
    centre_choice: str
    tune: bool
    evidence: bool
    tuning: TuningSettings
    wide_inputs: tuple[int, ...] | None
    seed: int
    threads: int | None
    device: str
    dtype: str


@dataclass(frozen=True)
class Found:
    """The shape kept, the objective for each size tried (less is better), and the share of rows
    that counted as independent."""

    shape: Shape
    tried: dict[int, float]
    share: float


class Search:
    """The search on averaged rows.

    Parameters
    ----------
    rows
        Averaged rows.
    frame
        Standardisation of inputs and target.
    seen
        Indices of the network's inputs.
    settings
        What may be done.
    """

    def __init__(self, rows: AveragedRows, frame: Frame, seen: IndexArray, settings: SearchSettings) -> None:
        self.settings = settings
        inputs = (rows.inputs - frame.shift) / frame.scale
        self._linear = np.column_stack([inputs, np.ones(len(inputs))])
        self._inputs = np.ascontiguousarray(inputs[:, seen])
        self._target = (rows.target - frame.target_shift) / frame.target_scale
        self._in_time = rows.in_time
        self._share = 1.0
        wide = settings.wide_inputs
        self._wide = None if wide is None else np.isin(seen, np.asarray(wide, dtype=np.intp))

    def run(self) -> Found:
        """Tune every size and keep the best; larger sizes are left once they gain nothing."""
        dimensions = self._inputs.shape[1]
        most = len(np.unique(self._inputs, axis=0)) // _ROWS_PER_CENTRE
        sizes = sorted({min(size, most) for size in self.settings.sizes} - {0})
        if dimensions == 0 or not sizes or self._linear_suffices():
            return Found(Shape(np.empty((0, dimensions)), np.empty((0, dimensions)), 0.0), {0: 0.0}, 1.0)
        with one_blas_thread(), _torch_threads(self.settings.threads or 1):
            widths, log_ridge = self._start(sizes[0])
            first = self._tuned(sizes[0], widths, log_ridge)
            if self._in_time and self.settings.evidence:
                self._share = independent_share(self._objective_of_all().residuals(first[1]))
                if self._share < _NEARLY_INDEPENDENT:
                    first = self._tuned(sizes[0], widths, log_ridge)
            best = first[1]
            tried = {sizes[0]: first[0]}
            for size in sizes[1:]:
                value, shape = self._tuned(size, widths, log_ridge)
                better = value < min(tried.values())
                tried[size] = value
                if not better:
                    break
                best = shape
        return Found(best, tried, self._share)

    def _linear_suffices(self) -> bool:
        """Whether the linear part leaves nothing but rounding."""
        weights, *_ = np.linalg.lstsq(self._linear, self._target, rcond=None)
        return float(np.max(np.abs(self._target - self._linear @ weights))) < _ROUNDING

    def _start(self, count: int) -> tuple[FloatArray, float]:
        """Shared log widths and log ridge to begin with: the best of several short descents."""
        inputs, linear, target = (
            thinned(part, _START_ROWS) for part in (self._inputs, self._linear, self._target)
        )
        objective = self._objective(inputs, linear, target, evidence=True)
        centres = kmeans_centres(inputs, count, self.settings.seed)
        log_ridge = self.settings.tuning.log_ridge
        ends = [
            tune_shared(
                objective,
                centres,
                start,
                0.0 if log_ridge is None else log_ridge,
                _START_STEPS,
                log_ridge is None,
            )
            for start in self._starts()
        ]
        _, widths, ridge = min(ends, key=lambda end: end[0])
        return widths, ridge

    def _starts(self) -> list[FloatArray]:
        """Log widths to start from: all equal, the wide inputs wider, all but one wider in turn."""
        dimensions = self._inputs.shape[1]
        starts = [np.zeros(dimensions)]
        if self._wide is not None and self._wide.any() and not self._wide.all():
            starts.append(np.where(self._wide, _WIDE, 0.0))
        if 1 < dimensions <= _MANY_INPUTS:
            starts += [np.where(np.arange(dimensions) == i, 0.0, _WIDE) for i in range(dimensions)]
        return list({tuple(start): start for start in starts}.values())

    def _tuned(self, count: int, log_widths: FloatArray, log_ridge: float) -> tuple[float, Shape]:
        """Objective reached with `count` centres, and the shape."""
        settings = self.settings
        learn = settings.tuning.log_ridge is None and settings.evidence
        if not settings.evidence and settings.tuning.log_ridge is None:
            log_ridge = float(np.log(_VALIDATION_RIDGE * len(self._target)))
        fitted, held = held_out_rows(len(self._target), everything=settings.evidence)
        inputs, linear, target = self._inputs[fitted], self._linear[fitted], self._target[fitted]
        objective = self._objective(inputs, linear, target, evidence=settings.evidence)
        objective.share = self._share
        if settings.centre_choice == "ols":
            centres = ols_centres(inputs, linear, target, np.exp(log_widths), count)
        else:
            centres = kmeans_centres(inputs, count, settings.seed)
        watch = None
        if not settings.evidence:
            watch = Watch(objective, self._inputs[held], self._linear[held], self._target[held])
        value, log_widths, log_ridge = tune_shared(
            objective, centres, log_widths, log_ridge, settings.tuning.shared_steps, learn, watch
        )
        shape = Shape(centres, np.tile(log_widths, (len(centres), 1)), log_ridge)
        if settings.tune:
            value, shape = tune_own(objective, centres, log_widths, log_ridge, settings.tuning, learn, watch)
        if watch is not None and watch.best is not None:
            return watch.error, watch.best
        return value, shape

    def _objective_of_all(self) -> Objective:
        return self._objective(self._inputs, self._linear, self._target, evidence=True)

    def _objective(
        self, inputs: FloatArray, linear: FloatArray, target: FloatArray, evidence: bool
    ) -> Objective:
        place = {"device": self.settings.device, "dtype": self.settings.dtype}
        return Objective(inputs, linear, target, evidence=evidence, **place)


def independent_share(residuals: FloatArray) -> float:
    """Share of residuals in order of time that count as independent.

    One over the integrated autocorrelation, ``1 + 2 sum_k rho_k``, summed while pairs of
    neighbouring terms stay positive (Geyer, Statistical Science 7 (1992) 473).
    """
    count = len(residuals)
    centred = residuals - residuals.mean()
    power = np.abs(np.fft.rfft(centred, 2 * count)) ** 2
    covariance = np.fft.irfft(power)[:count]
    if not covariance[0] > 0.0:
        return 1.0
    correlation = covariance / covariance[0]
    pairs = correlation[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    positive = int(np.argmin(np.append(pairs, -1.0) > 0.0))
    return float(min(1.0, 1.0 / max(1.0, 2.0 * pairs[:positive].sum() - 1.0)))


@contextmanager
def _torch_threads(count: int) -> Iterator[None]:
    """Let torch use so many threads.

    One is the default: matrices of a few thousand rows gain little from more, and where other
    work shares the cores, threads that wait for each other cost many times what they bring.
    """
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
