"""The heat network against an ODE solver, closed forms, its energy balance, and itself in blocks."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fogml.errors import InputError
from fogml.twin.plant.heat import SelfHeating
from fogml.twin.plant.network import PlantState, ThermalNetwork
from fogml.twin.plant.standard import QUANTITIES, ThermalConstants, standard_network
from fogml.twin.set_up import Plant
from fogml.twin.twin import Twin

NODES = ("T_case", "T_out", "T_in", "T_hub", "T_electronics", "T_plate")
OFF_ON = ((-np.inf, 300.0), (1234.5, 5000.25))


def chamber(time: np.ndarray) -> np.ndarray:
    return np.interp(time, [0.0, 600.0, 3000.0, 6000.0], [25.0, 25.0, -15.0, 40.0])


def plant() -> ThermalNetwork:
    constants = ThermalConstants(plate_share=0.2)
    return standard_network(constants).with_heating(2.5, 4.0, 700.0).with_airflow(0.8, 0.3)


def right_hand_side(network: ThermalNetwork, fan: float, rate: float):
    """C dT/dt written out link by link, with power switched as in OFF_ON."""
    factor = (1 + 0.8 * fan) / 1.8 * (1 + 0.3 * math.sqrt(rate / 100.0))
    names = list(network.capacities)

    def slope(t: float, values: np.ndarray) -> list[float]:
        temperature = dict(zip(names, values)) | {"T_chamber": float(chamber(np.array(t)))}
        flow = dict.fromkeys(temperature, 0.0)
        for (a, b), conductance in network.links.items():
            heat = (
                conductance * (factor if "T_chamber" in (a, b) else 1.0) * (temperature[a] - temperature[b])
            )
            flow[a] -= heat
            flow[b] += heat
        for on, off in OFF_ON:
            if on <= t < off:
                flow["T_electronics"] += 2.5 + (1.5 * math.exp(-(t - on) / 700.0) if on > -np.inf else 0.0)
        return [flow[name] / network.capacities[name] for name in names]

    return slope


def test_agrees_with_an_ode_solver_through_power_fan_and_table_changes() -> None:
    network = plant()
    time = np.arange(0.0, 6000.0, 10.0)
    fan = np.where((time >= 1000.0) & (time < 2000.0), 0.0, 1.0)
    table_rate = np.where((time >= 3500.0) & (time < 4000.0), 25.0, 0.0)
    given = network.temperatures(time, chamber(time), powered=OFF_ON, fan=fan, table_rate=table_rate)

    state = np.array([given[name][0] for name in network.nodes])
    edges = [0, 300, 600, 1000, 1234.5, 2000, 3000, 3500, 4000, 5000.25, 5990]
    for start, stop in itertools.pairwise(edges):
        middle = 0.5 * (start + stop)
        slope = right_hand_side(
            network, 0.0 if 1000 <= middle < 2000 else 1.0, 25.0 if 3500 <= middle < 4000 else 0.0
        )
        wanted = time[(time >= start) & (time <= stop)]
        inside = np.unique(np.concatenate([wanted, [stop]]))
        # The last instant belongs to what follows it.
        solved = solve_ivp(
            lambda t, y, s=slope, e=stop: s(min(t, e - 1e-9), y),
            (start, stop),
            state,
            method="DOP853",
            t_eval=inside,
            rtol=1e-11,
            atol=1e-11,
        )
        for i, name in enumerate(network.nodes):
            expected = solved.y[i][np.isin(inside, wanted)]
            np.testing.assert_allclose(given[name][np.isin(time, wanted)], expected, atol=2e-8)
        state = solved.y[:, -1]


@pytest.mark.parametrize("order", range(1, 12))
def test_in_a_steady_ramp_each_node_is_behind_by_its_time_constants(order: int) -> None:
    constants = ThermalConstants(plate_share=0.3, hub_share=0.4)
    network = standard_network(constants, order=order)
    time = np.linspace(0.0, 200_000.0, 2001)
    rate = 0.2 / 60.0
    final = {name: values[-1] for name, values in network.temperatures(time, 10.0 + rate * time).items()}
    behind = {name: (final["T_chamber"] - value) / rate for name, value in final.items()}
    assert behind["T_case"] == pytest.approx(900.0, rel=1e-9)
    assert behind["T_out"] - behind["T_case"] == pytest.approx(360.0 if order >= 2 else 0.0, abs=1e-6)
    assert (final["T_out"] - final["T_in"]) / rate == pytest.approx(180.0 if order >= 3 else 0.0, abs=1e-6)
    assert behind["T_electronics"] - behind["T_case"] == pytest.approx(300.0 if order >= 4 else 0.0, abs=1e-6)
    assert behind["T_hub"] - behind["T_in"] == pytest.approx(120.0 if order >= 5 else 0.0, abs=1e-6)
    assert len(network.nodes) == order
    if order >= 6:
        assert behind["T_plate"] == pytest.approx(2400.0, rel=1e-9)
    for name, lag in network.ramp_lags_s().items():
        assert behind[name] == pytest.approx(lag, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("order", range(1, 6))
def test_smaller_orders_hold_the_same_heat(order: int) -> None:
    unit = sum(value for name, value in standard_network().capacities.items() if name != "T_plate")
    assert sum(standard_network(order=order).capacities.values()) == pytest.approx(unit, rel=1e-14)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5, 6, 9])
def test_a_twins_heat_comes_out_through_the_case_at_any_order(order: int) -> None:
    """All of P leaves by the case's link to the air, (sum of C) / tau; a joined node heats its neighbour."""
    plant = Plant(order=order, heating=SelfHeating(2.0, 2.0))
    c = plant.constants
    unit = c.case_capacity + c.coil_capacity + c.hub_capacity + c.electronics_capacity
    warm = plant.network.temperatures(np.array([0.0]), np.array([25.0]))
    assert warm["T_case"][0] == pytest.approx(25.0 + 2.0 * c.case / unit)
    network = Twin(plant=plant).with_effect("self_heating", 7.0).network
    assert network.heating.steady_w * network.steady_rises()["T_electronics"] == pytest.approx(7.0)


