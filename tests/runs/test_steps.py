"""Rounding to a sensor's steps, against decimal arithmetic."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fogml.runs.steps import reading_noise, recorded_step, to_steps

READINGS = st.floats(-60.0, 90.0)


@given(READINGS, st.sampled_from(["0.1", "0.01", "0.001", "0.0625", "0.5"]))
def test_readings_are_the_nearest_decimals(reading: float, step: str):
    (rounded,) = to_steps(np.array([reading]), float(step))
    whole = (Decimal(reading) / Decimal(step)).to_integral_value(ROUND_HALF_EVEN)
    # The division may fall on the other side of half a step; the result is a decimal all the same.
    assert rounded in {float((whole + more) * Decimal(step)) for more in (-1, 0, 1)}
    assert abs(rounded - reading) <= 0.5 * float(step) * (1.0 + 1e-9)
    assert len(repr(abs(float(rounded))).split(".")[1]) <= len(step.split(".")[1])


@given(READINGS, st.floats(1e-3, 2.0))
def test_any_other_step_is_a_multiple_too(reading: float, step: float):
    (rounded,) = to_steps(np.array([reading]), step)
    assert rounded / step == pytest.approx(round(rounded / step), abs=1e-9)
    assert abs(rounded - reading) <= 0.5 * step * (1.0 + 1e-6)


def test_the_step_is_found_again():
    readings = to_steps(np.linspace(20.0, 31.0, 700), 0.01)
    assert recorded_step(readings) == pytest.approx(0.01)


def test_noise_of_readings_is_that_of_white_noise_on_a_ramp():
    noise = np.random.default_rng(2).standard_normal(40_000)
    assert reading_noise(np.linspace(-40.0, 60.0, 40_000) + 0.02 * noise) == pytest.approx(0.02, rel=0.02)
    # Of steps wider than the noise the step tells: its width over the root of 12.
    assert reading_noise(to_steps(np.linspace(20.0, 30.0, 40_000), 0.1)) == pytest.approx(0.1 / 12**0.5)
