"""Power-ons of a twin: what its bias and noise do to a seek, with and without a drift model of fogml."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

EAST = Facts(axis="x", latitude=30.0, input_axis="east", notes="synthetic: fogml.twin")
"""Of the simulated power-ons: no Earth rate, which is added for each position."""
COLUMNS = ("T_in", "T_out", "T_case", "T_electronics")


def unit(settings: dict[str, Any]) -> Twin:
    """The north seeker's gyro: white noise and a warm-up of the bias that no temperature node shows."""
    warm_up = dict(settings["warm_up"])
    return (
        Twin("north-seeker", sensors=Sensors(SensorErrors(noise=0.005, resolution=0.01)))
        .with_nominal(b0=0.05, b1=5e-4)
        .with_noise(N=settings["random_walk"])
        .with_effect("self_heating", 8.0)
        .with_effect("warmup_bias", warm_up.pop("amplitude"), **warm_up)
        .with_effect("turn_on_bias", 0.01)
    )


def power_on(twin: Twin, ambient: float, time_s: float, seed: int) -> Run:
    """A run from power-on at an ambient temperature [degC], the unit cold before."""
    programme = {
        "schema": "fogml.programme/1",
        "name": "power-on",
        "start_temperature": f"{ambient} degC",
        "power": "off",
        "steps": [{f"hold for {time_s} s": ["power on"]}],
    }
    return simulate(programme, twin, sample_s=1.0, seed=seed, columns=COLUMNS, facts=EAST).run


def trained(twin: Twin, settings: dict[str, Any]) -> DriftModel:
    """A drift model of fogml fitted on power-ons of its own at other ambients."""
    runs = [
        power_on(twin, ambient, settings["training_time"], settings["seed"] + 9000 + k)
        for k, ambient in enumerate(settings["training_ambients"])
    ]
    return make_model("polynomial", settings["features"]).fit(runs)


def cumulated(values: FloatArray) -> FloatArray:
    """Integrals of 1 Hz samples, one row per run, shape (r, n + 1)."""
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(values, axis=1)], axis=1)


def span_means(integrals: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Means over spans of time from power-on [s], shapes (r, n + 1), (m,), (m,) to (r, m)."""

    def at(time: FloatArray) -> FloatArray:
        whole = np.minimum(np.floor(time).astype(int), integrals.shape[1] - 2)
        share = time - whole
        return np.asarray((1.0 - share) * integrals[:, whole] + share * integrals[:, whole + 1])

    return np.asarray((at(end) - at(begin)) / (end - begin))
