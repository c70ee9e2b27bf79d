"""The steps that a recorded temperature comes in, and its noise."""

from __future__ import annotations

import math

import numpy as np

from fogml.arrays import FloatArray
from fogml.intervals import MEDIAN_SIZE

FINEST_STEP_DEGC = 5e-4
"""Steps of a record that are finer are its digits and no sensor's."""
WHOLE = 1e-2
"""Share of a step by which differences may miss a whole multiple of it."""
_ORDERS = (2, 4, 6, 8)


def recorded_step(values: FloatArray) -> float:
    """The step that all readings are whole multiples apart of, in their unit; 0 where there is none."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9]
    if len(steps) == 0:
        return 0.0
    least = float(steps.min())
    whole = steps / least
    return least if float(np.abs(whole - np.rint(whole)).max()) < WHOLE else 0.0


def to_steps(values: FloatArray, step: float) -> FloatArray:
    """Values rounded to whole multiples of a step, both in the same unit, shape as given.

    Of a step that divides 1, such as 0.01, they are the nearest numbers to the decimals, so that they
    are written with no more digits than the sensor has.
    """
    whole = np.rint(values / step)
    per_unit = np.rint(1.0 / step)
    if abs(per_unit * step - 1.0) < 1e-9:
        return np.asarray(whole / per_unit)
    return np.asarray(whole * step)


def noisy_beyond(temperature: FloatArray, least: float) -> bool:
    """Whether readings hold more noise than `least`, a standard deviation in their unit.

    Of white noise all differences tell the same, ``Var(D^k x) = C(2 k, k) sigma**2``; a course that is
    smooth over some samples leaves ever less in the higher ones, however slow the samples are.
    """
    if reading_noise(temperature) <= least:
        return False
    orders = [order for order in _ORDERS if len(temperature) >= 16 + order]
    told = [_noise_in_differences(temperature, order) for order in orders]
    return not told or min(told) > least or recorded_step(temperature) > least


def _noise_in_differences(values: FloatArray, order: int) -> float:
    size = float(np.median(np.abs(np.diff(values, order)))) / MEDIAN_SIZE
    return size / math.sqrt(math.comb(2 * order, order))


def reading_noise(temperature: FloatArray) -> float:
    """Standard deviation of a temperature's readings [degC]."""
    if len(temperature) < 16:
        return 0.0
    second = np.abs(np.diff(temperature, 2))
    steps = np.abs(np.diff(temperature))
    steps = steps[steps > 1e-9]
    least = float(np.quantile(steps, 0.01)) if len(steps) else 0.0
    quantised = least / np.sqrt(12.0) if len(np.unique(temperature)) < len(temperature) / 2 else 0.0
    return float(max(np.median(second) / MEDIAN_SIZE / np.sqrt(6.0), quantised))
