"""Training runs of which one holds little of what another runs through: none of it does harm."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run

STEP_S = 60.0
RNG = np.random.default_rng(8)


def recorded(name: str, temperature: np.ndarray) -> Run:
    """A gyro of cubic drift in white noise, at recorded temperatures."""
    scaled = (temperature - 20.0) / 40.0
    gyro = scaled - 0.6 * scaled**2 + 0.3 * scaled**3 + 0.03 * RNG.standard_normal(len(scaled))
    columns = {"time": STEP_S * np.arange(len(scaled)), "gyro": gyro}
    columns["T"] = temperature + 0.01 * RNG.standard_normal(len(scaled))
    return Run(name, columns, Facts(unit="U", axis="z", latitude=0.0, input_axis="up"))


def cycle(low: float, high: float, hours: float = 6.0) -> np.ndarray:
    time = np.arange(0.0, hours * 3600.0, STEP_S)
    wave = np.sin(2.0 * np.pi * time / (0.5 * hours * 3600.0))
    return 0.5 * (low + high) + 0.5 * (high - low) * wave


CYCLE, TEST = recorded("cycle", cycle(-20.0, 60.0)), recorded("test", cycle(-15.0, 55.0, 5.0))
BESIDE = {
    "at one temperature": recorded("static", np.full(60, 25.0)),
    "a short ramp": recorded("short", np.linspace(10.0, 22.0, 30)),
}


def left(model: str, runs: list[Run]) -> tuple[float, float]:
    """Rms left on the test run and half-width of the 90 % interval [deg/h]."""
    fitted = make_model(model).fit(runs)
    error = TEST.error_deg_h - fitted.predict(TEST)
    return float(np.sqrt(np.mean(error**2))), float(fitted.intervals_.half_width(0.9))


@pytest.mark.parametrize("beside", BESIDE)
@pytest.mark.parametrize("model", ["auto", "mixed-effects", "polynomial"])
def test_a_run_that_holds_little_does_not_undo_a_cycle(model: str, beside: str) -> None:
    alone, half_alone = left(model, [CYCLE])
    both, half_both = left(model, [CYCLE, BESIDE[beside]])
    assert both < 1.1 * alone
    assert half_both < 2.0 * half_alone
