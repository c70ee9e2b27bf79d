"""What `auto` makes of training runs, judged on folds of their rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fogml.models.combination import left_out
from fogml.models.folds import Fold, IndexArray
from fogml.models.table import TrainingTable
from fogml.models.weighing import Weighed
from fogml.runs.run import BoolArray, FloatArray


def held_out_predictions(
    made: Weighed, table: TrainingTable, atoms: FloatArray, folds: Sequence[Fold]
) -> Iterator[FloatArray]:
    """Drift on the rows that each fold holds out [deg/h], of its members fitted anew without these rows.

    The members' weights and the sizes of a mixed-effects model are those that all training runs tell.

    Parameters
    ----------
    made
        What `auto` made of the runs.
    table
        Rows of the same runs, without features.
    atoms
        The rows' values of the atoms of ``made.union``, shape (n, a).
    folds
        Indices of the table's rows.
    """
    weights = np.array(list(made.weights.values()))
    both = _joined(made.table, replace(table, X=atoms))
    for _, held in folds:
        rest = np.flatnonzero(_apart(made.table, table, held))
        part = ("runs", (rest, len(made.table) + held))
        (found,) = left_out(made.members, made.union, both, [part])
        yield float(both.y[rest].mean()) + found.predicted @ weights


def _joined(first: TrainingTable, second: TrainingTable) -> TrainingTable:
    """The rows of two tables."""
    return replace(
        first,
        X=np.concatenate([first.X, second.X]),
        y=np.concatenate([first.y, second.y]),
        run_index=np.concatenate([first.run_index, second.run_index]),
        time_s=np.concatenate([first.time_s, second.time_s]),
        block=np.concatenate([first.block, second.block]),
    )


def _apart(averages: TrainingTable, table: TrainingTable, held: IndexArray) -> BoolArray:
    """Averages whose nearest row of the same run in the table is not held out."""
    apart = np.ones(len(averages), dtype=np.bool_)
    for run in np.unique(table.run_index[held]):
        rows, mine = (np.flatnonzero(one.run_index == run) for one in (averages, table))
        times = table.time_s[mine]
        after = np.searchsorted(0.5 * (times[1:] + times[:-1]), averages.time_s[rows])
        apart[rows] = ~np.isin(mine[after], held)
    return apart
