"""What a drift may follow: temperature, its powers, its lags, and products with its rate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.run import Run
from fogml.signals import large
from fogml.signals.memory import Lag

_LAGS_S = (60.0, 300.0, 1200.0, 3600.0)
"""Time constants of the temperature's lags that a drift may follow [s]: those of coils and housings."""
_COARSE = 4096
"""Rows at which the slow temperatures are worked out, at least."""


def leading_temperature(run: Run) -> FloatArray | None:
    """``T`` of a run, or the first of its temperatures where it gives none [degC], shape (n,)."""
    names = ["T"] if run.sensors("T") else run.temperature_columns[:1]
    return run.temperature(names[0]) if names else None


def thermal_columns(run: Run) -> Callable[[FloatArray], FloatArray]:
    """Columns that a drift with a run's temperature may follow, at times [s], shape (times, columns).

    They are kept out where a run's own noise is told beside its drift.
    """
    temperature = leading_temperature(run)
    if temperature is None:
        raise ValueError(f"{run.name} holds no temperature")
    at = np.arange(0, len(run), max(len(run) // _COARSE // 2, 1))
    counts = np.diff(np.append(at, len(run)))
    coarse, time = (np.add.reduceat(values, at) / counts for values in (temperature, run.time))
    large.release()
    t = (coarse - coarse.mean()) / (float(np.std(coarse)) or 1.0)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    lags = [Lag(max(lag_s, step), step).push(time, t)[0] for lag_s in _LAGS_S]
    table = np.column_stack((t, t**2, t**3, *lags, t * (t - lags[0]), t * (t - lags[1])))

    def columns(times_s: FloatArray) -> FloatArray:
        return np.column_stack([np.interp(times_s, time, column) for column in table.T])

    return columns
