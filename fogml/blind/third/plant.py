"""The thermal plant: ten masses between stirred air and a radiating wall, by Runge and Kutta's fourth order.

::

    C_i dT_i/dt = sum_j G_ij (T_j - T_i) + H_i |T_air - T_i|**(1/4) (T_air - T_i)
                  + R_i (T_wall**4 - T_i**4) + s_i P

Convection is that of a body whose own warmth stirs the air, with a floor for the chamber's fan.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray

NAMES = ("cover", "mount", "outer", "middle", "inner", "hub", "tray", "board", "optics", "source")
_KELVIN = 273.15
_FAN_DEGC = 3.0
"""A difference that the fan's air counts for, where the body's own warmth stirs less."""


@dataclass(frozen=True)
class PlantConstants:
    """What one unit's plant is made of.

    Attributes
    ----------
    joint_s
        Time constant of each joint of `JOINTS`, of its second mass behind its first [s].
    air_s
        Of cover and mount behind moved air [s].
    radiating
        Share of the cover's exchange at 25 degC that is radiation.
    warm
        How far the power warms the board above the tray in the end [degC].
    fade_s
        How fast the power settles after power-on, from `start` times its last value.
    """

    joint_s: tuple[float, ...]
    air_s: tuple[float, float]
    radiating: float
    warm: float
    start: float
    fade_s: float


_CAPACITIES = np.array([5.0, 12.0, 1.0, 1.0, 1.0, 2.0, 3.0, 1.0, 0.3, 0.15])
JOINTS = (
    ("cover", "outer"), ("outer", "middle"), ("middle", "inner"), ("inner", "hub"), ("mount", "hub"),
    ("mount", "tray"), ("tray", "board"), ("tray", "optics"), ("board", "source"), ("cover", "mount"),
)  # fmt: skip
"""Masses that touch each other."""


def draw_plant(rng: np.random.Generator, quick: bool = False) -> PlantConstants:
    """A unit's plant; a light one, that a shock gets into, where `quick`."""

    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    light = 0.25 if quick else 1.0
    ranges = [
        (100.0, 600.0), (25.0, 120.0), (25.0, 120.0), (80.0, 600.0), (400.0, 2500.0),
        (200.0, 1500.0), (150.0, 700.0), (150.0, 1200.0), (40.0, 200.0), (600.0, 4000.0),
    ]  # fmt: skip
    joints = [light * log(*ranges[0]), *(log(*bounds) for bounds in ranges[1:])]
    return PlantConstants(
        joint_s=tuple(joints),
        air_s=(light * log(250.0, 1300.0), log(1500.0, 5000.0)),
        radiating=float(rng.uniform(0.05, 0.4)),
        warm=log(3.0, 15.0),
        start=float(rng.uniform(0.6, 2.0)),
        fade_s=log(100.0, 1500.0),
    )


class Plant:
    """The masses of one unit."""

    def __init__(self, constants: PlantConstants) -> None:
        self.constants = c = constants
        count = len(NAMES)
        self.capacities = 100.0 * _CAPACITIES
        self.conductances = np.zeros((count, count))
        for (first, second), tau in zip(JOINTS, c.joint_s):
            i, j = NAMES.index(first), NAMES.index(second)
            self.conductances[i, j] = self.conductances[j, i] = self.capacities[j] / tau
        self.stirred, self.radiated = np.zeros(count), np.zeros(count)
        moved = _FAN_DEGC**0.25
        for name, tau, share in zip(("cover", "mount"), c.air_s, (c.radiating, 0.0)):
            i = NAMES.index(name)
            whole = self.capacities[i] / tau
            self.stirred[i] = (1.0 - share) * whole / moved
            self.radiated[i] = share * whole / (4.0 * 298.15**3)
        self.heated = np.zeros(count)
        self.heated[NAMES.index("board")], self.heated[NAMES.index("source")] = 0.8, 0.2
        g = self.conductances
        self._joined = (g - np.diag(g.sum(axis=1))) / self.capacities[:, None]
        self._heating = self.heated / self.capacities
        self._outside = [
            (i, float(self.stirred[i] / self.capacities[i]), float(self.radiated[i] / self.capacities[i]))
            for i in (NAMES.index("cover"), NAMES.index("mount"))
        ]
        self.power_w = c.warm * self.conductances[NAMES.index("board"), NAMES.index("tray")]

    def slope(self, state: FloatArray, air: float, wall: float, power: float) -> FloatArray:
        """Rates of all masses [degC/s], shape (masses,)."""
        flow = self._joined @ state + self._heating * power
        for i, stirred, radiated in self._outside:
            own = float(state[i])
            over = air - own
            gain = stirred * max(abs(over), _FAN_DEGC) ** 0.25 * over
            flow[i] += gain + radiated * ((wall + _KELVIN) ** 4 - (own + _KELVIN) ** 4)
        return np.asarray(flow)

    def temperatures(self, step_s: float, air: FloatArray, wall: FloatArray, power: FloatArray) -> FloatArray:
        """Temperatures [degC], shape (m, masses), inputs straight between steps; from rest at the first."""
        inputs = list(zip(air.tolist(), wall.tolist(), power.tolist()))
        out = np.empty((len(air), len(NAMES)))
        out[0] = state = self.rest(*inputs[0])
        for k, (start, end) in enumerate(pairwise(inputs), start=1):
            out[k] = state = runge_kutta(self.slope, state, step_s, start, end)
        return out

    def rest(self, air: float, wall: float, power: float) -> FloatArray:
        """Temperatures in steady state [degC], by Newton's rule."""
        state = np.full(len(NAMES), air)
        for _ in range(50):
            now = self.slope(state, air, wall, power)
            slope = np.stack(
                [(self.slope(state + e, air, wall, power) - now) / 1e-4 for e in 1e-4 * np.eye(len(state))],
                axis=1,
            )
            step = np.linalg.solve(slope, -now)
            state = state + step
            if np.abs(step).max() < 1e-10:
                break
        return state


def runge_kutta(
    slope: Callable[..., FloatArray],
    state: FloatArray,
    step: float,
    start: tuple[float, ...],
    end: tuple[float, ...],
) -> FloatArray:
    """One step of the classical rule, with inputs at its start and end, straight between."""
    middle = tuple(0.5 * (a + b) for a, b in zip(start, end))
    a = slope(state, *start)
    b = slope(state + (0.5 * step) * a, *middle)
    c = slope(state + (0.5 * step) * b, *middle)
    d = slope(state + step * c, *end)
    return np.asarray(state + (step / 6.0) * (a + 2.0 * (b + c) + d))
