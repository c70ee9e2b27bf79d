"""Deviations as certificates and acceptance reports state them, against what they are in the mean of many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import share, wilson
from experiments.lab_uncertainty.signals import Noise
from fogml.signals.averages import freedom_of_deviation
from fogml.signals.distributions import chi2_cdf, deviation_within
from fogml.validation.certified import sample_deviation


@dataclass(frozen=True)
class Averages:
    """So many averages of a run under a noise; or as many runs' biases, for their repeatability."""

    noise: Noise
    count: int
    of_runs: bool = False


CASES = {
    "white, 100 averages": Averages(Noise(0.02), 100),
    "tactical, 20 averages": Averages(Noise(0.02, 0.05, 0.05), 20),
    "tactical, 100 averages": Averages(Noise(0.02, 0.05, 0.05), 100),
    "flicker, 100 averages": Averages(Noise(0.001, 0.005), 100),
    "flicker, 400 averages": Averages(Noise(0.001, 0.005), 400),
    "random walk, 100 averages": Averages(Noise(0.001, 0.0, 0.05), 100),
    "6 runs": Averages(Noise(0.02), 6, of_runs=True),
    "6 runs, bias wanders as flicker": Averages(Noise(0.0, 0.05), 6, of_runs=True),
    "6 runs, bias wanders as a walk": Averages(Noise(0.0, 0.0, 0.05), 6, of_runs=True),
}
AVERAGING_S = 10.0
MISSED = (1.0, 1.1, 1.3)
"""Deviations over the limit."""


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case: the truth is the root mean square of all runs' deviations."""
    case = CASES[name]
    values, ends, freedoms = [], [], []
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        if case.of_runs:
            # A bias a day; what is slower than all runs moves none from the others.
            own = 10.0 * case.noise.draw(rng, case.count, 86400.0)
            value, freedom = float(np.std(own, ddof=1)), case.count - 1.0
            within = deviation_within(value, freedom)
        else:
            series = case.noise.draw(rng, 10 * case.count, 0.1 * AVERAGING_S)
            means = series.reshape(case.count, 10).mean(axis=1)
            found = sample_deviation(means)
            assert found is not None
            value, within, freedom = found.value, found.ci90, freedom_of_deviation(means)
        values.append(value)
        ends.append(within)
        freedoms.append(freedom)
    truth = float(np.sqrt(np.mean(np.square(values))))
    held = sum(low <= truth <= high for low, high in ends)
    quantity = "repeatability [deg/h]" if case.of_runs else "deviation of averages [deg/h]"
    row = {
        "case": name,
        "quantity": quantity,
        "runs": repeats,
        "stated": repeats,
        "held": held / repeats,
        "wilson95": wilson(held, repeats),
        "mean_z": None,
        "rms_z": None,
        "rms_error": float(np.std(values)),
        "median_se": None,
    }
    passed = [
        share(
            name,
            f"passes a limit {times:g} times under it",
            sum(times * value <= truth for value in values),
            repeats,
            float(np.mean(chi2_cdf(np.array(freedoms) / times**2, freedoms))),
        )
        for times in MISSED
    ]
    return [row, *passed]
