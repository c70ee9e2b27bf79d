"""Nodes that a recording lacks: from a plant whose every node is known."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.plant.coil import RadialLine, with_line
from fogml.twin.plant.estimate import EstimateState, estimate_nodes, recorded_power
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.plant.standard import ThermalConstants, standard_network

ON = ((100.0, np.inf),)
TIME = np.arange(0.0, 40_000.0, 2.0)


def plant(order: int = 6) -> ThermalNetwork:
    return standard_network(ThermalConstants(plate_share=0.1), order=order).with_heating(2.5, 3.5, 900.0)


def truth(network: ThermalNetwork) -> dict[str, np.ndarray]:
    air = np.interp(TIME, [0, 4000, 8000, 16000, 30000], [25.0, 25.0, -40.0, -40.0, 60.0])
    return network.temperatures(TIME, air, powered=ON)


@pytest.mark.parametrize(
    "recorded", [("T_chamber",), ("T_chamber", "T_in"), ("T_chamber", "T_case", "T_out", "T_electronics")]
)
def test_with_the_chamber_recorded_the_rest_follows(recorded: tuple[str, ...]) -> None:
    network = plant()
    known = truth(network)
    given = estimate_nodes(network, TIME, {name: known[name] for name in recorded}, powered=ON)
    assert set(given) == set(network.names)
    for name, values in known.items():
        np.testing.assert_allclose(given[name], values, atol=2e-4)
    for name in recorded:
        np.testing.assert_array_equal(given[name], known[name])


@pytest.mark.parametrize("sensor", ["T_in", "T_out", "T_case", "T"])
@pytest.mark.parametrize("order", [1, 3, 6])
def test_from_one_sensor_soaks_and_steady_ramps_are_right(sensor: str, order: int) -> None:
    network = plant(order)
    known = truth(network)
    given = estimate_nodes(network, TIME, {sensor: known["T_in" if sensor == "T" else sensor]}, powered=ON)
    # After 3.6 h of a ramp, and after 2.2 h of soak, which began 26 degC away.
    for moment, allowed in ((29_000.0, 0.15), (15_900.0, 0.5)):
        at = int(moment / 2.0)
        for name, values in known.items():
            if name != "T_plate":
                assert given[name][at] == pytest.approx(values[at], abs=allowed), name
    # What is further out leads, as in the plant.
    ramping = (TIME > 20_000.0) & (TIME < 30_000.0)
    if order == 6 and sensor != "T_case":
        assert (given["T_case"] > given["T_out"])[ramping].all()
        assert (given["T_chamber"] > given["T_case"])[ramping].all()


def test_noise_of_the_only_sensor_is_doubled_at_most() -> None:
    network = standard_network()
    rng = np.random.default_rng(4)
    noise = rng.normal(0.0, 0.01, len(TIME))
    given = estimate_nodes(network, TIME, {"T_in": 25.0 + noise})
    assert given["T_chamber"].std() < 2.0 * 0.01 * 1.01
    assert given["T_case"].std() < 0.01


def test_faces_of_a_conduction_line_may_be_recorded() -> None:
    coil = RadialLine(layers=8)
    network = with_line(plant(), coil)
    known = truth(network)
    given = estimate_nodes(network, TIME, {"T_in": known["T_in"], "T_out": known["T_out"]}, powered=ON)
    for name in coil.names:
        np.testing.assert_allclose(given[name], known[name], atol=1e-3)


def test_blocks_give_the_whole() -> None:
    network = plant()
    known = {"T": truth(network)["T_in"]}
    whole = estimate_nodes(network, TIME, known, powered=ON)
    state, parts = EstimateState(), []
    for a, b in pairwise((0, 1, 777, 12_000, len(TIME))):
        parts.append(estimate_nodes(network, TIME[a:b], {"T": known["T"][a:b]}, powered=ON, state=state))
    for name, values in whole.items():
        joined = np.concatenate([part[name] for part in parts])
        np.testing.assert_allclose(joined, values, rtol=1e-12, atol=1e-11)


def test_what_the_plant_does_not_have_is_an_error() -> None:
    with pytest.raises(InputError, match="recorded is T_lid"):
        estimate_nodes(plant(), TIME, {"T_lid": TIME})
    with pytest.raises(InputError, match="recorded is none"):
        estimate_nodes(plant(), TIME, {})


def run(facts: Facts | None = None, **columns: np.ndarray) -> Run:
    time = np.arange(10.0)
    return Run.from_columns("a", facts, time=time, gyro=np.zeros(10), **columns)


def test_power_windows_of_a_recording() -> None:
    assert recorded_power(run()) == ((-math.inf, math.inf),)
    assert recorded_power(run(Facts(powered_on=-30.0))) == ((-30.0, math.inf),)
    power = np.array([3.0, 2.9, 2.8, 0.0, 0.1, 3.0, 2.9, 2.9, 0.0, 0.0])
    assert recorded_power(run(power=power)) == ((-math.inf, 3.0), (5.0, 8.0))
    assert recorded_power(run(Facts(powered_on=-30.0), supply=power)) == ((-30.0, 3.0), (5.0, 8.0))
    assert recorded_power(run(power=power[::-1])) == ((2.0, 5.0), (7.0, math.inf))
    assert recorded_power(run(power=np.zeros(10))) == ((-math.inf, math.inf),)


def test_a_column_of_no_power_says_nothing_of_when_the_unit_was_on() -> None:
    """A twin without heat of its own draws none: the supply or the stated power-on tells."""
    time, facts = np.arange(6.0), Facts(powered_on=-30.0)
    told = Run.from_columns("a", facts, time=time, gyro=0.0 * time, power=0.0 * time)
    assert recorded_power(told) == ((-30.0, math.inf),)
    supply = np.array([0.0, 0.0, 28.0, 28.0, 0.0, 28.0])
    both = Run.from_columns("b", facts, time=time, gyro=0.0 * time, power=0.0 * time, supply=supply)
    assert recorded_power(both) == ((2.0, 4.0), (5.0, math.inf))


def test_a_power_that_lacks_a_reading_is_no_power_cycle() -> None:
    power = np.array([np.nan, 3.0, 3.0, np.nan, 3.0])
    run = Run.derived("a", {"time": np.arange(5.0), "gyro": np.zeros(5), "power": power}, Facts(), "deg/h")
    assert recorded_power(run) == ((-math.inf, math.inf),)


def test_a_spike_of_the_power_does_not_switch_the_unit_off() -> None:
    power = np.array([3.0, 2.9, 20.0, 2.8, 0.0, 0.1, 3.0, 2.9, 2.9, 2.9])
    assert recorded_power(run(power=power)) == ((-math.inf, 4.0), (6.0, math.inf))