def test_one_node_follows_the_closed_form_of_two_exponentials() -> None:
    network = standard_network(order=1).with_heating(3.0, 5.0, 400.0)
    (capacity,) = network.capacities.values()
    time = np.array([0.0, 1.0, 7.0, 500.0, 501.5, 4000.0])
    given = network.temperatures(time, np.full(6, 20.0), powered=((0.0, np.inf),))["T_electronics"]
    tau, conductance = 900.0, capacity / 900.0
    steady = 3.0 / conductance * (1 - np.exp(-time / tau))
    fading = 2.0 / capacity * (np.exp(-time / tau) - np.exp(-time / 400.0)) / (1 / 400.0 - 1 / tau)
    np.testing.assert_allclose(given, 20.0 + steady + fading, rtol=1e-13)


def test_a_fade_as_fast_as_a_mode_is_no_special_case() -> None:
    network = standard_network(order=1)
    time = np.arange(0.0, 5000.0, 50.0)
    cold = np.zeros(len(time))
    met = network.with_heating(0.0, 4.0, 900.0).temperatures(time, cold, powered=((0.0, np.inf),))
    (capacity,) = network.capacities.values()
    np.testing.assert_allclose(met["T_case"], 4.0 / capacity * time * np.exp(-time / 900.0), atol=1e-12)


def test_heat_stored_is_heat_that_came_in() -> None:
    network = plant()
    time = np.arange(0.0, 6000.5, 0.5)
    given = network.temperatures(time, chamber(time), powered=OFF_ON)
    stored = sum(c * (given[name][-1] - given[name][0]) for name, c in network.capacities.items())
    inflow = sum(
        conductance * (given["T_chamber"] - given[b if a == "T_chamber" else a])
        for (a, b), conductance in network.links.items()
        if "T_chamber" in (a, b)
    )
    heated = 2.5 * (300.0 + 5000.25 - 1234.5) + 1.5 * 700.0 * (1 - math.exp(-(5000.25 - 1234.5) / 700.0))
    assert stored == pytest.approx(np.trapezoid(inflow, time) + heated, rel=1e-5)


def test_irregular_steps_give_the_regular_ones() -> None:
    network, rng = plant(), np.random.default_rng(3)
    dense = np.arange(0.0, 6000.0, 1.0)
    knots = np.array([600, 3000, 300, 5000])
    some = np.unique(np.concatenate([[0], knots, rng.choice(len(dense), 300, replace=False)]))
    whole = network.temperatures(dense, chamber(dense), powered=OFF_ON)
    sparse = network.temperatures(dense[some], chamber(dense[some]), powered=OFF_ON)
    for name in NODES:
        np.testing.assert_allclose(sparse[name], whole[name][some], atol=1e-11)


