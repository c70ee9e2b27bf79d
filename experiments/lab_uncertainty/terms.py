"""Noise terms of a run against true ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import share
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise
from fogml.runs.noise_of_run import noise_report
from fogml.runs.run import Run

_ARCSEC_URAD = np.pi / 180.0 / 3600.0 * 1e6


@dataclass(frozen=True)
class Still:
    """A still gyro for some hours, at a sample interval [s]; a ramp [deg/h/h], rows lost in pauses."""

    noise: Noise
    hours: float = 4.0
    step_s: float = 1.0
    ramp: float = 0.0
    pauses: int = 0


COUNTS = Noise(0.001, 0.002, 0.005, count_arcsec=0.01)
CASES: dict[str, Still] = {
    "white, 4 h": Still(Noise(0.02)),
    "white, 5 s apart, 12 h": Still(Noise(0.02), hours=12.0, step_s=5.0),
    "white and ramp, 4 h": Still(Noise(0.02), ramp=0.5),
    "tactical, 4 h": Still(TACTICAL),
    "tactical, 4 h, 6 pauses": Still(TACTICAL, pauses=6),
    "tactical, 10 Hz, 1 h": Still(TACTICAL, hours=1.0, step_s=0.1),
    "tactical, a sample a minute, 10 days": Still(TACTICAL, hours=240.0, step_s=60.0),
    "tactical and ramp, 4 h": Still(TACTICAL, ramp=0.5),
    "random walk, 1 h": Still(Noise(0.02, K=0.3), hours=1.0),
    "navigation grade, 24 h": Still(NAVIGATION, hours=24.0),
    "navigation grade, 10 Hz, 4 h": Still(NAVIGATION, step_s=0.1),
    "navigation grade, 100 Hz, 10 min, counts of 0.01 arcsec": Still(COUNTS, hours=1.0 / 6.0, step_s=0.01),
}


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case: how often each term is not in its interval."""
    case = CASES[name]
    noise, count = case.noise, round(3600.0 * case.hours / case.step_s)
    true = {"N": noise.N, "B": noise.B, "K": noise.K, "R": case.ramp}
    if noise.count_arcsec > 0.0:
        true["Q"] = noise.count_arcsec / np.sqrt(12.0) * _ARCSEC_URAD
    wrong = dict.fromkeys(true, 0)
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        time = case.step_s * np.arange(count)
        rate = rng.uniform(-10.0, 10.0) + noise.draw(rng, count, case.step_s) + case.ramp * time / 3600.0
        kept = np.ones(count, dtype=np.bool_)
        for _ in range(case.pauses):
            start = int(rng.integers(0, count - 600))
            kept[start : start + int(rng.integers(5, 600))] = False
        gyro = noise.counted(rate, case.step_s)[kept]
        told = noise_report(Run("still", {"time": time[kept], "gyro": gyro}))["terms"]
        for term, value in true.items():
            low, high = told[term]["ci"]
            wrong[term] += not low <= value <= high
    return [share(name, f"{term} not in its 90 % interval", wrong[term], repeats, 0.1) for term in true]
