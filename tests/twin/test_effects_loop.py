"""Effects of the closed loop against closed forms and plain integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.optics import REFERENCE_COIL, Coil
from fogml.twin.registry import effect


def loop(id: str) -> LoopEffect:
    found = effect(id)
    assert isinstance(found, LoopEffect)
    return found


def inputs(time: FloatArray, electronics: FloatArray | float = 25.0, **changes: object) -> Inputs:
    held = np.full(len(time), electronics, dtype=np.float64)
    given = Inputs(time, {"T_electronics": held}, np.zeros(len(time)))
    return replace(given, **changes)  # type: ignore[arg-type]


def test_loop_answers_a_step_of_the_rate_as_a_first_order_lag() -> None:
    time = np.linspace(0.0, 0.02, 20_001)
    step = np.where(time > 0.002, 36_000.0, 0.0)
    found = loop("loop_gain").apply(step, inputs(time), 1e-3, power_slope=-2.0, leak_time=1e12)
    after = time > 0.0021
    # Linear between samples, the edge lies in the middle of one.
    wanted = 36_000.0 * -np.expm1(-(time - 0.0020005) / 1e-3)
    assert found[after] == pytest.approx(wanted[after], rel=1e-5)


def test_a_leaking_integrator_has_a_finite_gain_that_goes_with_the_light() -> None:
    """eps = 1 / (1 + G_dc) with G_dc = leak_time / tau; 2 dB less light per 100 degC."""
    time = np.arange(2000.0)
    for electronics, light in ((25.0, 1.0), (75.0, 10 ** (-0.1))):
        found = loop("loop_gain").apply(
            np.full(2000, 3600.0), inputs(time, electronics), 1e-3, power_slope=-2.0, leak_time=1.0
        )
        gain = 1.0 / 1e-3 * light
        assert found[-1] == pytest.approx(3600.0 * (1.0 - 1.0 / (1.0 + gain)), rel=1e-12)


def test_loop_signature_is_the_small_delay_of_a_ramp() -> None:
    time = np.arange(100.0)
    given = inputs(time, 40.0, output=5.0 * time)
    shape = {"power_slope": -2.0, "leak_time": 1e12}
    found = loop("loop_gain").signature(given, **shape)
    assert found[1:] == pytest.approx(-5.0 * 10 ** (2.0 * 15.0 / 1000.0))


def test_soft_dead_zone_swallows_small_rates_and_shifts_large_ones() -> None:
    time = np.arange(2001.0)
    rate = np.linspace(-10.0, 10.0, 2001)
    found = loop("deadband").apply(rate, inputs(time), 0.5, width=0.5)
    near = np.abs(rate) < 0.05
    assert np.abs(found[near]).max() < 0.005 * 0.05 / 0.5
    far = rate > 5.0
    assert found[far] == pytest.approx(rate[far] - 0.5, abs=1e-6)
    assert found == pytest.approx(-found[::-1])
    assert np.all(np.diff(found) >= -1e-12)


def test_dead_zone_is_hidden_under_earth_rate() -> None:
    """With the axis upright at mid latitude it is one with the bias."""
    given = inputs(np.arange(10.0), output=np.full(10, 9.6))
    found = loop("deadband").signature(given, width=0.3)
    assert found == pytest.approx(-1.0, abs=1e-9)


def test_fringe_is_266_deg_s_of_the_reference_coil_and_inverse_to_its_area() -> None:
    assert REFERENCE_COIL.fringe_offset_deg_s == pytest.approx(266.0, abs=0.5)
    half = Coil(length=500.0)
    assert half.fringe_offset_deg_s == pytest.approx(2.0 * REFERENCE_COIL.fringe_offset_deg_s)


def test_fringe_jump_begins_within_a_sample_and_ends_with_a_power_cycle() -> None:
    time = 10.0 * np.arange(300.0)
    given = inputs(time, powered_on_s=0.0, power_ons_s=(2000.0,))
    found = loop("fringe_jump").signature(given, onset=997.0) / 3600.0
    assert not found[time < 1000.0].any()
    assert found[time == 1000.0] == pytest.approx(0.3)
    assert np.all(found[(time > 1000.0) & (time < 2000.0)] == 1.0)
    assert not found[(time >= 2000.0) & (time < 2990.0)].any()
    # Without a power-on the first sample counts, also from block to block.
    memory = Memory()
    late = inputs(time + 5000.0)
    pieces = [
        loop("fringe_jump").signature(
            replace(late, time=late.time[part], table_rate=late.table_rate[part], memory=memory), onset=997.0
        )
        for part in (slice(0, 70), slice(70, 300))
    ]
    assert np.concatenate(pieces)[:199] / 3600.0 == pytest.approx(found[:199])
