"""The search for a network's shape: starts, sizes, tuning, and which is kept."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogml.models.rbf.blocks import AveragedRows
from fogml.models.rbf.centres import kmeans_centres, ols_centres
from fogml.models.rbf.objective import Objective, Shape
from fogml.models.rbf.stopping import Watch, held_out_rows
from fogml.models.rbf.together import joined
from fogml.models.rbf.tuning import LOG_WIDTH_RANGE, TuningSettings, tune_own, tune_shared
from fogml.models.tall_least_squares import one_blas_thread

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

_LEAST_LOG_WIDTH = float(np.log(2.0))  # of shared widths along inputs that hold a rate
_WIDE = 3.0  # wide widths start e^3 times wider
_ROWS_PER_CENTRE = 3
_MANY_INPUTS = 6  # more inputs than this are not tried one by one
_TRIED_CENTRES = 16
_STARTS = 2
_FIRST_LOG_RIDGE = -4.0
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
        self._centres: dict[tuple[int, int], FloatArray] = {}
        self._ends: dict[tuple[object, ...], tuple[float, Shape]] = {}
        wide = settings.wide_inputs
        self._wide = None if wide is None else np.isin(seen, np.asarray(wide, dtype=np.intp))

        # Between the rates that were trained at nothing is known: widths that fit into the gaps mislead.
        least = np.full(len(seen), LOG_WIDTH_RANGE[0])
        if self._wide is not None:
            least[self._wide] = _LEAST_LOG_WIDTH
        self._least_log_widths = least
        self._tuning = replace(settings.tuning, least_log_widths=least)

    def run(self) -> Found:
        """Tune every size and keep the best; larger sizes are left once they gain nothing."""
        dimensions = self._inputs.shape[1]
        most = len(np.unique(self._inputs, axis=0)) // _ROWS_PER_CENTRE
        sizes = sorted({min(size, most) for size in self.settings.sizes} - {0})
        if dimensions == 0 or not sizes or self._linear_suffices():
            return Found(Shape(np.empty((0, dimensions)), np.empty((0, dimensions)), 0.0), {0: 0.0}, 1.0)
        with one_blas_thread(), _one_torch_thread(), self._beside_others():
            starts = self._best_starts(min(sizes[0], _TRIED_CENTRES))
            value, best = self._best(sizes[0], starts)
            tried = {sizes[0]: value}
            for size in sizes[1:]:
                value, shape = self._best(size, starts)
                better = value < min(tried.values())
                tried[size] = value
                if not better:
                    break
                best = shape
        return Found(best, tried, self._share)

    @staticmethod
    def _beside_others() -> AbstractContextManager[None]:
        """Meet the descents of other fits, where there are some."""
        together = joined()
        return nullcontext() if together is None else together.descending()

    def _linear_suffices(self) -> bool:
        """Whether the linear part leaves nothing but rounding."""
        weights, *_ = np.linalg.lstsq(self._linear, self._target, rcond=None)
        return float(np.max(np.abs(self._target - self._linear @ weights))) < _ROUNDING

    def _best_starts(self, count: int) -> list[FloatArray]:
        """The log widths from which a small network does best, of `_first_widths`.

        The evidence has several optima, in some of which the network is as good as linear in an
        input, and which of them a descent ends in depends on the widths that it starts from.
        What the best leaves tells how many rows count as independent from here on.
        """
        widths = self._first_widths()
        ends = [self._tuned(count, start, evidence=True) for start in widths]
        order = np.argsort([value for value, _ in ends], kind="stable")
        if self._in_time and self.settings.evidence:
            share = independent_share(self._objective_of_all().residuals(ends[order[0]][1]))
            self._share = share if share < _NEARLY_INDEPENDENT else 1.0
        return [widths[i] for i in order[:_STARTS]]

    def _best(self, count: int, starts: list[FloatArray]) -> tuple[float, Shape]:
        """Objective reached with `count` centres from the best of several starts, and the shape."""
        return min((self._tuned(count, start) for start in starts), key=lambda end: end[0])

    def _first_widths(self) -> list[FloatArray]:
        """Log widths of the short descents: all equal, rates wider, all but one wider in turn."""
        dimensions = self._inputs.shape[1]
        widths = [np.zeros(dimensions), np.ones(dimensions)]
        if 1 < dimensions <= _MANY_INPUTS:
            widths += [np.where(np.arange(dimensions) == i, 0.0, _WIDE / 2) for i in range(dimensions)]
        if self._wide is not None and self._wide.any() and not self._wide.all():
            widths += [np.where(self._wide, wide, 0.0) for wide in (_WIDE / 2, _WIDE)]
        bounded = [np.maximum(start, self._least_log_widths) for start in widths]
        return list({tuple(start): start for start in bounded}.values())

    def _tuned(self, count: int, log_widths: FloatArray, evidence: bool | None = None) -> tuple[float, Shape]:
        """Objective reached with `count` centres from shared log widths, and the shape."""
        evidence = self.settings.evidence if evidence is None else evidence
        key = (count, tuple(log_widths.tolist()), evidence, self._share)
        if key not in self._ends:
            self._ends[key] = self._descend(count, log_widths, evidence)
        return self._ends[key]

    def _descend(self, count: int, log_widths: FloatArray, evidence: bool) -> tuple[float, Shape]:
        settings = self.settings
        log_ridge = settings.tuning.log_ridge
        learn = log_ridge is None and evidence
        if log_ridge is None:
            log_ridge = _FIRST_LOG_RIDGE if evidence else float(np.log(_VALIDATION_RIDGE * len(self._target)))
        fitted, held = held_out_rows(len(self._target), everything=evidence)
        inputs, linear, target = self._inputs[fitted], self._linear[fitted], self._target[fitted]
        objective = self._objective(inputs, linear, target, evidence)
        if settings.centre_choice == "ols":
            centres = ols_centres(inputs, linear, target, np.exp(log_widths), count)
        else:
            centres = self._kmeans(inputs, count)
        watch = None
        if not evidence:
            watch = Watch(objective, self._inputs[held], self._linear[held], self._target[held])
        if settings.tune:
            value, shape = tune_own(objective, centres, log_widths, log_ridge, self._tuning, learn, watch)
        else:
            value, log_widths, log_ridge = tune_shared(
                objective, centres, log_widths, log_ridge, self._tuning, learn, watch
            )
            shape = Shape(centres, np.tile(log_widths, (len(centres), 1)), log_ridge)
        if watch is not None and watch.best is not None:
            return watch.error, watch.best
        return value, shape

    def _kmeans(self, inputs: FloatArray, count: int) -> FloatArray:
        key = (count, len(inputs))
        if key not in self._centres:
            self._centres[key] = kmeans_centres(inputs, count, self.settings.seed)
        return self._centres[key]

    def _objective_of_all(self) -> Objective:
        return self._objective(self._inputs, self._linear, self._target, evidence=True)

    def _objective(
        self, inputs: FloatArray, linear: FloatArray, target: FloatArray, evidence: bool
    ) -> Objective:
        place = {"device": self.settings.device, "dtype": self.settings.dtype}
        objective = Objective(inputs, linear, target, evidence=evidence, **place)
        objective.share = self._share
        return objective


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
def _one_torch_thread() -> Iterator[None]:
    """Let torch use one thread.

    Matrices of a few thousand rows gain little from more, and where other work shares the cores,
    threads that wait for each other cost many times what they bring.
    """
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
