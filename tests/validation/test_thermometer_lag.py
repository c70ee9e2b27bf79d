"""A drift that follows its thermometer late: told, with an interval that holds; no other drift is."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from fogml.runs.run import Run
from fogml.validation.thermometer_lag import lag_note
from tests.play_operator import play

STEP_S = 20.0
CASE_S, COIL_S = 240.0, 420.0


def lagged(x: np.ndarray, tau_s: float) -> np.ndarray:
    """First-order lag of what is held from sample to sample."""
    keep = np.exp(-STEP_S / tau_s)
    return lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0]


def chamber(rate: float, *ends: tuple[float, float]) -> np.ndarray:
    """Ramps at a rate [degC/min] to each temperature, with a soak [min] there."""
    parts, last = [np.full(90, 25.0)], 25.0
    for end, soak in ends:
        parts.append(np.linspace(last, end, int(abs(end - last) / rate * 60.0 / STEP_S)))
        parts.append(np.full(int(soak * 60.0 / STEP_S), end))
        last = end
    return np.concatenate(parts)


Drift = Callable[[np.ndarray, np.ndarray], np.ndarray]


def recorded(seed: int, drift: Drift, at: str) -> Run:
    """A run whose thermometer is on the case or at the coil; white noise and a random walk, own shift."""
    rng = np.random.default_rng(seed)
    air = (
        chamber(1.0, (-40.0, 90.0), (60.0, 90.0), (25.0, 45.0))
        if seed % 2
        else chamber(0.7, (55.0, 80.0), (-35.0, 80.0), (25.0, 40.0))
    )
    case = lagged(air, CASE_S)
    coil = lagged(case, COIL_S)
    noise = 0.05 * rng.standard_normal(len(air)) + 1.5e-4 * np.cumsum(rng.standard_normal(len(air)))
    columns = {
        "time": STEP_S * np.arange(len(air)),
        "gyro": 0.3 + 0.02 * rng.standard_normal() + drift(case, coil) + noise,
        "T": (case if at == "case" else coil) + 0.01 * rng.standard_normal(len(air)),
    }
    return Run(f"run {seed}", columns)


def told(count: int, drift: Drift, at: str) -> list[str]:
    notes = (
        lag_note([recorded(2 * i + 1, drift, at)], [recorded(2 * i + 2, drift, at)]) for i in range(count)
    )
    return [note for note in notes if note is not None]


@pytest.mark.parametrize("bend", [0.0, 1e-4])
def test_a_thermometer_on_the_case_is_told_with_its_lag(bend: float) -> None:
    notes = told(16, lambda case, coil: 0.02 * (coil - 25.0) + bend * (coil - 25.0) ** 2, "case")
    found = [re.search(r"lag of (\d+) s \((\d+) to (\d+), 90 %\)", note) for note in notes]
    ends = np.array([[float(n) for n in match.groups()] for match in found if match])
    # What is held from sample to sample comes half a sample late.
    truth = COIL_S - STEP_S / 2.0
    assert len(ends) >= 14 and abs(ends[:, 0].mean() - truth) < 12.0
    assert np.count_nonzero((ends[:, 1] <= truth) & (truth <= ends[:, 2])) >= 10


@pytest.mark.parametrize(
    ("drift", "at"),
    [
        (lambda case, coil: 0.02 * (coil - 25.0) + 1e-4 * (coil - 25.0) ** 2, "coil"),
        (lambda case, coil: 0.01 * (coil - 25.0) + 0.06 * (case - coil), "coil"),
        (lambda case, coil: 0.01 * (case - 25.0) + 0.05 * (case - coil), "case"),
        (lambda case, coil: 0.02 * (case - 25.0) - 0.01 * (case - coil), "case"),
        (lambda case, coil: 0.02 * (play(coil, 6.0) - 25.0), "coil"),
        (lambda case, coil: 0.01 * coil + 0.3 / (1.0 + np.exp(-(play(coil, 4.0) - 35.0) / 2.0)), "coil"),
        (lambda case, coil: np.zeros_like(coil), "coil"),
    ],
    ids=["cubic", "gradient", "gradient from the case", "half of it", "hysteresis", "step", "nothing"],
)
def test_another_drift_is_no_lag(drift: Drift, at: str) -> None:
    assert told(8, drift, at) == []


def test_runs_without_a_temperature_tell_none() -> None:
    run = Run("no temperature", {"time": np.arange(500.0), "gyro": np.zeros(500)})
    assert lag_note([run], [run]) is None


def test_an_output_that_stands_still_follows_no_thermometer() -> None:
    """A dead gyro's training ended with words on a noise model; its verdict says what is wrong."""
    temperature = chamber(1.0, (-40.0, 90.0), (60.0, 90.0), (25.0, 45.0))
    time = STEP_S * np.arange(len(temperature))
    dead = Run.from_columns("dead", time=time, gyro=np.full(len(time), 10.0), T=temperature)
    assert lag_note([dead], [dead]) is None
