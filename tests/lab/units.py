"""A unit whose bias, hysteresis and scale factor are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.runs.facts import Facts
from fogml.runs.run import Run

EARTH = 15.041067 * np.sin(np.radians(39.9))
SOAKS = (-40.0, -10.0, 25.0, 60.0, 25.0, -10.0, -40.0)
STEP_S, SOAK_S, TURN_S = 5.0, 5400.0, 100.0


@dataclass(frozen=True)
class Unit:
    """What a unit is made of: bias at 25 degC and its slope, loop, scale factor at 25 degC and its slope."""

    bias: float = 0.05
    slope: float = 0.002
    loop: float = 0.03
    scale_ppm: float = 120.0
    scale_slope_ppm: float = 4.0
    noise: float = 0.001

    def run(self, name: str = "cycle", seed: int = 0, rates: tuple[float, ...] = (10, -10, 60, -60)) -> Run:
        """A cycle over the soaks; in each the table turns, one sense after the other."""
        parts, before = [], SOAKS[0]
        for number, soak in enumerate(SOAKS):
            ramp = int(abs(soak - before) * 60.0 / STEP_S)
            stay = int(SOAK_S / STEP_S)
            way = float(np.sign(soak - before))
            rate = np.zeros(stay)
            for place, value in enumerate(rates):
                start = int((3000.0 + 2.0 * place * TURN_S) / STEP_S)
                rate[start : start + int(TURN_S / STEP_S)] = value
            temperature = np.append(np.linspace(before, soak, ramp, endpoint=False), np.full(stay, soak))
            parts.append((temperature, np.append(np.zeros(ramp), rate), np.full(ramp + stay, way)))
            before = soak
            assert number or ramp == 0
        temperature, rate, way = (np.concatenate(part) for part in zip(*parts, strict=True))
        random = np.random.default_rng(seed)
        off = temperature - 25.0
        bias = self.bias + self.slope * off + 0.5 * self.loop * way
        scale = 1.0 + 1e-6 * (self.scale_ppm + self.scale_slope_ppm * off)
        gyro = 3600.0 * rate * scale + EARTH + bias + self.noise * random.standard_normal(len(off))
        facts = Facts(unit="FOG-0417", axis="z", latitude=39.9, input_axis="up")
        time = STEP_S * np.arange(len(off))
        return Run.from_columns(name, facts, time=time, gyro=gyro, T=temperature, rate=rate)


def row(values, key):
    (found,) = [one for one in values["rows"] if one["quantity"] == key]
    return found
