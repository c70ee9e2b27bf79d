"""Residuals on parts of the training runs that a model did not see, for its prediction interval."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fogml.models.folds import Fold, run_folds, time_folds
from fogml.models.intervals import Intervals, half_widths_of_runs, intervals_from_residuals
from fogml.models.table import RunRows, TrainingTable, averaged_table, recorded_s
from fogml.runs.run import FloatArray
from fogml.signals.averages import AVERAGING_S

_LEAST_AVERAGES = 60
_RUNS_TO_LEAVE_OUT = 3
WHOLE_RUNS = "whole runs"


def interval_table(rows: Sequence[RunRows]) -> TrainingTable:
    """Averages of atom values and y: over 100 s, or shorter so that short runs give 60 of them.

    Atoms and not columns are averaged, so that the atoms of held-out rows can be limited to the
    box of the others, as in use; within 100 s the temperature hardly bends.
    """
    sample_s = max(float(np.median(np.diff(part.time_s))) if len(part.y) > 1 else 0.0 for part in rows)
    averaging_s = max(min(AVERAGING_S, recorded_s(rows) / _LEAST_AVERAGES), sample_s)
    return averaged_table(rows, lambda atoms: atoms, averaging_s)


def interval_folds(table: TrainingTable, guard_s: float = 0.0) -> tuple[list[Fold], str]:
    """Whole runs where there are three or more, else blocks of time; and the name of which."""
    if len(np.unique(table.run_index)) >= _RUNS_TO_LEAVE_OUT:
        return run_folds(table), WHOLE_RUNS
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
        Rows of atom values, as `interval_table` gives.
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
    if name == WHOLE_RUNS:
        half = half_widths_of_runs(residuals)
        return Intervals(table.averaging_s, tuple(half.tolist()), len(table), name)
    return intervals_from_residuals(np.concatenate(residuals), table.averaging_s, name)
