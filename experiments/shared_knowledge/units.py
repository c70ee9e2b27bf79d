"""Units of a synthetic fleet, units like them, odd ones, and their runs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from experiments.synthetic_world import World, cycle
from fogml.runs.run import Run

SAMPLE_S = 5.0
TRAIN_RATE, TEST_RATE = 1.0, 0.8
"""Ramp rates of the chamber [degC/min]."""
MEAN = {"polynomial": (0.2, 4e-3, -3e-5, 4e-7), "rate": 0.12, "product": 1.5e-3}
SPREAD = {"polynomial": (0.1, 1e-3, 1e-5, 1e-7), "rate": 0.03, "product": 4e-4}
NOISE = 0.3
"""White noise of a sample [deg/h]."""


def unit(seed: int, far: float = 1.0) -> World:
    """A unit whose constants are drawn from a seed, `far` times as far from the mean."""
    draw = np.random.default_rng([seed, 11])
    polynomial = np.array(MEAN["polynomial"]) + far * np.array(SPREAD["polynomial"]) * draw.normal(size=4)
    return World(
        polynomial=tuple(polynomial),
        gradient=0.0,
        rate=MEAN["rate"] + far * SPREAD["rate"] * draw.normal(),
        product=MEAN["product"] + far * SPREAD["product"] * draw.normal(),
        noise=NOISE,
    )


@lru_cache(maxsize=8)
def run(world: World, seed: int, rate: float, hours: float | None = None) -> Run:
    """A run of one sensor, 25 -> -40 -> 60 -> 25 degC, cut to its first hours."""
    made, _ = world.run(cycle(rate, SAMPLE_S, hours), SAMPLE_S, seed, "run.csv")
    columns = {"time": made.time, "gyro": made.gyro, "T": made.columns["T_in"]}
    return Run("run.csv", columns, made.facts)


def constants(world: World) -> NDArray[np.float64]:
    """A unit's six constants in the order of `MEAN`."""
    return np.array([*world.polynomial, world.rate, world.product])
