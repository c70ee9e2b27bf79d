"""The cubics that autopilots fit to a gyro over temperature, by their own rules of what counts and where."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray, IndexArray
from fogml.models.table import TrainingTable

_DEGREE = 3


class RisingCubic:
    """A cubic in T of the one run that warms up furthest from its coldest sample, held beyond its range.

    PX4 (``temperature_calibration/gyro.cpp``) takes every sample that is warmer than all before it.
    ArduPilot (``AP_InertialSensor_tempcal.cpp``) takes means, each over all samples until another half
    degree is reached. Both fit a warm-up from cold and hold the correction beyond the temperatures so
    seen. Where the rise is too small they fit nothing: the gyro's mean is taken, as at any power-on.

    Parameters
    ----------
    least_rise_degc
        Rise of temperature without which there is no fit: PX4's SYS_CAL_TDEL is 24 by default,
        ArduPilot's TEMP_RANGE_MIN 10.
    step_degc
        Rise that a mean spans; 0 takes samples.
    """

    def __init__(self, least_rise_degc: float, step_degc: float = 0.0) -> None:
        self.least_rise_degc, self.step_degc = least_rise_degc, step_degc

    def fit(self, table: TrainingTable, rows: IndexArray) -> None:
        """Fit to some rows of a table whose only feature is T."""
        T, y, run = table.X[rows, 0], table.y[rows], table.run_index[rows]
        parts = [self._rising(T[run == each], y[run == each]) for each in np.unique(run)]
        T_seen, y_seen = max(parts, key=lambda part: float(np.ptp(part[0])) if len(part[0]) else 0.0)
        self.fitted = len(T_seen) > _DEGREE and float(np.ptp(T_seen)) >= self.least_rise_degc
        if not self.fitted:
            T_seen, y_seen = T, y
        self.low, self.high = float(T_seen.min()), float(T_seen.max())
        self.middle = 0.5 * (self.low + self.high)
        degree = _DEGREE if self.fitted else 0
        self.coefficients = np.polyfit(T_seen - self.middle, y_seen, degree)

    def _rising(self, T: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Temperatures and outputs that count in one run."""
        coldest = int(np.argmin(T))
        T, y = T[coldest:], y[coldest:]
        warmest = np.maximum.accumulate(T)
        if not self.step_degc:
            new = np.concatenate([[False], T[1:] > warmest[:-1]])
            return T[new], y[new]
        step = np.floor((warmest - T[0]) / self.step_degc).astype(np.intp)
        edges = [0, *(np.flatnonzero(np.diff(step)) + 1).tolist()]
        means = [float(np.mean(y[a:b])) for a, b in pairwise(edges)]
        middles = [0.5 * (T[a] + T[b]) for a, b in pairwise(edges)]
        return np.array(middles), np.array(means)

    def at_rows(self, table: TrainingTable, rows: IndexArray) -> FloatArray:
        """Drift at rows of a table [deg/h]."""
        return self.along(table.X[rows], table.time_s[rows])

    def along(self, X: FloatArray, time_s: FloatArray) -> FloatArray:
        """Drift along a run [deg/h]."""
        held = np.clip(X[:, 0], self.low, self.high)
        return np.asarray(np.polyval(self.coefficients, held - self.middle))

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Its parameters, in float32."""
        ends = [self.low, self.high, self.middle]
        return {name: np.float32(values) for name, values in (("c", self.coefficients), ("range", ends))}

    def operations(self) -> int:
        """Two comparisons, the difference from the middle, Horner's rule."""
        return 3 + 2 * (len(self.coefficients) - 1)
