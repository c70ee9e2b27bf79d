"""The search for a network's shape: starts, sizes, tuning, and which is kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.models.rbf.blocks import AveragedRows, Frame, Level, Watch, held_out_rows
from fogml.models.rbf.centres import kmeans_centres, ols_centres
from fogml.models.rbf.objective import Shape
from fogml.models.rbf.tuning import (
    LOG_WIDTH_RANGE,
    Descent,
    OwnVariables,
    SharedVariables,
    TuningSettings,
)
from fogml.processes import one_thread

_LEAST_LOG_WIDTH = float(np.log(2.0))  # of shared widths along inputs that hold a rate
_WIDE = 3.0  # wide widths start e^3 times wider
_ROWS_PER_CENTRE = 3
COARSE_ROWS, COARSE_ROWS_PER_CENTRE = 1000, 15
"""Rows on which shapes are tried: at least so many, and so many to each centre of the largest network."""
_MANY_INPUTS = 6  # more inputs than this are not tried one by one
_TRIED_CENTRES = 16
_STARTS = 2
_RACE_STEPS = 15
_BEHIND_NATS = 0.5
_FIRST_LOG_RIDGE = -4.0
_ROUNDING = 1e-9  # of the target's standard deviation
_VALIDATION_RIDGE = 1e-6
_NEARLY_INDEPENDENT = 0.7  # a greater share of independent rows changes nothing


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
    worth: float


@dataclass(frozen=True)
class Found:
    """The shape kept, the objective for each size tried (less is better), and the share of rows
    that counted as independent."""

    shape: Shape
    tried: dict[int, float]
    share: float


class Tried:
    """A descent, and what watches it.

    Parameters
    ----------
    log_widths
        Shared log widths that it starts from, shape (d,).
    descent, watch
        The descent, and what watches it, if anything does.

    Attributes
    ----------
    early
        What it had reached after its first few steps; infinite where it went to its end at once.
    """

    def __init__(self, log_widths: FloatArray, descent: Descent, watch: Watch | None) -> None:
        self.log_widths, self._watch = log_widths, watch
        self.descent = descent
        self.early = float("inf")

    @property
    def reached(self) -> tuple[float, Shape]:
        """Objective so far, or the error on held-out rows, and its network."""
        if self._watch is not None and self._watch.best is not None:
            return self._watch.error, self._watch.best
        return self.descent.value, self.descent.shape

    def run(self, steps: int | None = None) -> Tried:
        """Go on by so many steps, or to the end."""
        self.descent.run(steps)
        if steps is not None and not np.isfinite(self.early):
            self.early = self.reached[0]
        return self


class Search:
    """The search on averaged rows: all that is tried on coarse ones, the best refined on fine ones.

    Where rows are few, fine and coarse ones are the same. `seen` are indices of the network's inputs.
    """

    def __init__(
        self,
        fine: AveragedRows,
        coarse: AveragedRows,
        frame: Frame,
        seen: IndexArray,
        settings: SearchSettings,
    ) -> None:
        self.settings = settings
        place = frame, seen, settings.device, settings.dtype
        self._fine = Level(fine, *place)
        self._coarse = self._fine if coarse is fine else Level(coarse, *place)
        self._share = 1.0
        self._centres: dict[tuple[int, int], FloatArray] = {}
        wide = settings.wide_inputs
        self._wide = None if wide is None else np.isin(seen, np.asarray(wide, dtype=np.intp))

        # Between the rates that were trained at nothing is known: widths that fit into the gaps mislead.
        least = np.full(len(seen), LOG_WIDTH_RANGE[0])
        if self._wide is not None:
            least[self._wide] = _LEAST_LOG_WIDTH
        self._least_log_widths = least
        self._tuning = replace(settings.tuning, least_log_widths=least)

    def run(self) -> Found:
        """Tune every size, keep the smallest of those as good as the best, and of it the centres that count.

        Larger sizes are left once they gain nothing.
        """
        dimensions = self._fine.inputs.shape[1]
        most = len(np.unique(self._fine.inputs, axis=0)) // _ROWS_PER_CENTRE
        sizes = sorted({min(size, most) for size in self.settings.sizes} - {0})
        if dimensions == 0 or not sizes or self._linear_suffices():
            return Found(Shape(np.empty((0, dimensions)), np.empty((0, dimensions)), 0.0), {0: 0.0}, 1.0)
        evidence = self.settings.evidence
        with one_thread("blas"), _one_torch_thread():
            first = self._first(min(sizes[0], _TRIED_CENTRES))
            starts = [tried.log_widths for tried in first]
            # With fewer independent rows another optimum is the better one, and not near the first.
            same = evidence and sizes[0] <= _TRIED_CENTRES and self._share == 1.0
            best = first[0] if same else self._race(sizes[0], starts, evidence)[0]
            values, all_tried = {sizes[0]: best.reached[0]}, [best]
            for size in sizes[1:]:
                tried = self._race(size, starts[:1], evidence, best)[0]
                values[size] = tried.reached[0]
                all_tried.append(tried)
                if tried.reached[0] >= best.reached[0]:
                    break
                best = tried
            worth = self.settings.worth if evidence else 0.0
            kept = next(tried for tried in all_tried if tried.reached[0] <= best.reached[0] + worth)
            return Found(self._fewest(self._refined(kept)), values, self._share)

    def _fewest(self, shape: Shape) -> Shape:
        """The shape without the centres that its evidence does not miss."""
        if not self.settings.evidence or not self.settings.worth:
            return shape
        kept = self._fine.objective(True, self._share)[0].fewest_centres(shape, self.settings.worth)
        return Shape(shape.centres[kept], shape.log_widths[kept], shape.log_ridge)

    def _linear_suffices(self) -> bool:
        """Whether the linear part leaves nothing but rounding."""
        linear, target = self._fine.linear, self._fine.target
        weights, *_ = np.linalg.lstsq(linear, target, rcond=None)
        return float(np.max(np.abs(target - linear @ weights))) < _ROUNDING

    def _first(self, count: int) -> list[Tried]:
        """Descents of a small network from the log widths from which it does best, of `_first_widths`.

        The evidence has several optima, in some of which the network is as good as linear in an
        input, and which of them a descent ends in depends on the widths that it starts from.
        What the best leaves tells how many rows count as independent from here on.
        """
        first = self._race(count, self._first_widths(), evidence=True)
        if self.settings.evidence:
            self._share = self._share_of(self._coarse, first[0].reached[1])
        return first

    def _share_of(self, level: Level, shape: Shape) -> float:
        """Share of a level's rows that count as independent, by what a network leaves of fine ones."""
        if not self._fine.in_time:
            return 1.0
        share = independent_share(self._fine.objective(True, 1.0)[0].residuals(shape))
        share *= len(self._fine) / len(level)
        return share if share < _NEARLY_INDEPENDENT else 1.0

    def _race(
        self, count: int, starts: Sequence[FloatArray], evidence: bool, smaller: Tried | None = None
    ) -> list[Tried]:
        """Descents with `count` centres from several log widths, the best first.

        All go a few steps, those that have come the furthest go on, and the best goes to its end, but
        for one that is behind a smaller network after as many steps.
        """
        tried = _ahead(self._start(count, log_widths, evidence) for log_widths in starts)
        if len(tried) > _STARTS:
            tried = _ahead(tried[:_STARTS])
        if smaller is None or tried[0].early <= smaller.early + _BEHIND_NATS:
            tried[0].run()
        return tried

    def _first_widths(self) -> list[FloatArray]:
        """Log widths of the short descents: all equal, rates wider, all but one wider in turn."""
        dimensions = self._fine.inputs.shape[1]
        widths = [np.zeros(dimensions), np.ones(dimensions)]
        if 1 < dimensions <= _MANY_INPUTS:
            widths += [np.where(np.arange(dimensions) == i, 0.0, _WIDE / 2) for i in range(dimensions)]
        if self._wide is not None and self._wide.any() and not self._wide.all():
            widths += [np.where(self._wide, wide, 0.0) for wide in (_WIDE / 2, _WIDE)]
        bounded = [np.maximum(start, self._least_log_widths) for start in widths]
        return list({tuple(start): start for start in bounded}.values())

    def _start(self, count: int, log_widths: FloatArray, evidence: bool) -> Tried:
        """A descent on coarse rows that has not begun."""
        settings, level = self.settings, self._coarse
        objective, watch = level.objective(evidence, self._share)
        stated = settings.tuning.log_ridge
        if stated is not None:
            log_ridge = stated - self._log_ridge_change
        else:
            log_ridge = _FIRST_LOG_RIDGE if evidence else float(np.log(_VALIDATION_RIDGE * len(level)))
        centres = self._first_centres(level, count, log_widths, evidence)
        variables = (OwnVariables if settings.tune else SharedVariables)(
            centres, log_widths, log_ridge, self._tuning
        )
        learn = stated is None and evidence
        return Tried(log_widths, Descent(objective, variables, learn, watch), watch)

    def _first_centres(self, level: Level, count: int, log_widths: FloatArray, evidence: bool) -> FloatArray:
        """Where centres begin, shape (count, d)."""
        rows = held_out_rows(len(level), everything=evidence)[0]
        inputs = level.inputs[rows]
        if self.settings.centre_choice == "ols":
            return ols_centres(inputs, level.linear[rows], level.target[rows], np.exp(log_widths), count)
        key = (count, len(inputs))
        if key not in self._centres:
            self._centres[key] = kmeans_centres(inputs, count, self.settings.seed)
        return self._centres[key]

    @property
    def _log_ridge_change(self) -> float:
        """By how much the log ridge of a fine row is larger: its noise variance is."""
        return float(np.log(self._coarse.per_row / self._fine.per_row))

    def _refined(self, best: Tried) -> Shape:
        """The best network, gone on with on fine rows."""
        if self._fine is self._coarse:
            return best.reached[1]
        evidence = self.settings.evidence
        if evidence:
            self._share = self._share_of(self._fine, best.reached[1])
        objective, watch = self._fine.objective(evidence, self._share)
        descent = best.descent.on(objective, self._log_ridge_change, watch)
        return Tried(best.log_widths, descent, watch).run().reached[1]


def _ahead(tried: Iterable[Tried]) -> list[Tried]:
    """Descents after some more steps, those first that have come the furthest."""
    return sorted((one.run(_RACE_STEPS) for one in tried), key=lambda one: one.reached[0])


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
