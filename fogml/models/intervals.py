"""Prediction intervals from what a model leaves on parts of the training runs it did not see.

Training rows are averaged over ``averaging_s``, cut into folds of time (whole runs where there
are several that tell each other: `half_widths_of_runs`), and for each fold the model is fitted to the
others. Of folds of time the half-width at a level p is the conformal quantile of the n absolute
residuals: the ceil((n + 1) p)-th smallest (Vovk, Gammerman & Shafer 2005; the cross-conformal form is
Barber et al., "Predictive inference with the jackknife+", Ann. Statist. 49, 2021), widened by the slow
noise that parts left out share with the rows about them (`fogml.models.unseen_noise`).

What it covers: averages over ``averaging_s`` of the gyro's error on runs like the training
runs, noise of the averages included. So it is a little wide for the drift alone, and says
nothing on single samples. What training runs don't show it can't hold: another turn-on, ageing.
Outside the trained box the half-width grows in proportion to the distance: twice as wide at one tenth
of the box's span.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, with_config

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.models.folds import Fold, run_folds, time_folds, told_by_each_other
from fogml.models.table import (
    Compose,
    RunRows,
    TrainingTable,
    averaged_table,
    averaging_of,
    longest_interval_s,
    recorded_s,
)
from fogml.models.unseen_noise import unseen_noises
from fogml.signals.averages import AVERAGING_S
from fogml.signals.distributions import normal_ppf, student_ppf
from fogml.strict import CONTENT, strictly

LEVELS = (*(round(0.05 * i, 2) for i in range(1, 20)), 0.975, 0.99, 0.995)
WIDENING_PER_SPAN = 10.0
"""Growth of the half-width per box span outside the box, as a share of itself, where nothing tells it."""


@with_config(CONTENT)
@dataclass(frozen=True)
class Intervals:
    """Half-widths of the prediction interval at a grid of levels.

    Attributes
    ----------
    averaging_s
        Time over which the residuals were averaged [s].
    half_widths
        Half-width [deg/h] at each of `LEVELS`.
    count
        Number of residuals behind them.
    folds
        How the training rows were parted, e.g. ``time blocks`` or ``whole runs``.
    widening_per_span
        Growth of the half-width per box span outside the box, as a share of itself.
    """

    averaging_s: Annotated[float, Field(gt=0.0)]
    half_widths: tuple[Annotated[float, Field(ge=0.0)], ...]
    count: Annotated[int, Field(ge=1)]
    folds: str
    levels: Annotated[tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...], Field(min_length=1)] = LEVELS
    widening_per_span: Annotated[float, Field(ge=0.0)] = WIDENING_PER_SPAN

    def half_width(self, level: float, excess: ArrayLike = 0.0) -> FloatArray:
        """Half-width [deg/h] at a level, for samples `excess` spans outside the box.

        A level that is stored, yet above what `count` residuals can tell, n / (n + 1), has the width of the
        largest of them.

        Raises
        ------
        InputError
            If the level is not above 0, or above the highest that is stored.
        """
        most = self.levels[-1]
        if not 0.0 < level <= most:
            raise InputError(f"interval level {level:g}: must lie above 0 and not above {most:g}, e.g. 0.9")
        inside = np.interp(level, (0.0, *self.levels), (0.0, *self.half_widths))
        return np.asarray(inside * (1.0 + self.widening_per_span * np.asarray(excess, dtype=np.float64)))

    def summary(self) -> dict[str, Any]:
        """The 90 % half-width and what it stands on."""
        return {
            "half_width_90": float(self.half_width(0.9)),
            "averaging_s": self.averaging_s,
            "residuals": self.count,
            "folds": self.folds,
        }


def saved_intervals(values: Any) -> Intervals:
    """Intervals that a saved model holds.

    Raises
    ------
    InputError
        If they are none.
    """
    found = strictly(Intervals, values, "interval")
    if len(found.levels) != len(found.half_widths) or sorted(set(found.levels)) != list(found.levels):
        raise InputError("key 'interval': levels and half_widths do not match")
    return found


def intervals_from_residuals(residuals: ArrayLike, averaging_s: float, folds: str) -> Intervals:
    """Conformal half-widths from out-of-fold residuals [deg/h], shape (n,)."""
    sizes = np.sort(np.abs(np.asarray(residuals, dtype=np.float64)))
    count = len(sizes)
    if count == 0:
        raise InputError("no residuals to tell a prediction interval from; the training runs are too short")
    ranks = [min(math.ceil((count + 1) * level), count) for level in LEVELS]
    return Intervals(float(averaging_s), tuple(float(sizes[rank - 1]) for rank in ranks), count, folds)


def half_widths_of_runs(lefts: Sequence[FloatArray]) -> FloatArray:
    r"""Half-widths at `LEVELS` [deg/h] from what is left on each of K runs left out.

    A run is shifted as a whole, so K runs are K observations. At a level
    :math:`p \le K/(K+1)` the half-width is conformal: the quantile of what is left where each run holds the
    share 1/(K + 1) and the rest lies at infinity (hierarchical conformal prediction: Lee, Barber & Willett,
    "Distribution-free inference with hierarchical data", 2023). Above, it is Student's quantile with K
    degrees of freedom times the rms of the runs' means, and the normal one, as of many observations, times
    what is left about them, in quadrature.
    """
    count, levels = len(lefts), np.array(LEVELS)
    shift = np.sqrt(np.mean([np.mean(left) ** 2 for left in lefts]))
    about = np.sqrt(np.mean([np.var(left) for left in lefts]))
    conformal = quantiles_of_parts(
        [np.abs(left) for left in lefts], np.minimum(levels * (count + 1) / count, 1.0)
    )
    place = 0.5 + levels / 2.0
    normal = np.hypot(shift * student_ppf(place, count), about * normal_ppf(place))
    half = np.where(levels <= count / (count + 1), conformal, normal)
    # No level is wider than one above it.
    return np.asarray(np.minimum.accumulate(half[::-1])[::-1])


def quantiles_of_parts(lefts: Sequence[FloatArray], levels: FloatArray) -> FloatArray:
    """Quantiles of what is left on parts [deg/h], each part counting alike."""
    sizes = np.concatenate(lefts)
    shares = np.concatenate([np.full(len(left), 1.0 / (len(left) * len(lefts))) for left in lefts])
    order = np.argsort(sizes)
    places = np.searchsorted(np.cumsum(shares[order]), levels - 1e-9)
    return np.asarray(sizes[order][np.minimum(places, len(sizes) - 1)])


_LEAST_AVERAGES = 60
WHOLE_RUNS = "whole runs"


def interval_table(rows: Sequence[RunRows], compose: Compose = lambda atoms: atoms) -> TrainingTable:
    """Averages of atom values and y: over 100 s, or shorter so that short runs give 60 of them.

    Atoms and not columns are averaged, so that the atoms of held-out rows can be limited to the
    box of the others, as in use; within 100 s the temperature hardly bends. `compose` makes what else is
    to be averaged of atoms, shape (n, a).
    """
    least_s = max(min(AVERAGING_S, recorded_s(rows) / _LEAST_AVERAGES), longest_interval_s(rows))
    return averaged_table(rows, compose, averaging_of(rows, least_s))


def interval_folds(
    table: TrainingTable, guard_s: float = 0.0, values: Sequence[int] = ()
) -> tuple[list[Fold], str]:
    """Whole runs where there are several that tell each other, else blocks of time; and the name of which."""
    if told_by_each_other(table.run_index, table.X[:, list(values)]):
        return run_folds(table), WHOLE_RUNS
    return time_folds(table, guard_s=guard_s), "time blocks"


def of_usual_averages(
    found: Intervals,
    rows: Sequence[RunRows],
    table: TrainingTable,
    predicted: Callable[[FloatArray], FloatArray],
) -> Intervals:
    """Half-widths told by long averages of atoms, for the usual ones of `interval_table`.

    What shorter averages leave of a prediction [deg/h] from atoms beyond the long ones is noise that has
    averaged out in these: its variance is added, both as normal errors.
    """
    usual = interval_table(rows)
    if not usual.averaging_s < found.averaging_s:
        return found
    more = float(np.var(usual.y - predicted(usual.X)) - np.var(table.y - predicted(table.X)))
    normal = np.array([normal_ppf(0.5 + level / 2.0) for level in found.levels])
    half = np.hypot(found.half_widths, normal * np.sqrt(max(more, 0.0)))
    return replace(found, averaging_s=usual.averaging_s, half_widths=tuple(half.tolist()))


def widened_to_use(
    found: Intervals, rows: Sequence[RunRows], drift_at: Callable[[FloatArray], FloatArray]
) -> Intervals:
    """Half-widths of averages, no narrower than what the model leaves on its training rows.

    There its drift [deg/h] is told from atoms sample by sample: what bends makes more of a feature's noise at
    samples than at the averages of `interval_table`.
    """
    used = averaged_table(rows, lambda atoms: drift_at(atoms)[:, None], found.averaging_s)
    own = intervals_from_residuals(used.y - used.X[:, 0], found.averaging_s, found.folds)
    half = np.maximum(found.half_widths, own.half_widths)
    return replace(found, half_widths=tuple(half.tolist()))


def out_of_fold_intervals(
    table: TrainingTable,
    predicted: Callable[[TrainingTable, TrainingTable], FloatArray],
    guard_s: float = 0.0,
    values: Sequence[int] = (),
) -> Intervals:
    """Intervals from residuals on the rows that each fold leaves out.

    Parameters
    ----------
    table
        Rows of atom values, as `interval_table` gives.
    predicted
        Given the rows to fit to and the rows left out, the prediction [deg/h] for the latter.
    guard_s
        Rows nearer than this to a left-out block of time are not fitted to [s].
    values
        Columns that runs must hold of each other to be left out whole.
    """
    if len(table) < 2:
        return intervals_from_residuals(table.y - predicted(table, table), table.averaging_s, "none")
    folds, name = interval_folds(table, guard_s, values)
    if not folds:
        folds, name = time_folds(table), "time blocks"
    told = np.full(len(table), table.y.mean())
    for fitted, held in folds:
        told[held] = predicted(table.take(fitted), table.take(held))
    residuals = [table.y[held] - told[held] for _, held in folds]
    if name == WHOLE_RUNS:
        half = half_widths_of_runs(residuals)
        return Intervals(table.averaging_s, tuple(half.tolist()), len(table), name)
    found = intervals_from_residuals(np.concatenate(residuals), table.averaging_s, name)
    (unseen,) = unseen_noises(table, told, [folds])
    return replace(found, half_widths=tuple(unseen.widened(found.half_widths, LEVELS).tolist()))
