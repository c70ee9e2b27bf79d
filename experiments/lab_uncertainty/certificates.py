"""Deviations of averages as certificates state them, against what they are in the mean of many runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import wilson
from experiments.lab_uncertainty.signals import Noise
from fogml.validation.certified import sample_deviation

CASES = {
    "white, 100 averages": (Noise(0.02), 100),
    "tactical, 20 averages": (Noise(0.02, 0.05, 0.05), 20),
    "tactical, 100 averages": (Noise(0.02, 0.05, 0.05), 100),
    "flicker, 100 averages": (Noise(0.001, 0.005), 100),
    "flicker, 400 averages": (Noise(0.001, 0.005), 400),
    "random walk, 100 averages": (Noise(0.001, 0.0, 0.05), 100),
}
AVERAGING_S = 10.0


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """The row of one case: the truth is the root mean square of all runs' deviations."""
    noise, count = CASES[name]
    values, ends = [], []
    for repeat in range(repeats):
        series = noise.draw(np.random.default_rng([seed, repeat]), 10 * count, 0.1 * AVERAGING_S)
        found = sample_deviation(series.reshape(count, 10).mean(axis=1))
        assert found is not None
        values.append(found.value)
        ends.append(found.ci90)
    truth = float(np.sqrt(np.mean(np.square(values))))
    held = sum(low <= truth <= high for low, high in ends)
    return [
        {
            "case": name,
            "quantity": "deviation of averages [deg/h]",
            "runs": repeats,
            "stated": repeats,
            "held": held / repeats,
            "wilson95": wilson(held, repeats),
            "mean_z": None,
            "rms_z": None,
            "rms_error": float(np.std(values)),
            "median_se": None,
        }
    ]
