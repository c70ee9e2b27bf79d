"""Prediction intervals of drift models on runs that they have not seen, against plain truths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import of_runs
from experiments.lab_uncertainty.signals import TACTICAL, Noise, lagged, thermometer
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run


@dataclass(frozen=True)
class Training:
    """A model by name, the runs that it learns from, and how far the bias moves from run to run [deg/h].

    `rate` bounds the chamber's rates [degC/min].
    """

    model: str
    runs: int = 1
    moves: float = 0.0
    resolution: float = 1.0 / 64.0
    noise: Noise = TACTICAL
    rate: tuple[float, float] = (0.15, 0.3)


CASES = {
    "rbf, one run": Training("rbf"),
    "rbf, three runs, bias moves": Training("rbf", 3, 0.05),
    "rbf-patent, one run": Training("rbf-patent"),
    "multipoint-2-1, one run": Training("multipoint-2-1"),
    "polynomial, one run": Training("polynomial"),
    "polynomial, three runs, bias moves": Training("polynomial", 3, 0.05),
    "polynomial, one run, white noise": Training("polynomial", noise=Noise(0.02)),
    "polynomial, one run, flicker": Training("polynomial", noise=Noise(0.02, 0.05)),
    "polynomial, one run, one rate": Training("polynomial", rate=(0.2, 0.2)),
    "mixed-effects, one run": Training("mixed-effects"),
    "mixed-effects, one run, white noise": Training("mixed-effects", noise=Noise(0.02)),
    "auto, one run": Training("auto"),
    "auto, one run, white noise": Training("auto", noise=Noise(0.02)),
    "auto, one run, one rate": Training("auto", rate=(0.2, 0.2)),
}


def recorded(case: Training, size: Any, rng: np.random.Generator, number: int) -> Run:
    """A run up and down at a rate of its own, with the bias of a gyro of `size`, moved by chance."""
    step = 10.0
    low, high, rate = -10.0, 50.0, rng.uniform(*case.rate)
    ramp = round((high - low) / rate * 60.0 / step)
    soak = round(3600.0 / step)
    chamber = np.concatenate(
        [np.full(soak, low), np.linspace(low, high, ramp), np.full(soak, high), np.linspace(high, low, ramp)]
    )
    coil = lagged(chamber, step, 600.0)
    outer = lagged(chamber, step, 200.0)
    change = np.gradient(coil, step / 60.0)
    scaled = (coil - 20.0) / 30.0
    bias = size[0] * scaled + size[1] * scaled**2 + size[2] * np.sin(3.0 * scaled)
    bias = bias + (size[3] + size[4] * scaled) * change + case.moves * rng.standard_normal()
    gyro = bias + case.noise.draw(rng, len(bias), step)
    columns = {"time": step * (np.arange(len(bias)) + 1.0), "gyro": gyro}
    names = ("T1", "T2", "T3", "T4") if case.model.startswith("multi") else ("T_in", "T_out")
    seen = (coil, outer) if len(names) == 2 else (coil, outer, 0.7 * coil + 0.3 * outer, chamber)
    for name, values in zip(names, seen, strict=True):
        columns[name] = thermometer(rng, values, step, 1e-3, case.resolution)
    return Run(f"run {number}", columns, Facts(unit="U", axis="z", latitude=0.0, input_axis="up"))


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """The row of one case: mean share of a run's averages in the 90 % interval, and its scatter over runs."""
    case, shares = CASES[name], []
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        size = np.array([0.3, 0.2, 0.1, 0.3, 0.1]) * rng.standard_normal(5)
        runs = [recorded(case, size, rng, number) for number in range(case.runs + 1)]
        model = make_model(case.model).fit(runs[:-1])
        shares.append(share_within(model, runs[-1]))
    return [of_runs(name, "averages on another run", shares)]


def share_within(model: DriftModel, test: Run) -> float:
    """Share of a run's averages, over the time that is stated, that lie within their 90 % intervals."""
    found = model.evaluate(test)
    width = max(1, round(model.intervals_.averaging_s / float(np.median(np.diff(test.time)))))
    rows = len(test) // width * width
    left = (test.error_deg_h - found.drift)[:rows].reshape(-1, width).mean(axis=1)
    half = model.intervals_.half_width(0.9, found.excess)[:rows].reshape(-1, width).mean(axis=1)
    whole = found.full[:rows].reshape(-1, width).all(axis=1)
    return float(np.mean(np.abs(left[whole]) <= half[whole]))
