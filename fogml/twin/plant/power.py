"""The power that a unit turns into heat, and when it is on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fogml.errors import InputError
from fogml.runs.run import FloatArray

PowerWindows = tuple[tuple[float, float], ...]
"""When a unit is on: (from, to) [s] in time order, without overlap; infinite where long before or after."""
ALWAYS_ON: PowerWindows = ((-math.inf, math.inf),)


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
        if not (math.isfinite(self.time_constant_s) and self.time_constant_s > 0.0):
            raise InputError(f"self-heating: time constant is {self.time_constant_s:g} s; it must be > 0")

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
