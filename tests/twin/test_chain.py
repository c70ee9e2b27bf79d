"""The chain: its formula against numbers worked out here, contributions that add up, sensors and heading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.testing.effect_inputs import block, standard_inputs
from fogml.twin.chain import sensed, through_chain
from fogml.twin.effect import BiasEffect, LoggerEffect, NoiseEffect, SensorEffect, ThermalEffect
from fogml.twin.memory import Memory
from fogml.twin.nominal import NominalConstants
from fogml.twin.registry import effects
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.twin import Twin

CONSTANTS = NominalConstants(e0=300.0, k1=20.0, k2=0.2, b0=2.0, b1=0.02, b2=2e-4, g=0.3, m=1.0)


@pytest.fixture(scope="module")
def inputs():
    return standard_inputs()["programme"]


@pytest.fixture(scope="module")
def everything():
    twin = Twin(nominal=CONSTANTS)
    for id, declared in effects().items():
        if not isinstance(declared, NoiseEffect) and not declared.conflicts:
            twin = twin.with_effect(id)
    return twin


def fresh(inputs):
    return replace(inputs, memory=Memory(), cache={})


def delta(time, x):
    """Mean of x over the last 64 s less that over the 64 s before, where no window is cut by the start.

    By plain selection of the samples where those of the two lie 64 s apart, else linear between samples.
    """
    out = np.full(len(x), np.nan)

    def mean(start, stop):
        at = np.unique(np.concatenate([[start, stop], time[(time > start) & (time < stop)]]))
        return np.trapezoid(np.interp(at, time, x), at) / (stop - start)

    for i in range(len(x)):
        end, middle, start = time[i] - np.array([0.0, 64.0, 128.0])
        if start >= time[0]:
            new, old = (time > middle) & (time <= end), (time > start) & (time <= middle)
            if old.any() and abs(time[new].mean() - time[old].mean() - 64.0) < 1e-6:
                out[i] = x[new].mean() - x[old].mean()
            else:
                out[i] = mean(middle, end) - mean(start, middle)
    return out


def test_nominal_output(inputs):
    u = inputs.temperatures["T"] - 25.0
    rate = 3600.0 * inputs.table_rate + 7.520533
    wanted = (1 + 1e-6 * (300 + 20 * u + 0.2 * u**2)) * rate + 2 + 0.02 * u + 2e-4 * u**2
    wanted += 0.3 * (inputs.temperatures["T_in"] - inputs.temperatures["T_out"])
    wanted += delta(inputs.time, inputs.temperatures["T"])
    found = through_chain(Twin(nominal=CONSTANTS), fresh(inputs), fresh(inputs)).output
    full = ~np.isnan(wanted)
    assert full.mean() > 0.99
    np.testing.assert_allclose(found[full], wanted[full], rtol=1e-13, atol=1e-9)


def test_stages_go_in_order(inputs):
    """(1 + 1e-6 s)(rate + earth + rig) + b, then the loop."""
    twin = (
        Twin(nominal=CONSTANTS)
        .with_effect("mount_tilt")
        .with_effect("coil_expansion", 12.0)
        .with_effect("hidden_thermal_node", 0.3)
        .with_effect("deadband", 3.0)
    )
    plain = Twin(nominal=CONSTANTS)
    catalogue = effects()

    def part(id):
        setting = twin.settings[id]
        return setting.amplitude * catalogue[id].signature(fresh(inputs), **setting.shape)

    u = inputs.temperatures["T"] - 25.0
    rate = 3600.0 * inputs.table_rate + 7.520533
    nominal = through_chain(plain, fresh(inputs), fresh(inputs)).output
    scale = 1 + 1e-6 * (300 + 20 * u + 0.2 * u**2)
    bias = nominal - scale * rate
    optical = (scale + 1e-6 * part("coil_expansion")) * (rate + part("mount_tilt")) + bias
    optical += part("hidden_thermal_node")
    shape = twin.settings["deadband"].shape
    wanted = catalogue["deadband"].apply(optical, fresh(inputs), 3.0, **shape)
    assert np.abs(wanted - optical).max() > 0.5
    found = through_chain(twin, fresh(inputs), fresh(inputs)).output
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-9)


def test_contributions_add_up(inputs, everything):
    # Jumps of hundreds of deg/s would hide everything else.
    everything = everything.without_effect("fringe_jump")
    asked = ["nominal", *everything.settings]
    chain = through_chain(everything, fresh(inputs), fresh(inputs), contributions=asked)
    outside = SensorEffect | LoggerEffect | NoiseEffect
    wanted = {"nominal"} | {
        d.id
        for d, _ in everything.on
        if not (isinstance(d, outside) and d.id != "rate_ramp")
        and (not isinstance(d, ThermalEffect) or d.id == "hidden_thermal_node")
    }
    assert set(chain.contributions) == wanted
    total = np.sum(list(chain.contributions.values()), axis=0)
    size = np.abs(chain.output).max()
    np.testing.assert_allclose(total, chain.output, rtol=0.0, atol=1e-12 * size)
    assert not through_chain(everything, fresh(inputs), fresh(inputs)).contributions
    one = through_chain(everything, fresh(inputs), fresh(inputs), contributions=["shupe_mohr"]).contributions
    assert set(one) == {"shupe_mohr"}
    np.testing.assert_array_equal(one["shupe_mohr"], chain.contributions["shupe_mohr"])


def test_blocks_give_the_whole(inputs, everything):
    # Jumps of hundreds of deg/s would hide everything else.
    twin = everything.without_effect("fringe_jump")
    whole = through_chain(twin, fresh(inputs), fresh(inputs)).output
    memory, parts = Memory(), []
    for start, stop in ((0, 1), (1, 400), (400, 401), (401, len(inputs))):
        given = block(inputs, start, stop, memory)
        parts.append(through_chain(twin, given, given).output)
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-12, atol=1e-9)


def test_a_small_amplitude_contributes_its_response(inputs):
    """The chain's part of an effect is the amplitude times the response that a diagnosis regresses on."""
    bare = Twin()
    for id, declared in effects().items():
        if not isinstance(declared, BiasEffect):
            continue
        amplitude = declared.amplitude.typical("navigation")
        twin = bare.with_effect(id, amplitude)
        shape = twin.settings[id].shape
        found = through_chain(twin, fresh(inputs), fresh(inputs)).output
        without = through_chain(bare, fresh(inputs), fresh(inputs)).output
        wanted = amplitude * declared.response(fresh(inputs), **shape)
        np.testing.assert_allclose(found - without, wanted, rtol=1e-9, atol=1e-9, err_msg=id)


