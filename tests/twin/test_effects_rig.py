"""Effects of rig and surroundings against geometry, closed forms and worked figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given as drawn
from hypothesis import settings
from hypothesis import strategies as st

from fogml.arrays import FloatArray
from fogml.runs.facts import EARTH_RATE_DEG_H, Facts, Heading
from fogml.signals.averages import mean_cosine
from fogml.twin.effects.rig import InputAxisMisalignment, scale_factor_loss_ppm
from fogml.twin.inputs import Inputs
from fogml.twin.registry import effect

N = 720
TIME = np.arange(float(N))
UP = Facts(latitude=30.0, input_axis="up")


def inputs(facts: Facts = UP, **changes: object) -> Inputs:
    still = {"T": np.full(N, 25.0)}
    given = Inputs(time=TIME, temperatures=still, table_rate=np.zeros(N), facts=facts)
    return replace(given, **changes)  # type: ignore[arg-type]


def signature(id: str, given: Inputs, **shape: float) -> FloatArray:
    declared = effect(id)
    return declared.signature(given, **{**declared.default_shape(), **shape})


def earth(latitude: float) -> FloatArray:
    """Earth rate as a vector to north, west and up [deg/h]."""
    phi = np.radians(latitude)
    return EARTH_RATE_DEG_H * np.array([np.cos(phi), 0.0, np.sin(phi)])


def test_tilt_of_a_milliradian_at_30_degrees_is_13_thousandths() -> None:
    """1 mrad is 1 urad/degC over 1000 degC, or a hundred over 10."""
    found = signature("mount_tilt", inputs(temperatures={"T_case": np.full(N, 35.0)}))
    assert 100.0 * found == pytest.approx(0.013026, rel=1e-4)


def test_tilt_changes_sign_when_the_fixture_is_yawed() -> None:
    hot = {"T_case": np.full(N, 60.0)}
    turned = inputs(temperatures=hot, drives={"angle": np.full(N, 180.0)})
    there = signature("mount_tilt", inputs(temperatures=hot), direction=25.0)
    assert signature("mount_tilt", turned, direction=25.0) == pytest.approx(-there)
    assert not signature("mount_tilt", inputs(), direction=25.0).any()


@pytest.mark.parametrize("heading", [0.0, 30.0, 90.0, 200.0])
def test_tilt_of_a_horizontal_axis_is_the_change_of_its_projection(heading: float) -> None:
    """Finite difference of the projection of Earth's vector on an axis that is turned by hand."""
    facts, angle, step = Facts(latitude=40.0, input_axis=Heading(heading=heading)), 50.0, 1e-6

    def projection(elevation: float, azimuth: float) -> float:
        psi = np.radians(heading - angle) + azimuth
        horizontal = np.array([np.cos(psi), -np.sin(psi), 0.0])
        axis = np.cos(elevation) * horizontal + np.sin(elevation) * np.array([0.0, 0.0, 1.0])
        return float(axis @ earth(40.0))

    given = inputs(facts, temperatures={"T_case": np.full(N, 26.0)}, drives={"angle": np.full(N, angle)})
    upwards = (projection(step, 0.0) - projection(-step, 0.0)) / (2.0 * step)
    sideways = (projection(0.0, step) - projection(0.0, -step)) / (2.0 * step)
    assert signature("mount_tilt", given, direction=0.0) == pytest.approx(1e-6 * upwards, rel=1e-6)
    assert signature("mount_tilt", given, direction=90.0) == pytest.approx(1e-6 * sideways, abs=1e-12)


def test_misalignment_of_five_milliradian_costs_12_5_ppm() -> None:
    assert scale_factor_loss_ppm(5.0) == pytest.approx(-12.5, rel=1e-5)
    assert scale_factor_loss_ppm(0.0) == 0.0


@pytest.mark.parametrize("delta", [0.5, 20.0, 300.0])
def test_misaligned_axis_sees_the_projection_of_all_rates(delta: float) -> None:
    """Against a vector that is turned with the table, sample by sample."""
    angle = np.linspace(0.0, 1080.0, N)
    rate = np.full(N, 3.0)
    given = inputs(table_rate=rate, drives={"angle": angle})
    tilt, psi = 1e-3 * delta, np.radians(40.0 + angle)
    axis = np.stack([np.sin(tilt) * np.cos(psi), np.sin(tilt) * np.sin(psi), np.full(N, np.cos(tilt))])
    wanted = axis[2] * (3600.0 * rate) + axis[0] * earth(30.0)[0] - 3600.0 * rate
    small = signature("input_axis_misalignment", given, direction=40.0)
    found = InputAxisMisalignment().added_rate(small, given, delta, direction=40.0)
    # Samples are means over 1.5 deg of turn each.
    assert found[1:] - wanted[1:] == pytest.approx(0.0, abs=0.02 * tilt * 15.0)


