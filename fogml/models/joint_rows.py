"""Training rows of the joint model: those that tell a scale factor, and averages that hold them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.models.intervals import interval_table
from fogml.models.table import (
    Compose,
    RunRows,
    TrainingTable,
    averaged_table,
    longest_interval_s,
    row_count,
)

_LEAST_TURN_DEG_S = 0.1
# Under this a turn tells the scale factor worse than 100 ppm at 0.1 deg/h of drift: no calibration.
_LEAST_TURNING_ROWS = 10


def _turns(y: FloatArray) -> BoolArray:
    """Where a rate [deg/h] is far enough off its usual value to tell a scale factor, shape (n,)."""
    return np.asarray(np.abs(y - np.median(y)) > 3600.0 * _LEAST_TURN_DEG_S)


def check_turns(names: Sequence[str], rows: Sequence[RunRows]) -> None:
    """Refuse runs by whose rows, y the reference rate [deg/h], no scale factor can be told.

    Raises
    ------
    InputError
        Naming the runs and what is needed.
    """
    row_count(rows)
    if np.count_nonzero(_turns(np.concatenate([part.y for part in rows]))) < _LEAST_TURNING_ROWS:
        raise InputError(
            f"{', '.join(names)}: no turns: the joint model needs turns of the table, both ways and at "
            f"several temperatures, in a column 'rate [deg/s]' (at least {_LEAST_TURNING_ROWS} samples at "
            f"rates {_LEAST_TURN_DEG_S} deg/s apart); use a drift model such as polynomial for a run at rest"
        )


def averages_with_turns(rows: Sequence[RunRows], compose: Compose) -> TrainingTable:
    """Averages for a prediction interval, as of `interval_table`, but as short as it takes to hold turns.

    Rows that are cut about changes of the rate part windows, and what is left of a turn may fill none. Of
    rests alone no model leaves anything: the rate is the same in all of them, whatever the output.
    """
    table, shortest_s = interval_table(rows, compose), longest_interval_s(rows)
    while not _turns(table.y).any() and table.averaging_s > shortest_s:
        table = averaged_table(rows, compose, max(0.5 * table.averaging_s, shortest_s))
    return table
