"""Synthetic chamber runs of any length for the benchmarks."""

from __future__ import annotations

import numpy as np

from experiments.synthetic_world import World, lag
from fogml.arrays import FloatArray
from fogml.runs.run import Run

_CYCLE_S = 36_000.0


def chamber_air(time: FloatArray) -> FloatArray:
    """Chamber temperature [degC]: ramps at 0.5, 1 and 2 degC/min between soaks, every ten hours."""
    knots = np.array([0.0, 1.0, 3.1, 4.6, 5.5, 6.5, 7.5, 8.5, 10.0]) * 3600.0
    levels = np.array([25.0, 25.0, -40.0, -40.0, 60.0, 60.0, 0.0, 0.0, 25.0])
    return np.interp(time % _CYCLE_S, knots, levels)


def chamber_run(samples: int, seed: int, sample_s: float = 1.0) -> Run:
    """A run with T_in and T_out through `chamber_air`, Gaussian sensor noise of 2 mdegC and gyro noise."""
    air = chamber_air(np.asarray(sample_s * np.arange(samples)))
    run, _ = World().run(air, sample_s, seed, "synthetic")
    rng = np.random.default_rng(seed + 1)
    noisy = {name: run.columns[name] + 0.002 * rng.standard_normal(samples) for name in ("T_in", "T_out")}
    return run.with_columns(**noisy)


def four_sensor_run(samples: int, seed: int) -> Run:
    """The same unit with coil sensors T1 ... T4 in place of T_in and T_out."""
    run = chamber_run(samples, seed)
    rng = np.random.default_rng(seed + 2)
    inner, outer = run.columns["T_in"], run.columns["T_out"]
    sensors = {"T1": inner, "T2": outer, "T3": lag(inner, 60.0, 1.0), "T4": lag(outer, 90.0, 1.0)}
    noisy = {name: x + 0.002 * rng.standard_normal(samples) for name, x in sensors.items()}
    return Run.from_columns("synthetic", run.facts, time=run.time, gyro=run.gyro, **noisy)
