"""The steps that a recorded temperature comes in."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray

FINEST_STEP_DEGC = 5e-4
"""Steps of a record that are finer are its digits and no sensor's."""
_WHOLE = 1e-2


def recorded_step(values: FloatArray) -> float:
    """The step that all readings are whole multiples apart of, in their unit; 0 where there is none."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9]
    if len(steps) == 0:
        return 0.0
    least = float(steps.min())
    whole = steps / least
    return least if float(np.abs(whole - np.rint(whole)).max()) < _WHOLE else 0.0


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