def test_sensor_effects_add_to_a_replay_that_trusts_sensors(inputs):
    twin = Twin(nominal=replace(CONSTANTS, m=0.0)).with_effect("sensor_offset", 0.1, gain=0.0)
    true = inputs.temperatures
    shown = {name: values + 0.1 for name, values in true.items()}
    measured = replace(fresh(inputs), temperatures=shown)
    truth = through_chain(twin, fresh(inputs), fresh(inputs)).output
    naive = through_chain(twin, measured, measured).output
    corrected = through_chain(twin, fresh(measured), fresh(measured), trusting=True).output
    assert np.abs(naive - truth).max() > 1e-3
    # To first order: what is left is curvature times the offset squared.
    curvature = 2e-4 + 1e-6 * 0.2 * np.abs(inputs.input_rate_deg_h)
    assert np.all(np.abs(corrected - truth) <= 1.01 * curvature * 0.1**2 + 1e-9)


def test_stated_errors_of_a_sensor(inputs):
    sensors = Sensors(SensorErrors(noise=0.02, lag=30.0), {"T_out": SensorErrors(resolution=0.0625)})
    twin, rng = Twin(sensors=sensors), {"T_in": np.random.default_rng(0)}
    place = inputs.temperatures["T_in"]
    found = sensed(twin, "T_in", place, fresh(inputs), rng)
    # In a steady ramp a lag of tau is behind by tau times the rate.
    ramp = slice(600, 630)
    rate = np.gradient(place, inputs.time)[ramp]
    expected = place[ramp] - 30.0 * rate
    assert abs(np.mean(found[ramp] - expected)) < 4 * 0.02 / np.sqrt(30) + 0.003
    lagged = sensed(replace(twin, sensors=Sensors(SensorErrors(lag=30.0))), "T_in", place, fresh(inputs), rng)
    assert np.std(found - lagged) == pytest.approx(0.02, rel=0.05)
    stepped = sensed(twin, "T_out", place, fresh(inputs), rng)
    np.testing.assert_allclose(stepped / 0.0625, np.rint(stepped / 0.0625), atol=1e-9)
    assert np.abs(stepped - place).max() <= 0.0625 / 2 + 1e-12


def test_coil_sensors_alternate_between_the_faces():
    sensors = Sensors(single={"T4": SensorErrors(reads={"T_out": 0.8, "T_case": 0.2})})
    assert sensors.place("T1") == sensors.place("T3") == {"T_in": 1.0}
    assert sensors.place("T2") == {"T_out": 1.0}
    assert sensors.place("T4") == {"T_out": 0.8, "T_case": 0.2}
    assert sensors.place("T_case") == {"T_case": 1.0}
