"""What several effects ask of their inputs: the output's slope, tilts, unseen errors.

A function that remembers takes the key of the effect that asks, so that no two share a state.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.attitude import earth_rate, turned
from fogml.signals.bases import sine
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import DELTA, delta_of


def slope_per_s(inputs: Inputs, key: str, x: FloatArray) -> FloatArray:
    """Slope of x from the sample before to each sample [1/s], shape (n,); 0 at the first one."""
    step_x = x - inputs.memory.previous(f"{key} value", x)
    step_t = inputs.time - inputs.memory.previous(f"{key} time", inputs.time)
    return np.divide(step_x, step_t, out=np.zeros(len(x)), where=step_t > 0.0)


def line(inputs: Inputs, period_s: float, phase_deg: float) -> FloatArray:
    """sin(2 pi t / period + phase), shape (n,)."""
    return sine(inputs.time / period_s + phase_deg / 360.0)


def unseen(inputs: Inputs, key: str, missed: Callable[[str], FloatArray]) -> FloatArray:
    """What the output owes to temperatures that the sensors miss [deg/h], shape (n,).

    `key` is the effect's, for what it remembers; `missed` gives, by a sensor's name, its place's
    temperature less what it shows [degC].
    """
    total = np.zeros(len(inputs))
    held: dict[str, FloatArray] = {}
    for name, slope in inputs.slopes.items():
        if name == DELTA:
            continue
        held[name] = missed(name)
        total += slope * held[name]
    if DELTA in inputs.slopes and "T" in held:
        total += inputs.slopes[DELTA] * delta_of(inputs, f"{key} unseen", held["T"])
    return total


def tilt_response(inputs: Inputs, direction_deg: float) -> FloatArray:
    """Rate that an input axis picks up per radian of its tilt [deg/h], shape (n,), means over samples.

    ::

        upright      15.041 cos(lat) cos(direction + table angle)
        horizontal   15.041 (sin(lat) cos(direction) - cos(lat) sin(heading) sin(direction))
                     + 3600 cos(direction) table rate

    for a table whose axis is up: the Earth's rate and the table's, across the axis in the direction of the
    tilt, which the table carries round (`fogml.runs.attitude`). A vertical axis tilts to north at direction
    0 and table angle 0, a horizontal one upwards, and in azimuth at 90 deg. Where the attitude is not known
    the axis is taken for an upright one, and where the latitude is not, for one at 45 deg.
    """
    held = inputs.attitude
    across = held.tilted_to(direction_deg)
    picked = inputs.carried(earth_rate(inputs.facts), across)
    share, _, _ = turned(held.table, across, held.table)
    if share != 0.0:
        picked = picked + 3600.0 * share * inputs.turning_deg_s
    return np.asarray(picked) if np.ndim(picked) else np.full(len(inputs), picked)
