"""Thresholds, bandwidths and scale factor errors of turns against true ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_errors, share
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, lagged
from fogml.arrays import FloatArray
from fogml.lab.rate_json import rate_json
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.validation.scale_factor import find_steps, scale_factor_error


@dataclass(frozen=True)
class SmallRates:
    """Rates about zero [deg/h] of a gyro whose output is short of any rate by `dead` [deg/h]; dwell [s]."""

    noise: Noise
    dead: float = 0.0
    dwell_s: float = 60.0
    rates: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Waves:
    """A table that oscillates at some frequencies [Hz] by 5 deg/s, and a gyro of first order."""

    noise: Noise
    bandwidth_hz: float = 60.0
    frequencies: tuple[float, ...] = (5.0, 10.0, 20.0, 40.0, 80.0)


@dataclass(frozen=True)
class Turns:
    """Turns by 10 deg/s each way, of a minute, between rests of ten; the lag [s] is behind commands."""

    noise: Noise
    turns: int = 5
    lag_s: float = 1e-3


CASES: dict[str, SmallRates | Waves | Turns] = {
    "small rates, no dead zone, tactical": SmallRates(TACTICAL),
    "small rates, no dead zone, navigation grade": SmallRates(NAVIGATION),
    "small rates, flicker": SmallRates(Noise(0.0005, 0.005), dwell_s=120.0),
    "small rates, dead zone of 0.15 deg/h": SmallRates(NAVIGATION, dead=0.15),
    "oscillations": Waves(TACTICAL),
    "oscillations, flicker": Waves(Noise(0.001, 0.2)),
    "5 turns": Turns(TACTICAL),
    "3 turns, navigation grade": Turns(NAVIGATION, turns=3),
    "5 turns, navigation grade, lag of 1 s": Turns(NAVIGATION, lag_s=1.0),
}


def _run(rate: FloatArray, gyro: FloatArray, noise: Noise, rng: np.random.Generator, step: float) -> Run:
    time = step * (np.arange(len(rate)) + 1.0)
    gyro = gyro + rng.normal(0.0, 0.5) + noise.draw(rng, len(rate), step)
    return Run("table", {"time": time, "rate": rate, "gyro": gyro}, Facts())


def _small(case: SmallRates, rng: np.random.Generator) -> bool:
    """Whether the threshold is within what is told of it."""
    sizes = np.array(case.rates)
    ladder = np.concatenate(([0.0], *([0.0, size, -size] for size in sizes), [0.0, 0.0, 0.0])) / 3600.0
    # Two large rates tell the scale factor.
    rate = np.repeat(np.concatenate((ladder, [10.0, -10.0])), round(case.dwell_s))
    acting = 3600.0 * rate
    gyro = np.sign(acting) * np.maximum(np.abs(acting) - case.dead, 0.0)
    told = rate_json([_run(rate, gyro, case.noise, rng, 1.0)], source="synthetic")["threshold"]
    if told is None:
        return False
    above, below = told["above_deg_h"] or 0.0, told["below_deg_h"] or np.inf
    return bool(not above < max(2.0 * case.dead, 1e-9) <= below)


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    case, wrong = CASES[name], 0
    told: list[Told | None] = []
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        if isinstance(case, SmallRates):
            wrong += _small(case, rng)
        elif isinstance(case, Waves):
            step = 1e-3
            time = step * np.arange(2000)
            waves = [5.0 * np.sin(2.0 * np.pi * f * time) for f in case.frequencies]
            rate = np.concatenate([part for wave in waves for part in (np.zeros(500), wave)])
            true = case.bandwidth_hz
            gyro = np.concatenate(
                [part for f in case.frequencies for part in (np.zeros(500), _first_order(f, true, time))]
            )
            found = rate_json([_run(rate, 3600.0 * gyro, case.noise, rng, step)], source="synthetic")
            band = found["bandwidth"]
            told.append(of_errors(band["first_order_hz"] - true, band["se"]))
        else:
            true = 20e-6 * rng.standard_normal()
            turn = np.concatenate((np.zeros(600), np.full(60, 10.0), np.full(60, -10.0)))
            rate = np.concatenate((*[turn] * case.turns, np.zeros(600)))
            run = _run(rate, 3600.0 * lagged(rate, 1.0, case.lag_s) * (1.0 + true), case.noise, rng, 1.0)
            steps = find_steps(run, np.ones(len(run), dtype=np.bool_))
            assert steps is not None
            error = scale_factor_error(steps, run.gyro_deg_h - 3600.0 * run.rate)
            told.append(Told(error.overall - 1e6 * true, error.half_width))
    if isinstance(case, SmallRates):
        return [share(name, "threshold not where it is told", wrong, repeats, 0.05)]
    return [coverage(name, "bandwidth [Hz]" if isinstance(case, Waves) else "scale factor error [ppm]", told)]


def _first_order(frequency_hz: float, bandwidth_hz: float, time: FloatArray) -> FloatArray:
    ratio = frequency_hz / bandwidth_hz
    phase = 2.0 * np.pi * frequency_hz * time - np.arctan(ratio)
    return np.asarray(5.0 * np.sin(phase) / np.sqrt(1.0 + ratio**2))