def test_wobble_is_once_a_turn_and_vanishes_over_whole_turns() -> None:
    turning = inputs(drives={"angle": np.linspace(0.0, 720.0, N + 1)[1:]}, table_rate=np.ones(N))
    found = signature("table_wobble", turning, phase=20.0)
    assert np.argmax(np.abs(np.fft.rfft(found))) == 2
    across = EARTH_RATE_DEG_H * np.cos(np.radians(30.0)) * np.radians(1.0 / 3600.0)
    assert np.abs(found).max() == pytest.approx(across, rel=1e-4)


def test_uneven_table_rate_has_its_harmonic_and_keeps_whole_turns() -> None:
    rate = 5.0
    turning = inputs(table_rate=np.full(N, rate), drives={"angle": rate * (TIME + 1.0)})
    found = signature("table_rate_error", turning, harmonic=3.0, phase=10.0)
    # Out of the integral of 1 ppm of the rate over the angle, sample by sample.
    edges = np.radians(3.0 * rate * np.arange(N + 1) + 10.0)
    wanted = np.diff(np.sin(edges)) / 3.0 / np.radians(1.0) * 3600e-6
    assert found[1:] == pytest.approx(wanted[1:], rel=1e-9, abs=1e-12)
    assert np.sum(found[24 : 24 + 72 * 9]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("rate", [0.3, -17.0, 77.0])
@pytest.mark.parametrize("record", ["whole", "anew after a turn", "none"])
def test_cosine_of_a_table_is_its_mean_however_fast_it_turns(rate: float, record: str) -> None:
    step = 10.0
    angle = rate * step * np.arange(N) + 30.0
    drives = {"whole": {"angle": angle}, "anew after a turn": {"angle": angle % 360.0}, "none": {}}[record]
    turning = inputs(time=step * np.arange(N), table_rate=np.full(N, rate), drives=drives)
    start = 30.0 if drives else 0.0
    edges = np.radians(rate * step * np.arange(N) + start - 70.0)
    found = turning.table_cosine(-70.0)
    assert found[1:] == pytest.approx(np.diff(np.sin(edges)) / np.radians(rate * step), abs=1e-9)


@pytest.mark.parametrize("rate", [4.0, -20.0])
def test_cosine_of_a_table_is_that_of_the_samples_that_are_left(rate: float) -> None:
    """A sample after lost ones is a mean over its own time, and so is one after a gap."""
    angle = rate * TIME
    kept = np.random.default_rng(2).random(N) > 0.3
    kept[300:330] = False
    turning = inputs(table_rate=np.full(N, rate), drives={"angle": angle})
    left = inputs(time=TIME[kept], table_rate=np.full(kept.sum(), rate), drives={"angle": angle[kept]})
    wanted = turning.table_cosine(20.0)[kept]
    assert left.table_cosine(20.0)[1:] == pytest.approx(wanted[1:], abs=1e-9)


@settings(max_examples=30, deadline=None)
@drawn(st.floats(-1e3, 1e3), st.floats(-50.0, 50.0))
def test_mean_of_a_cosine_is_its_integral(start: float, width: float) -> None:
    x = start + width * (np.arange(20_000) + 0.5) / 20_000
    found = mean_cosine(np.array([start]), np.array([start + width]))
    assert found == pytest.approx(np.cos(x).mean(), abs=1e-6)


def test_missing_earth_rate_is_one_with_the_nominal_bias() -> None:
    assert np.array_equal(signature("earth_rate", inputs()), np.ones(N))
    assert effect("earth_rate").amplitude.limits[1] == EARTH_RATE_DEG_H


def test_rectified_vibration_grows_with_its_square() -> None:
    found = signature("vibration_rectification", inputs(drives={"vibration": np.full(N, 0.3)}))
    assert found == pytest.approx(0.09)
    assert not signature("vibration_rectification", inputs()).any()


def test_pick_up_follows_the_machines_where_they_are_recorded() -> None:
    heater = (TIME > 300).astype(float)
    recorded = inputs(drives={"heater": heater, "compressor": 0.25 * (1.0 - heater)})
    assert np.array_equal(signature("chamber_pickup", recorded), heater + 0.25 * (1.0 - heater))
    own = signature("chamber_pickup", inputs(), period=120.0, phase=90.0)
    assert own == pytest.approx(0.5 + 0.5 * np.cos(2.0 * np.pi * TIME / 120.0))


def test_lines_have_their_alias_period_and_sound_stops_with_the_fan() -> None:
    for id in ("table_jitter", "acoustic"):
        found = signature(id, inputs(), alias_period=90.0)
        assert np.argmax(np.abs(np.fft.rfft(found))) == N // 90
    silent = inputs(drives={"fan": np.zeros(N)})
    assert not signature("acoustic", silent).any()
    assert np.abs(signature("table_jitter", silent)).max() > 0.9


def test_supply_drops_alike_for_both_directions() -> None:
    rates = np.array([0.0, 1.0, -1.0, 100.0, -100.0])
    given = Inputs(np.arange(5.0), {"T": np.zeros(5)}, rates)
    found = signature("cable_and_slip_ring", given, half_rate=1.0)
    assert found == pytest.approx([0.0, 0.5, 0.5, 100 / 101, 100 / 101])
