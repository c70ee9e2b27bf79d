"""What several effects ask of their inputs: the output's slope, the table's angle, unseen errors.

Each function takes the key of the effect that asks, so that no two share a state.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fogml.runs.facts import EARTH_RATE_DEG_H, Facts, Heading
from fogml.runs.run import FloatArray
from fogml.signals.sample_means import mean_cosine, with_whole_turns
from fogml.signals.waves import sine
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import DELTA, DELTA_WINDOW_S

_HEADINGS = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


def met_output(inputs: Inputs) -> FloatArray:
    """The output that the effect meets [deg/h], shape (n,); the input rate where none is given."""
    return inputs.input_rate_deg_h if inputs.output is None else inputs.output


def slope_per_s(inputs: Inputs, key: str, x: FloatArray) -> FloatArray:
    """Slope of x from the sample before to each sample [1/s], shape (n,); 0 at the first one."""
    step_x = x - inputs.memory.previous(f"{key} value", x)
    step_t = inputs.time - inputs.memory.previous(f"{key} time", inputs.time)
    return np.divide(step_x, step_t, out=np.zeros(len(x)), where=step_t > 0.0)


def table_cosine(inputs: Inputs, key: str, phase_deg: float, harmonic: float = 1.0) -> FloatArray:
    """cos(harmonic * table angle + phase), as the mean since the sample before; shape (n,).

    Of a recorded angle that begins anew after a turn the whole turns follow from the table's rate.
    """
    angle, time = inputs.angle_deg, inputs.time
    told = (time - inputs.memory.previous(f"{key} time", time)) * inputs.table_rate
    turned = with_whole_turns(angle - inputs.memory.previous(f"{key} angle", angle), told)
    after = np.radians(harmonic * angle + phase_deg)
    return mean_cosine(after - np.radians(harmonic * turned), after)


def line(inputs: Inputs, period_s: float, phase_deg: float) -> FloatArray:
    """sin(2 pi t / period + phase), shape (n,)."""
    return sine(inputs.time / period_s + phase_deg / 360.0)


def nominal_slope(inputs: Inputs, name: str = "T") -> FloatArray:
    """Change of the nominal output with a temperature [deg/h/degC], shape (n,); 0 where not given."""
    return inputs.slopes[name] if name in inputs.slopes else np.zeros(len(inputs))


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
        change = inputs.memory.difference(f"{key} unseen", inputs.time, held["T"], DELTA_WINDOW_S)
        total += inputs.slopes[DELTA] * change
    return total


def tilt_response(inputs: Inputs, key: str, direction_deg: float) -> FloatArray:
    """Rate that an input axis picks up per radian of its tilt [deg/h], shape (n,), means over samples.

    ::

        upright      15.041 cos(lat) cos(direction + table angle)
        horizontal   15.041 (sin(lat) cos(direction) - cos(lat) sin(heading) sin(direction))

    An upright axis is that of the table, which carries the tilt round from `direction`, north at table
    angle 0. A horizontal one tilts upwards at direction 0 and in azimuth at 90 deg; a recorded
    table angle turns its heading. An axis of unknown attitude is taken for an upright one at 45 deg of
    latitude.
    """
    facts = inputs.facts
    latitude = math.radians(45.0 if facts.latitude is None else facts.latitude)
    heading = heading_deg(facts)
    if heading is None or facts.latitude is None:
        return EARTH_RATE_DEG_H * math.cos(latitude) * table_cosine(inputs, key, direction_deg)
    direction = math.radians(direction_deg)
    upwards = math.sin(latitude) * math.cos(direction)
    sideways = math.cos(latitude) * math.sin(direction)
    if "angle" in inputs.drives:
        # sin(heading - angle) = cos(angle + 90 deg - heading)
        course = table_cosine(inputs, key, 90.0 - heading)
    else:
        course = np.full(len(inputs), math.sin(math.radians(heading)))
    return EARTH_RATE_DEG_H * (upwards - sideways * course)


def heading_change(inputs: Inputs) -> FloatArray | float:
    """Change of Earth rate with the heading [deg/h], shape (n,), where one is given; else 0."""
    if "heading" not in inputs.drives or inputs.facts.latitude is None:
        return 0.0
    horizontal = EARTH_RATE_DEG_H * np.cos(np.radians(inputs.facts.latitude))
    projected = horizontal * np.cos(np.radians(inputs.drives["heading"]))
    return np.asarray(projected - inputs.earth_deg_h)


def heading_deg(facts: Facts) -> float | None:
    """Heading of a horizontal input axis [deg clockwise from north]; None where it is not one."""
    if isinstance(facts.input_axis, Heading):
        return facts.input_axis.heading
    return _HEADINGS.get(facts.input_axis or "")
