"""Effects of the thermal plant against closed forms and energy balance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.plant.standard import standard_network
from fogml.twin.registry import effect

TIME = np.arange(0.0, 86_400.0, 10.0)
PLANT = standard_network()


def thermal(id: str) -> ThermalEffect:
    found = effect(id)
    assert isinstance(found, ThermalEffect)
    return found


def inputs(chamber: FloatArray, **changes: object) -> Inputs:
    given = Inputs(TIME, {"T_chamber": chamber, "T": chamber}, np.zeros(len(TIME)))
    return replace(given, **changes)  # type: ignore[arg-type]


def test_scaled_capacities_scale_every_delay() -> None:
    slower = thermal("thermal_network").change_plant(PLANT, 0.25)
    before, after = PLANT.ramp_lags_s(), slower.ramp_lags_s()
    assert {name: 1.25 * lag for name, lag in before.items()} == pytest.approx(after)


def test_self_heating_ends_at_its_rise_and_begins_with_its_ratio() -> None:
    heated = thermal("self_heating").change_plant(PLANT, 12.0, initial_ratio=1.5, time_constant=900.0)
    still = np.full(len(TIME), 20.0)
    on = heated.temperatures(TIME, still, powered=((0.0, np.inf),))
    assert on["T_electronics"][0] == pytest.approx(20.0)
    assert on["T_electronics"][-1] == pytest.approx(32.0, abs=1e-3)
    assert on["T_in"][-1] > 20.5
    # In the first second all heat stays in the electronics.
    quick = heated.temperatures(np.array([0.0, 1.0]), still[:2], powered=((0.0, np.inf),))
    power = 1.5 * 12.0 / PLANT.steady_rises()["T_electronics"]
    rise = quick["T_electronics"][1] - 20.0
    assert rise == pytest.approx(power / PLANT.capacities["T_electronics"], rel=0.01)


def test_heat_comes_from_the_hub_against_an_outside_ramp() -> None:
    heated = thermal("self_heating").change_plant(PLANT, 12.0, initial_ratio=1.0, time_constant=900.0)
    on = heated.temperatures(TIME, np.full(len(TIME), 20.0), powered=((0.0, np.inf),))
    warming = PLANT.temperatures(TIME, 20.0 + np.minimum(TIME / 60.0, 40.0))
    early = (TIME > 1200.0) & (TIME < 2400.0)
    assert np.all((on["T_out"] - on["T_in"])[early] < 0.0)
    assert np.all((warming["T_out"] - warming["T_in"])[early] > 0.0)


def test_ripple_swings_at_its_period_and_the_coil_hardly_sees_it() -> None:
    still = np.full(len(TIME), 20.0)
    shape = {"period": 300.0, "phase": 0.0, "overshoot": 5.0}
    air = thermal("chamber_ripple").change_chamber(still, inputs(still), 0.5, **shape)
    assert air - 20.0 == pytest.approx(0.5 * np.sin(2.0 * np.pi * TIME / 300.0), abs=1e-9)
    coil = PLANT.temperatures(TIME, air)["T_in"]
    assert np.ptp(coil[len(TIME) // 2 :]) < 0.02


def test_overshoot_peaks_after_the_end_of_a_ramp() -> None:
    ramp = 20.0 + 2.0 * np.clip(TIME / 60.0 - 30.0, 0.0, 60.0)
    shape = {"period": 600.0, "phase": 0.0, "overshoot": 4.0}
    effect_ = thermal("chamber_ripple")
    air = effect_.change_chamber(ramp, inputs(ramp), 0.25, **shape)
    over = air - ramp - 0.25 * np.sin(2.0 * np.pi * TIME / 600.0)
    after = TIME >= 5400.0
    # 0.25 degC times 4 per degC/min times 2 degC/min; the rate of the set point ends within a sample.
    assert over[after].max() == pytest.approx(2.0, rel=0.02)
    peak = TIME[after][np.argmax(over[after])] - 5400.0
    assert peak == pytest.approx(600.0 * np.log(4.0) / 3.0, abs=20.0)
    assert abs(over[-1]) < 1e-6
    during = (TIME > 1900.0) & (TIME < 2200.0)
    assert np.all(over[during] < 0.0)


def test_time_constants_follow_the_fan() -> None:
    windy = thermal("airflow").change_plant(PLANT, 1.0, rotation_share=0.0)
    ramp = 20.0 + TIME / 600.0
    on = windy.temperatures(TIME, ramp, fan=np.ones(len(TIME)))
    off = windy.temperatures(TIME, ramp, fan=np.zeros(len(TIME)))
    base = PLANT.temperatures(TIME, ramp)
    assert on["T_case"] == pytest.approx(base["T_case"])
    # Half of the conductance: the case is twice as far behind.
    behind = (ramp - off["T_case"])[-1] / (ramp - on["T_case"])[-1]
    assert behind == pytest.approx(2.0, rel=1e-3)


def test_air_falls_short_of_the_set_point_away_from_the_room() -> None:
    points = np.full(len(TIME), -25.0)
    stratified = thermal("chamber_setpoint_vs_air")
    fanned = stratified.change_chamber(points, inputs(points), 2.0)
    assert fanned == pytest.approx(-23.0)
    becalmed = inputs(points, drives={"fan": np.zeros(len(TIME))})
    assert stratified.change_chamber(points, becalmed, 2.0) == pytest.approx(-21.0)
    room = np.full(len(TIME), 25.0)
    assert np.array_equal(stratified.change_chamber(room, inputs(room), 2.0), room)


def test_hidden_node_leaves_a_tail_of_its_time_constant() -> None:
    chamber = 20.0 + np.clip(TIME / 60.0, 0.0, 40.0)
    coil = chamber - 1.0
    given = inputs(chamber, temperatures={"T_chamber": chamber, "T": coil})
    found = thermal("hidden_thermal_node").signature(given, time_constant=1800.0)
    end = 2400.0
    behind = 30.0 * -np.expm1(-end / 1800.0)
    late = TIME > 2399.0
    assert found[late] == pytest.approx(1.0 - behind * np.exp(-(TIME[late] - end) / 1800.0), abs=1e-9)


@pytest.mark.parametrize("id", ["thermal_network", "self_heating", "chamber_ripple", "airflow"])
def test_what_sensors_show_leaves_a_replay_nothing_to_add(id: str) -> None:
    declared = thermal(id)
    found = declared.signature(inputs(20.0 + TIME / 600.0), **declared.default_shape())
    assert not found.any()