@pytest.mark.parametrize("sample_s", [1.0, 0.1])
def test_blocks_give_the_whole(sample_s: float) -> None:
    network, rng = plant(), np.random.default_rng(5)
    time = 100.0 + np.arange(6000) * sample_s
    fan = (rng.random(6000) > 0.01).astype(float)
    table_rate = 50.0 * (rng.random(6000) > 0.99)
    air = chamber(time) + rng.normal(0.0, 0.1, 6000)
    drives = {"fan": fan, "table_rate": table_rate}
    whole = network.temperatures(time, air, powered=OFF_ON, **drives)
    state, parts = PlantState(), []
    edges = [0, 1, 2, 600, 601, 2345, 6000]
    for a, b in itertools.pairwise(edges):
        block = {name: values[a:b] for name, values in drives.items()}
        parts.append(network.temperatures(time[a:b], air[a:b], powered=OFF_ON, state=state, **block))
    for name in NODES:
        joined = np.concatenate([part[name] for part in parts])
        np.testing.assert_allclose(joined, whole[name], rtol=1e-12, atol=1e-12)


def test_a_unit_switched_on_before_the_start_has_its_history() -> None:
    network = standard_network().with_heating(2.0, 6.0, 500.0)
    early = np.arange(-600.0, 1000.0)
    cold, late = np.full(len(early), 5.0), early[600:]
    from_on = network.temperatures(early, cold, powered=((-600.0, np.inf),))
    from_start = network.temperatures(late, cold[600:], powered=((-600.0, np.inf),))
    long_on = network.temperatures(late, cold[600:])
    for name in NODES:
        np.testing.assert_allclose(from_start[name], from_on[name][600:], atol=1e-11)
        np.testing.assert_allclose(long_on[name], 5.0 + 2.0 * network.steady_rises()[name], atol=1e-11)


def test_self_heating_turns_the_gradient_of_the_coil_round() -> None:
    rises = standard_network().steady_rises()
    assert rises["T_in"] > rises["T_out"] > rises["T_case"] > 0.0
    assert rises["T_electronics"] == max(rises.values())
    hung_on_the_case = standard_network(ThermalConstants(hub_share=0.0)).steady_rises()
    assert hung_on_the_case["T_in"] == pytest.approx(hung_on_the_case["T_out"], rel=1e-12)


def test_without_air_exchange_given_nothing_depends_on_fan_or_table() -> None:
    network = standard_network()
    time = np.arange(0.0, 3000.0)
    still = network.temperatures(time, chamber(time))
    moved = network.temperatures(time, chamber(time), fan=np.zeros(3000), table_rate=np.full(3000, 40.0))
    np.testing.assert_array_equal(still["T_in"], moved["T_in"])


def test_faults_are_named() -> None:
    with pytest.raises(InputError, match="T_chamber"):
        standard_network().temperatures(np.arange(3.0), {"T_case": np.zeros(3)})
    with pytest.raises(InputError, match="heat capacity of 'T_case' is -1"):
        replace(standard_network(), capacities={"T_case": -1.0})
    with pytest.raises(InputError, match="'order' is 0"):
        standard_network(order=0)
    with pytest.raises(InputError, match="'plate_share' is 9"):
        ThermalConstants(plate_share=9.0)
    with pytest.raises(InputError, match="'coil' is -3 s, which is not physical"):
        ThermalConstants(coil=-3.0)
    apart = ThermalNetwork({"T_case": 1.0, "T_hub": 1.0}, {("T_chamber", "T_case"): 1.0})
    with pytest.raises(InputError, match="exchanges heat with no given temperature"):
        apart.temperatures(np.arange(3.0), np.zeros(3))


def test_every_draw_from_the_ranges_is_a_plant() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        drawn = ThermalConstants(**{quantity.name: quantity.draw(rng) for quantity in QUANTITIES})
        network = standard_network(drawn)
        assert min(network.links.values()) >= 0.0
        lags = network.ramp_lags_s()
        assert lags["T_out"] - lags["T_case"] == pytest.approx(drawn.case_to_coil, rel=1e-9)
        assert lags["T_electronics"] - lags["T_case"] == pytest.approx(drawn.electronics, rel=1e-9)
        assert lags["T_plate"] == pytest.approx(drawn.plate, rel=1e-9)
