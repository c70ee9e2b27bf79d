"""Effects of the closed loop against closed forms and plain integration."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.optics import REFERENCE_COIL, Coil
from fogml.twin.registry import effect
from fogml.twin.twin import Twin

FRINGE = 3600.0 * math.degrees(1550e-9 * 299_792_458.0 / (1000.0 * 0.1))
"""Rate of a fringe of the reference coil [deg/h], lambda c / (L D)."""


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


@pytest.mark.parametrize("width", [0.01, 0.5, 5.0])
def test_dead_zone_swallows_small_rates_and_leaves_large_ones_alone(width: float) -> None:
    rate = width * np.linspace(-20.0, 20.0, 4001)
    found = loop("deadband").apply(rate, inputs(np.arange(4001.0)), width)
    assert not found[np.abs(rate) < 0.999 * width].any()
    assert found == pytest.approx(-found[::-1], rel=1e-9, abs=1e-12)
    assert np.all(np.diff(found) >= 0.0)
    fast = np.array([36_000.0, -36_000.0])
    assert np.abs(loop("deadband").apply(fast, inputs(np.arange(2.0)), width) - fast).max() < 1e-4 * width


@pytest.mark.parametrize("rate", [1.0, 1.5, 6.0])
def test_dead_zone_is_the_mean_beat_rate_of_a_locked_oscillator(rate: float) -> None:
    """Adler's equation dpsi/dt = w - w_d sin(psi), integrated over many beats."""
    step, psi, zone = 1e-3, 0.0, 1.0

    def slope(x: float) -> float:
        return rate - zone * math.sin(x)

    for _ in range(200_000):
        middle = psi + 0.5 * step * slope(psi)
        psi += step * slope(middle)
    found = loop("deadband").apply(np.array([rate]), inputs(np.arange(1.0)), zone)
    assert found[0] == pytest.approx(psi / 200.0, abs=0.02)


def test_dead_zone_is_hidden_under_earth_rate() -> None:
    """With the axis upright at mid latitude there is nearly nothing of it, and what there is is constant."""
    given = inputs(np.arange(10.0), output=np.full(10, 9.6))
    found = loop("deadband").apply(given.output, given, 0.3) - given.output
    assert found == pytest.approx(-(0.3**2) / (2.0 * 9.6), rel=1e-3)


def test_fringe_is_266_deg_s_of_the_reference_coil_and_inverse_to_its_area() -> None:
    assert REFERENCE_COIL.fringe_offset_deg_s == pytest.approx(266.0, abs=0.5)
    half = Coil(length=500.0)
    assert half.fringe_offset_deg_s == pytest.approx(2.0 * REFERENCE_COIL.fringe_offset_deg_s)


def test_fringes_are_whole() -> None:
    quantity = effect("fringe_jump").amplitude
    rng = np.random.default_rng(0)
    drawn = np.array([quantity.draw(rng) for _ in range(50)])
    assert np.array_equal(drawn, np.rint(drawn)) and np.abs(drawn).min() >= 1.0
    with pytest.raises(InputError, match="a whole number is needed"):
        Twin().with_effect("fringe_jump", 1.5)


def test_fringe_jump_begins_within_a_sample_and_ends_with_a_power_cycle() -> None:
    time = 10.0 * np.arange(300.0)
    given = inputs(time, powered_on_s=0.0, power_ons_s=(2000.0,))
    found = loop("fringe_jump").signature(given, onset=997.0) / FRINGE
    assert not found[time < 1000.0].any()
    assert found[time == 1000.0] == pytest.approx(0.3)
    assert np.all(found[(time > 1000.0) & (time < 2000.0)] == 1.0)
    assert not found[(time >= 2000.0) & (time < 2990.0)].any()
    # A sample after a gap in which it happened is whole.
    left = (time < 900.0) | (time > 1200.0)
    gappy = replace(given, time=time[left], table_rate=given.table_rate[left])
    assert np.array_equal(loop("fringe_jump").signature(gappy, onset=997.0) / FRINGE, found[left])
    # Without a power-on the first sample counts, also from block to block.
    memory = Memory()
    late = inputs(time + 5000.0)
    pieces = [
        loop("fringe_jump").signature(
            replace(late, time=late.time[part], table_rate=late.table_rate[part], memory=memory), onset=997.0
        )
        for part in (slice(0, 70), slice(70, 300))
    ]
    assert np.concatenate(pieces)[:199] / FRINGE == pytest.approx(found[:199])
