"""Residuals on parts of the training runs that a model did not see, for its prediction interval."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fogml.models.folds import Fold, run_folds, time_folds
from fogml.models.intervals import Intervals, intervals_from_residuals
from fogml.models.regressors import predict_rows
from fogml.models.table import TrainingTable
from fogml.runs.run import FloatArray

AVERAGING_S = 100.0
"""Averaging time of the residuals [s] where the training runs are long enough."""
_LEAST_AVERAGES = 60
_RUNS_TO_LEAVE_OUT = 3


def interval_averaging_s(recorded_s: float, sample_s: float) -> float:
    """Averaging time of the residuals [s]: 100 s, or shorter so that short runs give 60 averages."""
    return max(min(AVERAGING_S, recorded_s / _LEAST_AVERAGES), sample_s)


def interval_folds(table: TrainingTable, guard_s: float = 0.0) -> tuple[list[Fold], str]:
    """Whole runs where there are three or more, else blocks of time; and the name of which."""
    if len(np.unique(table.run_index)) >= _RUNS_TO_LEAVE_OUT:
        return run_folds(table), "whole runs"
    return time_folds(table, guard_s=guard_s), "time blocks"


def out_of_fold_intervals(
    table: TrainingTable,
    predicted: Callable[[TrainingTable, TrainingTable], FloatArray],
    guard_s: float = 0.0,
) -> Intervals:
    """Intervals from residuals on the rows that each fold leaves out.

    Parameters
    ----------
    table
        Rows averaged over ``table.averaging_s``.
    predicted
        Given the rows to fit to and the rows left out, the prediction [deg/h] for the latter.
    guard_s
        Rows nearer than this to a left-out block of time are not fitted to [s].
    """
    if len(table) < 2:
        return intervals_from_residuals(table.y - predicted(table, table), table.averaging_s, "none")
    folds, name = interval_folds(table, guard_s)
    if not folds:
        folds, name = time_folds(table), "time blocks"
    residuals = [table.y[held] - predicted(table.take(fitted), table.take(held)) for fitted, held in folds]
    return intervals_from_residuals(np.concatenate(residuals), table.averaging_s, name)


def regressor_intervals(
    refitted: Callable[[TrainingTable], Any], table: TrainingTable, guard_s: float
) -> Intervals:
    """Intervals of a regressor that `refitted` fits to the folds of an averaged table."""

    def predicted(fitted: TrainingTable, held: TrainingTable) -> FloatArray:
        return predict_rows(refitted(fitted), held.X)

    return out_of_fold_intervals(table, predicted, guard_s)
