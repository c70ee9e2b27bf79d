"""Noise floors of runs against true ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import share
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, lagged, thermometer
from fogml.arrays import FloatArray
from fogml.runs.run import Run
from fogml.validation.floors import floor_of_run


@dataclass(frozen=True)
class Chamber:
    """A run of some hours at a constant temperature, or of ramps that its drift follows; interval [s]."""

    noise: Noise
    ramps: bool = False
    hours: float = 4.0
    step_s: float = 1.0


CASES: dict[str, Chamber] = {
    "white, still": Chamber(Noise(0.02)),
    "tactical, still": Chamber(TACTICAL),
    "navigation grade, still": Chamber(NAVIGATION),
    "white, ramps": Chamber(Noise(0.02), ramps=True),
    "tactical, ramps": Chamber(TACTICAL, ramps=True),
    "navigation grade, ramps": Chamber(NAVIGATION, ramps=True),
    "tactical, ramps, 12 h": Chamber(TACTICAL, ramps=True, hours=12.0),
    "tactical, ramps, 0.1 Hz": Chamber(TACTICAL, ramps=True, step_s=10.0),
}
AVERAGING_S = (100.0, 600.0)
_TRUTHS = 200


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case: how often the floor at each averaging time is not in its interval."""
    case = CASES[name]
    count = round(3600.0 * case.hours / case.step_s)
    # Under ramps a random walk counts as drift.
    counted = replace(case.noise, K=0.0) if case.ramps else case.noise
    true = _floors(counted, count, case.step_s, seed)
    wrong = np.zeros(len(AVERAGING_S), dtype=np.int64)
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        time = case.step_s * np.arange(count)
        drift, temperature = np.zeros(count), np.full(count, 25.0)
        if case.ramps:
            chamber = _ramps(rng, time)
            outer = lagged(chamber, case.step_s, 120.0)
            temperature = lagged(chamber, case.step_s, 600.0)
            rate = 60.0 * np.gradient(temperature, case.step_s)
            drift = 0.03 * temperature - 4e-4 * temperature**2 + (0.8 + 0.01 * temperature) * rate
            drift += 0.1 * (temperature - outer)
        gyro = drift + case.noise.draw(rng, count, case.step_s)
        read = thermometer(rng, temperature, case.step_s, case.step_s, 1.0 / 16.0)
        run = Run("run", {"time": time, "gyro": gyro, "T": read})
        for place, (window_s, floor) in enumerate(zip(AVERAGING_S, true)):
            told = floor_of_run(run, np.ones(count, dtype=np.bool_), gyro, window_s)
            wrong[place] += not told.lower <= floor <= told.upper
    return [
        share(name, f"floor at {window_s:g} s not in its 90 % interval", int(part), repeats, 0.1)
        for window_s, part in zip(AVERAGING_S, wrong)
    ]


def _floors(noise: Noise, count: int, step_s: float, seed: int) -> list[float]:
    """Root mean square, over many draws, of the standard deviation of a run's averages [deg/h]."""
    squares = np.zeros(len(AVERAGING_S))
    for draw in range(_TRUTHS):
        values = noise.draw(np.random.default_rng([seed, 1, draw]), count, step_s)
        for place, window_s in enumerate(AVERAGING_S):
            rows = round(window_s / step_s)
            squares[place] += values[: count // rows * rows].reshape(-1, rows).mean(axis=1).var()
    return [float(floor) for floor in np.sqrt(squares / _TRUTHS)]


def _ramps(rng: np.random.Generator, time: FloatArray) -> FloatArray:
    """A chamber that soaks for 10 to 40 minutes and goes on at 0.7 to 2 degC/min [degC], shape (n,)."""
    at, temperature, now = [0.0], [25.0], 0.0
    while now < time[-1]:
        now += rng.uniform(600.0, 2400.0)
        following = rng.uniform(-35.0, 65.0)
        at += [now, now + 60.0 * abs(following - temperature[-1]) / rng.uniform(0.7, 2.0)]
        temperature += [temperature[-1], following]
        now = at[-1]
    return np.asarray(np.interp(time, at, temperature))
