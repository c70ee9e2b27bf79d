"""Thermally induced bias effects against closed forms and plain loops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.arrays import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import nominal_columns
from fogml.twin.optics import Coil
from fogml.twin.plant.standard import standard_network
from fogml.twin.registry import effect
from tests.play_operator import play

Node = Callable[[FloatArray], FloatArray]


def inputs(minutes: float, sample_s: float = 1.0, rate_window_s: float = 0.0, **nodes: Node) -> Inputs:
    """Inputs whose nodes are given as functions of time [s]."""
    time = np.arange(0.0, 60.0 * minutes, sample_s)
    temperatures = {name: node(time) for name, node in nodes.items()}
    return Inputs(time, temperatures, np.zeros(len(time)), rate_window_s=rate_window_s)


def response(id: str, given_inputs: Inputs, **shape: float) -> FloatArray:
    declared = effect(id)
    return declared.response(given_inputs, **{**declared.default_shape(), **shape})


def behind(lag_s: float, start_s: float = 0.0, stop_s: float = 1e9, rate: float = 1.0) -> Node:
    """A node that is a first-order lag behind a ramp between two times, in closed form."""

    def ramp(t: FloatArray) -> FloatArray:
        t = np.maximum(t, 0.0)
        return rate * (t - lag_s * (1.0 - np.exp(-t / lag_s))) / 60.0

    return lambda t: 25.0 + ramp(t - start_s) - ramp(t - stop_s)


class TestShupe:
    def test_pure_spikes_at_start_and_stop_and_is_gone_on_the_plateau(self) -> None:
        start, stop = 600.0, 6000.0
        nodes = {"T_out": behind(120.0, start, stop), "T_in": behind(240.0, start, stop)}
        found = response("shupe_pure", inputs(150, **nodes))
        # d/dt of the difference of the two lags: exp(-t/240) - exp(-t/120), at most 1/4 at 240 ln 2.
        assert found.max() == pytest.approx(0.25, abs=2e-3)
        assert found.argmax() == pytest.approx(start + 240.0 * np.log(2.0), abs=2.0)
        assert found.min() == pytest.approx(-0.25, abs=2e-3)
        assert np.abs(found[:600]).max() == 0.0
        assert np.abs(found[4000:6000]).max() < 1e-4

    def test_trim_has_a_plateau_of_the_worked_size(self) -> None:
        """1.05 deg/h a metre where the coil warms by 1 degC/min and the leads do not."""
        ramp = behind(1.0, 60.0)
        still = inputs(30, T=ramp, T_case=lambda t: 25.0 + 0.0 * t)
        assert response("shupe_trim", still)[-1] == pytest.approx(1.05, abs=5e-3)

    def test_a_rate_common_to_all_fibre_gives_nothing(self) -> None:
        ramp = behind(1.0, 60.0)
        for id in ("shupe_trim", "pigtail_shupe"):
            for nodes in ({}, {"T_leads": ramp}, {"T_case": ramp, "T_electronics": ramp}):
                assert np.abs(response(id, inputs(30, T=ramp, **nodes))).max() < 1e-9

    @pytest.mark.parametrize("length_ratio", [0.3, 3.0])
    def test_leads_are_shupes_integral_over_the_whole_fibre(self, length_ratio: float) -> None:
        """Own integration: both ends at their places' rates, all between at the coil's."""
        coil, first, second = Coil(length=800.0, diameter=0.08), 0.5, 0.5 * length_ratio
        rates = {"T_electronics": 2.0, "T_case": -0.7, "T": 0.4}
        given = inputs(30, **{n: lambda t, r=r: 25.0 + r * t / 60.0 for n, r in rates.items()})
        z = np.linspace(0.0, coil.length, 400_001)
        warming = np.where(z < first, 2.0, np.where(z > coil.length - second, -0.7, 0.4)) / 60.0
        integral = np.trapezoid((2.0 * z - coil.length) * warming, z)
        wanted = -coil.index * coil.phase_slope / (coil.length * coil.diameter) * integral
        found = 0.5 * response("pigtail_shupe", replace(given, coil=coil), length_ratio=length_ratio)
        assert np.radians(found[-1]) / 3600.0 == pytest.approx(wanted, rel=1e-2)

    def test_a_chamber_shows_leads_at_the_ends_of_its_ramps_alone(self) -> None:
        time = 10.0 * np.arange(4000)
        chamber = 25.0 + np.clip((time - 6000.0) / 60.0, 0.0, 400.0)
        nodes = standard_network().temperatures(time, chamber)
        given = Inputs(time, nodes, np.zeros(len(time)), rate_window_s=0.0)
        for id in ("shupe_trim", "pigtail_shupe"):
            found = np.abs(response(id, given))
            assert found[(time > 25_000.0) & (time < 30_000.0)].max() < 1e-3 * found.max()
            assert found[:600].max() < 1e-9 and found.max() > 0.05

    def test_mohr_lies_in_the_span_of_the_nominal_gyro_while_its_slope_is_constant(self) -> None:
        given = inputs(200, T=behind(300.0, 3000.0, 9000.0), rate_window_s=64.0)
        columns = np.column_stack(list(nominal_columns(given).values()))[:, 3:]
        for slope, inside in ((0.0, True), (0.02, False)):
            signature = response("shupe_mohr", given.afresh(), linear_coefficient=slope)
            left = signature - columns @ np.linalg.lstsq(columns, signature, rcond=None)[0]
            assert (np.linalg.norm(left) < 1e-6 * np.linalg.norm(signature)) == inside

    def test_mohr_grows_with_temperature(self) -> None:
        given = inputs(60, T=lambda t: -5.0 + t / 60.0)
        found = response("shupe_mohr", given, linear_coefficient=0.01, quadratic_coefficient=1e-3)
        u = given.time / 60.0 - 30.0
        assert found[1:] == pytest.approx(1.0 + 0.01 * u[1:] + 1e-3 * u[1:] ** 2, abs=1e-9)

    def test_product_changes_sign_at_25_degrees(self) -> None:
        given = inputs(60, T=lambda t: -5.0 + 2.0 * t / 60.0)
        found = response("temperature_rate_product", given)
        assert found[1:] == pytest.approx(2.0 * (given.time[1:] / 30.0 - 30.0), abs=1e-9)

    def test_leads_follow_their_nodes(self) -> None:
        both = {"T_electronics": lambda t: 3.0 * t / 60.0, "T_case": lambda t: 2.0 * t / 60.0}
        found = response("pigtail_shupe", inputs(10, T=lambda t: 25.0 + 0.0 * t, **both), length_ratio=0.5)
        assert found[1:] == pytest.approx(0.5 * 1.0486 * (3.0 - 0.5 * 2.0), rel=1e-3)

    def test_side_on_gradient_turns_with_the_table(self) -> None:
        nodes = {"T_out": behind(120.0), "T_in": behind(240.0)}
        still = inputs(20, **nodes)
        pure = response("shupe_pure", still.afresh())
        turned = replace(still.afresh(), cache={}, drives={"angle": np.full(1200, 200.0)})
        assert response("azimuthal_gradient", turned, phase=20.0) == pytest.approx(-pure)
        assert np.abs(response("azimuthal_gradient", turned, phase=110.0)).max() < 1e-12
        table = np.where(still.time < 180.0, 1.0, 0.0)  # 180 deg in three minutes
        spun = replace(still.afresh(), cache={}, table_rate=table)
        half = response("azimuthal_gradient", spun, phase=0.0)
        assert half[300:] == pytest.approx(np.cos(np.radians(179.5)) * pure[300:])


class TestGlassTransition:
    def at_rate(self, rate: float, **shape: float) -> tuple[FloatArray, FloatArray]:
        given = inputs(160.0 / rate, sample_s=1.0 / rate, T=lambda t: -80.0 + rate * t / 60.0)
        settings = {"transition_temperature": -20.0, "width": 5.0, "static_ratio": 0.0, **shape}
        return given.temperature(), response("glass_transition", given, **settings)

    def test_peak_is_the_rate_at_the_transition(self) -> None:
        temperature, found = self.at_rate(1.0)
        assert found.max() == pytest.approx(1.0, abs=1e-4)
        assert temperature[found.argmax()] == pytest.approx(-20.0, abs=0.05)
        half = temperature[found > 0.5 * found.max()]
        assert half[-1] - half[0] == pytest.approx(2.0 * 5.0 * np.arccosh(np.sqrt(2.0)), abs=0.1)

    def test_transition_moves_three_degrees_a_decade(self) -> None:
        temperature, found = self.at_rate(10.0)
        assert temperature[found.argmax()] == pytest.approx(-17.0, abs=0.2)

    def test_only_the_step_is_left_in_soaks(self) -> None:
        for held, wanted in ((-90.0, 0.0), (50.0, 0.1)):
            given = inputs(5, T=lambda t, held=held: np.full_like(t, held))
            found = response("glass_transition", given, transition_temperature=-20.0, static_ratio=0.1)
            assert found == pytest.approx(wanted, abs=1e-6)


def swing(period_min: float) -> Node:
    return lambda t: 25.0 + 50.0 * np.sin(2.0 * np.pi * t / 60.0 / period_min)


class TestHysteresis:
    def test_branches_are_two_amplitudes_apart_at_any_rate(self) -> None:
        for rate in (0.2, 5.0):
            period = 4.0 * 50.0 / rate
            given = inputs(2.0 * period, 60.0 * period / 4000.0, T=swing(period))
            found = response("thermal_hysteresis", given, half_width=9.0)
            u = given.u()
            rising = np.gradient(u) > 0.0
            second = given.time > 60.0 * period
            up = found[second & rising & (np.abs(u) < 0.5)]
            down = found[second & ~rising & (np.abs(u) < 0.5)]
            assert up == pytest.approx(-1.0) and down == pytest.approx(1.0)

    @settings(max_examples=50, deadline=None)
    @given(st.lists(st.floats(-60.0, 90.0), min_size=1, max_size=60), st.floats(0.1, 30.0))
    def test_it_is_the_play_operator(self, temperatures: list[float], half_width: float) -> None:
        x = np.array(temperatures)
        given = Inputs(np.arange(len(x), dtype=float), {"T": x}, np.zeros(len(x)))
        found = response("thermal_hysteresis", given, half_width=half_width)
        assert found == pytest.approx((play(x, half_width) - x) / half_width, abs=1e-9)

    def test_minor_loops_close(self) -> None:
        legs = [25.0, 60.0, 0.0, 60.0, 0.0]
        x = np.concatenate([np.linspace(a, b, 500) for a, b in pairwise(legs)])
        given = Inputs(np.arange(len(x), dtype=float), {"T": x}, np.zeros(len(x)))
        found = response("thermal_hysteresis", given, half_width=12.0)
        assert found[999] == pytest.approx(found[1999]) and found[499] == pytest.approx(found[1499])


class TestMemoryOfTheWinding:
    def test_relaxation_is_a_maxwell_tail_after_a_step(self) -> None:
        given = inputs(600, 10.0, T=lambda t: np.where(t < 600.0, 25.0, 35.0))
        found = response("stress_relaxation", given, time_constant=7200.0, slow_share=0.25)
        t = given.time[61:] - given.time[60]
        # At 35 degC both time constants are halved.
        tail = found[60] * (0.75 * np.exp(-t / 3600.0) + 0.25 * np.exp(-t / 18000.0))
        assert found[:60] == pytest.approx(0.0)
        assert found[60] == pytest.approx(10.0, rel=2e-3)
        assert found[61:] == pytest.approx(tail, rel=2e-3)

    def test_relaxation_solves_its_equation_in_a_ramp(self) -> None:
        given = inputs(300, 5.0, T=lambda t: -40.0 + t / 180.0)
        found = response("stress_relaxation", given, time_constant=1800.0, slow_share=0.0)
        q, wanted, step = 0.0, [], 5.0
        for temperature in given.temperature():
            wanted.append(q)
            tau = 1800.0 * 2.0 ** (-(temperature - 25.0) / 10.0)
            q += step * (1.0 / 180.0 - q / tau)
        assert found == pytest.approx(np.array(wanted), abs=0.01 * max(wanted))

    def test_relaxation_is_the_same_at_a_sample_a_minute(self) -> None:
        """Up to 85 degC, where stress relaxes 64 times as fast, beside steps of 1 s."""

        def warm(t: FloatArray) -> FloatArray:
            return np.interp(t, [600.0, 4200.0, 7800.0, 11400.0], [25.0, 85.0, 85.0, -5.0])

        shape = {"time_constant": 600.0, "slow_share": 0.3}
        fine = response("stress_relaxation", inputs(200, 1.0, T=warm), **shape)
        coarse = response("stress_relaxation", inputs(200, 60.0, T=warm), **shape)
        assert np.abs(coarse - fine[::60]).max() < 1e-3 * np.abs(fine).max()

    def test_slow_changes_cause_no_slips(self) -> None:
        given = inputs(100, T=lambda t: 25.0 + 4.9 * t / 60.0)
        assert not response("thermal_shock", given, threshold=5.0).any()

    def test_a_shock_slips_by_the_excess_and_creeps_back(self) -> None:
        given = inputs(100, T=lambda t: 25.0 - 8.0 * np.clip(t - 60.0, 0.0, 300.0) / 60.0)
        found = response("thermal_shock", given, threshold=5.0, time_constant=3600.0)
        # 3 degC/min of excess for 5 min, less what creeps back meanwhile.
        wanted = -3.0 * 60.0 * (1.0 - np.exp(-300.0 / 3600.0))
        assert found[360] == pytest.approx(wanted, rel=5e-3)
        assert found[3960] == pytest.approx(found[360] * np.exp(-1.0), rel=1e-3)

    def test_moisture_follows_a_step_of_humidity(self) -> None:
        time = np.arange(0.0, 3 * 86400.0, 60.0)
        humid = np.where(time < 3600.0, 50.0, 110.0)
        given = Inputs(time, {"T": np.full(len(time), 25.0)}, np.zeros(len(time)), drives={"humidity": humid})
        found = response("moisture", given, time_constant=36e3, static_ratio=0.05)
        t = time[60:] - 3600.0
        wanted = 6.0 * np.exp(-t / 36e3) + 0.05 * 60.0 * (1.0 - np.exp(-t / 36e3))
        assert found[60:] == pytest.approx(wanted, abs=0.02)
        assert found[:60] == pytest.approx(0.0)

    def test_moisture_step_of_the_catalogue_is_a_tenth_of_a_degree_per_hour(self) -> None:
        time = np.arange(0.0, 7200.0, 60.0)
        given = Inputs(time, {}, np.zeros(120), drives={"humidity": np.where(time > 0.0, 60.0, 0.0)})
        size = effect("moisture").amplitude.typical("tactical")
        peak = size * np.abs(response("moisture", given, time_constant=36e3, static_ratio=0.0)).max()
        assert 0.05 < peak < 0.2
