"""How well the chamber's air reaches the unit: fan and table rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.runs.run import FloatArray

FULL_RATE_DEG_S = 100.0
"""Table rate [deg/s] at which `rotation_gain` holds in full."""
_RATE_LEVELS, _FAN_LEVELS = 8, 32


@dataclass(frozen=True)
class Airflow:
    """Conductance to the air, relative to fan on and table at rest.

    ::

        factor = (1 + fan_gain fan) / (1 + fan_gain) * (1 + rotation_gain sqrt(|rate| / 100 deg/s))

    The root goes in steps of 1/8 and the fan's duty in steps of 1/32, so that the plant is linear
    in between; beyond 100 deg/s the air gains no more.
    """

    fan_gain: float = 0.0
    rotation_gain: float = 0.0

    def factors(self, fan: FloatArray | None, table_rate: FloatArray | None) -> FloatArray:
        """The factor at each sample, shape (n,); shape (1,) where it never changes."""
        factor = np.ones(1)
        if self.fan_gain != 0.0 and fan is not None:
            duty = np.rint(np.clip(fan, 0.0, 1.0) * _FAN_LEVELS) / _FAN_LEVELS
            factor = factor * ((1.0 + self.fan_gain * duty) / (1.0 + self.fan_gain))
        if self.rotation_gain != 0.0 and table_rate is not None:
            root = np.sqrt(np.minimum(np.abs(table_rate) / FULL_RATE_DEG_S, 1.0))
            factor = factor * (1.0 + self.rotation_gain * np.rint(root * _RATE_LEVELS) / _RATE_LEVELS)
        return factor


def levels(factors: FloatArray, before: float) -> tuple[list[float], np.ndarray]:
    """The different factors, `before` among them, and which of them each sample has.

    Returns
    -------
    list of float, ndarray of int64
        The factors; their numbers, shape (n,), or (1,) where they never change.
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(factors)) + 1])
    values, number = np.unique(np.append(factors[starts], before), return_inverse=True)
    counts = np.diff(np.append(starts, len(factors)))
    return values.tolist(), np.repeat(number[:-1], counts).astype(np.int64)
