"""The unit and the runs of the temperature-product experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.base import DriftModel
from fogml.runs.run import Run
from fogml.signals.averages import block_averages
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin


def unit(settings: Mapping[str, Any], product: float, **nominal: float) -> Twin:
    """Static bias with a ripple, a rate term, and T·dT of a size [deg/h per degC and degC/min]."""
    told = settings["unit"]
    sensors = Sensors(SensorErrors(noise=told["sensor_noise"], resolution=told["sensor_resolution"]))
    constants = {"b0": 0.05, "b1": 1e-3, "b2": 1e-5, **nominal}
    twin = (
        Twin("product", grade="navigation", sensors=sensors)
        .with_nominal(**constants)
        .with_noise(N=told["random_walk"])
        .with_effect("bias_polynomial", 0.03, quartic_ratio=0.0, quintic_ratio=0.0)
        .with_effect("shupe_mohr", told["rate_term"])
        .with_effect("polarization_nonreciprocity", told["ripple"])
    )
    return twin.with_effect("temperature_rate_product", product) if product else twin


def programme(rate: float, way: str) -> dict[str, Any]:
    """-10 to 40 degC at a rate [degC/h], an hour of rest at each end: ``up``, ``down`` or up and ``both``."""
    ends = {"up": (-10, 40), "down": (40, -10), "both": (-10, 40, -10)}[way]
    steps = [f"soak at {ends[0]} degC for 1 h"]
    for end in ends[1:]:
        steps += [f"ramp to {end} degC at {rate} degC/h", f"soak at {end} degC for 1 h"]
    return {"name": way, "start_temperature": f"{ends[0]} degC", "power": "on", "steps": steps}


@dataclass(frozen=True)
class Made:
    """A simulated run and its noise [deg/h], shape (n,)."""

    run: Run
    noise: FloatArray


def made(twin: Twin, rate: float, way: str, seed: int, sample_s: float = 1.0) -> Made:
    """A run with one sensor at the coil."""
    found = simulate(programme(rate, way), twin, sample_s=sample_s, seed=seed, columns=("T_in",), truth=True)
    assert found.truth is not None
    return Made(found.run, found.truth.noise)


def deviation(model: DriftModel, test: Made, averaging_s: float) -> dict[str, float]:
    """What a model leaves of a run [deg/h].

    ``rms`` and ``stability`` of averages, the latter being the rms where the mean is removed as in the
    patent; ``floor`` of the noise realised; ``own`` error against the noise-free truth, rms of samples.
    """
    evaluation = model.evaluate(test.run)
    full = evaluation.full
    left, noise = (test.run.error_deg_h - evaluation.drift)[full], test.noise[full]
    averages, quiet = block_averages(test.run.time[full], left, noise, window_s=averaging_s).values
    return {
        "rms": float(np.sqrt(np.mean(averages**2))),
        "stability": float(averages.std()),
        "floor": float(quiet.std()),
        "own": float(np.sqrt(np.mean((left - noise) ** 2))),
    }


def signal_to_noise(resolution: float, noise: float, rate: float = 10.0) -> float:
    """Step of a ramp [degC/h] over the noise of a first difference at 1 Hz, sensor as stated [degC]."""
    time = np.arange(5 * 3600.0)
    true = -10.0 + rate / 3600.0 * time
    seen = true + np.random.default_rng(0).normal(scale=noise, size=len(time))
    steps = np.diff(resolution * np.round(seen / resolution))
    return float(rate / 3600.0 / np.std(steps - rate / 3600.0))
