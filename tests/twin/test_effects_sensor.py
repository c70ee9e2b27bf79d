"""Effects of temperature sensors: exact models, and signatures against the difference of two replays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.runs.run import Run
from fogml.runs.steps import recorded_step
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.nominal import NominalConstants, bias_deg_h, scale_factor_ppm, temperature_slopes
from fogml.twin.registry import effect
from fogml.twin.replay import inputs_of_run, replay
from fogml.twin.twin_file import load_twin

TIME = np.arange(0.0, 14_400.0)
CONSTANTS = NominalConstants(e0=100.0, k1=30.0, k2=0.3, b0=1.0, b1=0.03, b2=4e-4, g=0.4)
SENSORS = ("T", "T_in", "T_out")


def truth() -> Inputs:
    """A smooth cycle with a gradient, turning at 1 deg/s."""
    inner = 10.0 + 30.0 * np.sin(2.0 * np.pi * TIME / 9000.0)
    outer = 10.0 + 30.0 * np.sin(2.0 * np.pi * (TIME + 150.0) / 9000.0)
    case = 10.0 + 30.0 * np.sin(2.0 * np.pi * (TIME + 500.0) / 9000.0)
    nodes = {"T": inner, "T_in": inner, "T_out": outer, "T_case": case}
    return Inputs(TIME, nodes, np.ones(len(TIME)), rate_window_s=0.0)


def sensor(id: str) -> SensorEffect:
    found = effect(id)
    assert isinstance(found, SensorEffect)
    return found


def static_output(inputs: Inputs) -> FloatArray:
    scale = 1.0 + 1e-6 * scale_factor_ppm(inputs, CONSTANTS)
    return scale * inputs.input_rate_deg_h + bias_deg_h(inputs, CONSTANTS)


def shown(declared: SensorEffect, given: Inputs, amplitude: float, **shape: float) -> Inputs:
    """What sensors show of a truth."""
    read = {
        name: declared.sense(name, given.temperatures[name], given, amplitude, **shape) for name in SENSORS
    }
    return replace(given.afresh(), temperatures={**given.temperatures, **read}, cache={})


@pytest.mark.parametrize(
    ("id", "amplitude"), [("sensor_lag", 4.0), ("sensor_offset", 0.01), ("sensor_placement", 0.002)]
)
def test_signature_is_what_a_replay_from_the_sensors_lacks(id: str, amplitude: float) -> None:
    declared, given = sensor(id), truth()
    shape = declared.default_shape()
    recorded = shown(declared, given, amplitude, **shape)
    lacking = static_output(given) - static_output(recorded)
    linear = replace(recorded, slopes=temperature_slopes(recorded, CONSTANTS))
    wanted = amplitude * declared.signature(linear, **shape)
    late = TIME > 100.0
    assert np.abs(lacking[late]).max() > 1e-4
    assert wanted[late] == pytest.approx(lacking[late], abs=0.01 * float(np.abs(lacking).max()))


def test_lag_is_the_first_order_answer_to_a_ramp() -> None:
    ramp = np.where(TIME < 1000.0, 20.0, 20.0 + (TIME - 1000.0) / 60.0)
    given = Inputs(TIME, {"T": ramp}, np.zeros(len(TIME)))
    found = sensor("sensor_lag").sense("T", ramp, given, 40.0)
    since = np.maximum(TIME - 1000.0, 0.0)
    wanted = 20.0 + (since - 40.0 * -np.expm1(-since / 40.0)) / 60.0
    assert found == pytest.approx(wanted, abs=1e-9)


def test_lag_through_the_scale_factor_needs_a_turning_table() -> None:
    given = replace(truth(), table_rate=np.zeros(len(TIME)))
    constants = NominalConstants(k1=30.0)
    still = sensor("sensor_lag").signature(replace(given, slopes=temperature_slopes(given, constants)))
    assert not still.any()
    turning = truth()
    moved = sensor("sensor_lag").signature(replace(turning, slopes=temperature_slopes(turning, constants)))
    assert np.abs(moved).max() == pytest.approx(30e-6 * 3600.0 * 30.0 * 2.0 * np.pi / 9000.0, rel=1e-3)


def test_offset_and_gain_are_those_of_a_straight_line() -> None:
    given = truth()
    found = sensor("sensor_offset").sense("T", given.temperatures["T"], given, 0.2, gain=0.015)
    slope, level = np.polyfit(given.temperatures["T"] - 25.0, found - given.temperatures["T"], 1)
    assert (slope, level) == pytest.approx((0.003, 0.2))


@pytest.mark.parametrize("step", [0.0625, 0.01])
def test_quantised_sensors_give_whole_steps(step: float) -> None:
    given = truth()
    found = sensor("sensor_quantisation").sense("T", given.temperatures["T"], given, step)
    assert found / step == pytest.approx(np.rint(found / step), abs=1e-6)
    error = found - given.temperatures["T"]
    assert np.abs(error).max() <= 0.5 * step * (1 + 1e-9)
    assert np.std(error) == pytest.approx(step / np.sqrt(12.0), rel=0.03)


@pytest.mark.parametrize(("step", "slower"), [(0.0625, 1.0), (0.01, 6.0), (0.001, 60.0)])
def test_quantisation_signature_recovers_what_recorded_steps_hide(step: float, slower: float) -> None:
    """From the recorded, already rounded temperature alone, with its step read off the record."""
    declared, given = sensor("sensor_quantisation"), truth()
    true = 20.0 + 30.0 * np.sin(2.0 * np.pi * TIME / 14_400.0) / slower
    given = replace(given, temperatures={"T": true, "T_in": true, "T_out": true}, rate_window_s=64.0)
    recorded = shown(declared, given, step)
    hidden = 0.05 * (true - recorded.temperatures["T"])
    found = step * declared.signature(replace(recorded, slopes={"T": np.full(len(TIME), 0.05)}))
    # Where temperature stands still, nothing tells where within a step it is.
    moving = (np.abs(np.gradient(true, TIME)) > 0.1 * step) & (TIME > 600.0)
    assert np.count_nonzero(moving) > 5000
    assert np.corrcoef(found[moving], hidden[moving])[0, 1] > 0.8
    assert np.polyfit(found[moving], hidden[moving], 1)[0] == pytest.approx(1.0, abs=0.1)


def test_hindsight_tells_more_of_what_steps_hide() -> None:
    """In samples of 10 s a ramp of 1 degC/min takes two steps at a time."""
    declared, given = sensor("sensor_quantisation"), truth()
    time = np.arange(0.0, 36_000.0, 10.0)
    true = 20.0 + 30.0 * np.sin(2.0 * np.pi * time / 14_400.0)
    rounded = 0.0625 * np.rint(true / 0.0625)
    inputs = replace(given, time=time, temperatures={"T": rounded}, slopes={"T": np.ones(len(time))})
    inputs = replace(inputs, table_rate=np.zeros(len(time)), memory=Memory(), cache={})
    hidden = true - rounded
    causal = np.corrcoef(0.0625 * declared.signature(inputs), hidden)[0, 1]
    found = 0.0625 * declared.in_hindsight(inputs.afresh())
    assert np.corrcoef(found, hidden)[0, 1] > max(0.8, 1.5 * causal)
    assert np.polyfit(found, hidden, 1)[0] == pytest.approx(1.0, abs=0.2)


def test_a_mean_of_coarse_sensors_hides_what_each_of_them_hides() -> None:
    """Two sensors that are a third of a step apart: their mean comes in halves of a step."""
    declared, step = sensor("sensor_quantisation"), 0.5
    time = np.arange(0.0, 36_000.0, 10.0)
    true = 20.0 + 30.0 * np.sin(2.0 * np.pi * time / 14_400.0)
    columns = {f"T{k + 1}": step * np.rint((true + k * step / 6.0) / step) for k in range(4)}
    run = Run(name="four.csv", columns={"time": time, "gyro": np.zeros(len(time)), **columns})
    inputs, _ = inputs_of_run(run)
    inner = inputs.temperature("T_in")
    assert recorded_step(inner) == pytest.approx(0.5 * step)
    found = step * declared.in_hindsight(replace(inputs, slopes={"T_in": np.ones(len(time))}))
    hidden = true + step / 6.0 - inner
    assert np.std(found - hidden) < 0.2 * np.std(hidden)


def test_a_fine_sensor_beside_a_coarse_one_hides_next_to_nothing() -> None:
    declared = sensor("sensor_quantisation")
    time = np.arange(0.0, 36_000.0, 10.0)
    true = 20.0 + 30.0 * np.sin(2.0 * np.pi * time / 14_400.0)
    columns = {"T1": 0.5 * np.rint(true / 0.5), "T2": true, "T3": true, "T4": true}
    inputs, _ = inputs_of_run(Run(name="mixed.csv", columns={"time": time, "gyro": 0.0 * time, **columns}))
    found = 0.5 * declared.in_hindsight(replace(inputs, slopes={"T_in": np.ones(len(time))}))
    hidden = true - inputs.temperature("T_in")
    assert np.std(found - hidden) < 0.25 * np.std(hidden)


def test_unrounded_temperature_is_put_to_the_usual_step() -> None:
    given = replace(truth(), slopes={"T": np.ones(len(TIME))})
    declared = sensor("sensor_quantisation")
    rounded = declared.sense("T", given.temperatures["T"], given, 0.0625)
    found = 0.0625 * declared.signature(given)
    # It is known to be unrounded once it has changed by less than any sensor's step.
    later = TIME > 2500.0
    assert found[later] == pytest.approx((given.temperatures["T"] - rounded)[later], abs=1e-9)


@pytest.mark.parametrize("share", [0.1, 0.4, 0.7])
def test_a_replay_from_sensors_that_feel_the_case_finds_the_place_again(share: float) -> None:
    """T = T_s + A / (1 - A) (T_s - T_case) by the mix itself; through a bias that is a straight line."""
    given = replace(truth(), table_rate=np.zeros(len(TIME)))
    recorded = shown(sensor("sensor_placement"), given, share)
    run = Run(
        name="mixed.csv",
        columns={"time": TIME, "gyro": np.zeros(len(TIME)), **recorded.temperatures},
    )
    twin = load_twin("nominal").with_nominal(b1=0.03, g=0.4, e0=0.0, b0=0.0)
    found = replay(twin.with_effect("sensor_placement", share), run)
    straight = NominalConstants(b1=0.03, g=0.4)
    wanted, trusting = bias_deg_h(given, straight), bias_deg_h(recorded, straight)
    late = TIME > 200.0
    assert np.abs(wanted - trusting)[late].max() > 0.01
    assert found[late] == pytest.approx(wanted[late], abs=1e-6)


def test_placement_needs_a_case_of_its_own() -> None:
    alone = replace(truth(), temperatures={"T": truth().temperatures["T"]}, slopes={"T": np.ones(len(TIME))})
    assert not sensor("sensor_placement").signature(alone).any()
    given = truth()
    mixed = sensor("sensor_placement").sense("T", given.temperatures["T"], given, 0.25)
    assert mixed == pytest.approx(0.75 * given.temperatures["T"] + 0.25 * given.temperatures["T_case"])
    assert np.array_equal(
        sensor("sensor_placement").sense("T_case", given.temperatures["T_case"], given, 0.25),
        given.temperatures["T_case"],
    )
