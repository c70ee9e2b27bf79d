"""What heats a unit and what takes the heat away: its power, and how well the chamber's air reaches it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.quantities import check_all, limited

PowerWindows = tuple[tuple[float, float], ...]
"""When a unit is on: (from, to) [s] in time order, without overlap; infinite where long before or after."""
HEATING = (
    limited("steady", "W", 0.0, 1e3),
    limited("initial", "W", 0.0, 1e3),
    limited("time_constant", "s", 1.0, 1e6),
)
"""The constants of `SelfHeating` with their units."""
AIRFLOW = (limited("fan_gain", "1", 0.0, 100.0), limited("rotation_gain", "1", 0.0, 100.0))
"""The constants of `Airflow`."""
ALWAYS_ON: PowerWindows = ((-math.inf, math.inf),)


def windows_since(time: FloatArray, time_on: FloatArray) -> PowerWindows:
    """When the unit was on, from the time since power-on [s]; it went off a sample after the last one."""
    starts = np.concatenate([[0], np.flatnonzero(time_on[1:] < time_on[:-1]) + 1])
    ons = time[starts] - time_on[starts]
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    offs = [*np.minimum(time[starts[1:] - 1] + step, ons[1:]).tolist(), math.inf]
    return tuple(zip(ons.tolist(), offs))


@dataclass(frozen=True)
class SelfHeating:
    """Heat of the electronics from each power-on.

    ::

        P(t) = steady_w + (initial_w - steady_w) exp(-(t - t_on) / time_constant_s)

    Attributes
    ----------
    steady_w, initial_w
        Power when warm and right after power-on [W].
    time_constant_s
        How fast the one goes over into the other [s].
    node
        Where the heat appears.
    """

    steady_w: float = 0.0
    initial_w: float = 0.0
    time_constant_s: float = 1200.0
    node: str = "T_electronics"

    def __post_init__(self) -> None:
        for quantity, value in zip(HEATING, (self.steady_w, self.initial_w, self.time_constant_s)):
            quantity.check(value, "self-heating")

    @property
    def parts(self) -> tuple[float, float, float]:
        """Steady part [W], fading part [W] and fade rate [1/s]."""
        return self.steady_w, self.initial_w - self.steady_w, 1.0 / self.time_constant_s

    def power(self, time: FloatArray, powered: PowerWindows = ALWAYS_ON) -> FloatArray:
        """Power at each time [W], shape (n,); 0 where the unit is off."""
        power = np.zeros(len(time))
        steady, fading, fade_rate = self.parts
        for on, off in powered:
            first, last = np.searchsorted(time, [on, off])
            power[first:last] = steady + fading * np.exp(-fade_rate * (time[first:last] - on))
        return power


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

    def __post_init__(self) -> None:
        check_all(self, AIRFLOW, "airflow")

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
