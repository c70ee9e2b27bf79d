"""All effects in every attitude and hemisphere, and what symmetry and dimension demand of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.runs.facts import Facts
from fogml.twin.effect import BiasEffect, LoggerEffect, NoiseEffect, ScaleFactorEffect, SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.optics import Coil
from fogml.twin.registry import effect, effects
from fogml.twin.replay import replay
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin

PROGRAMME = {
    "power": "off",
    "steps": [
        {
            "soak at 25 degC for 20 min": [
                "power on at minute 0",
                "turn at 7 deg/s for 2 min, then -7 deg/s for 2 min, from minute 5",
                "radiation at 5 Gy/h for 5 min from minute 10",
            ]
        },
        {"ramp to 40 degC at 1 degC/min": ["fan off for 3 min from minute 4"]},
    ],
}
"""Power, turns back to where they began, a dose, a ramp, the fan."""
NODES = (
    *("T_in", "T_out", "T_case", "T_electronics", "T_chamber", "T_top", "T_bottom"),
    *("rate", "angle", "fan"),
)
DRIVES = ("power", "supply", "humidity", "vibration", "compressor", "heater", "dose")
COLUMNS = {"all": (*NODES, *DRIVES, "B_x", "B_y", "B_z"), "no field": (*NODES, *DRIVES)}
ACTING = {
    id: declared
    for id, declared in effects().items()
    if not isinstance(declared, NoiseEffect | SensorEffect) and not declared.seeded and not declared.conflicts
}
# What makes nonsense of a record, and jumps of hundreds of deg/s that would hide everything else.
DAMAGE = ("units_and_gaps", "fringe_jump", "logger_skew", "averaging")


def everything() -> Twin:
    twin = replace(load_twin("tactical"), settings={}, sensors=Twin().sensors)
    for id in ACTING:
        if id not in DAMAGE:
            twin = twin.with_effect(id)
    return twin.with_noise(N=0.0, B=0.0, K=0.0, Q=0.0, R=0.0)


@pytest.mark.parametrize("axis", ["up", "down", "north", "south", "east"])
@pytest.mark.parametrize("latitude", [50.0, -50.0])
def test_all_effects_at_once_replay_as_they_were_simulated(axis: str, latitude: float) -> None:
    """From the truth and from every set of columns that holds what the effects ask for."""
    twin, facts = everything(), Facts(latitude=latitude, input_axis=axis)
    for columns in COLUMNS.values():
        made = simulate(PROGRAMME, twin, sample_s=5.0, facts=facts, columns=columns, truth=True)
        assert replay(twin, made.run, truth=made.truth) == pytest.approx(made.truth.noise_free, abs=1e-8)
        assert replay(twin, made.run) == pytest.approx(made.run.gyro, abs=1e-6)
        parts = sum(part for id, part in made.truth.contributions.items() if id not in hidden_by_nodes())
        assert parts == pytest.approx(made.truth.noise_free, abs=1e-8)


def hidden_by_nodes() -> set[str]:
    """Thermal effects whose part is one of the nodes, beside the sum."""
    return {id for id, declared in effects().items() if declared.stage == "thermal"} - {"hidden_thermal_node"}


def resting(minutes: int = 200, **changes: object) -> Inputs:
    """A unit that is warm, at 25 degC throughout, at rest, with nothing acting on it, at the equator."""
    count = 60 * minutes
    still = {name: np.full(count, 25.0) for name in (*NODES[:7], "T", "T_leads", "T_hub", "T_plate")}
    given = Inputs(
        np.arange(float(count)), still, np.zeros(count), facts=Facts(latitude=0.0, input_axis="east")
    )
    return replace(given, **changes)  # type: ignore[arg-type]


NEVER_ZERO = {
    "magnetic": "Earth's field",
    "earth_rate": "it is a constant",
    "turn_on_bias": "it is a constant",
    "kerr": "light",
    "intensity_modulation": "modulation",
    "ageing": "time",
    "supply_ripple": "a line",
    "chamber_pickup": "a cycle of its own where no machine is recorded",
    "acoustic": "a line",
    "table_jitter": "a line",
    "glass_transition": "a step that has been passed",
    "fringe_jump": "a jump",
    "time_base": "a turnover away from 25 degC",
    "input_axis_misalignment": "Earth rate across the axis",
    "table_wobble": "Earth rate across the axis",
    "sensor_quantisation": "a step may hide anything",
    "g_sensitivity": "weight",
}
"""Effects that act on a unit at rest, and by what."""


@pytest.mark.parametrize("id", [id for id in ACTING if id not in NEVER_ZERO])
def test_nothing_comes_of_nothing(id: str) -> None:
    """At rest, at 25 degC, with all drives at rest and no rate about the axis: no effect, exactly."""
    declared = effect(id)
    found = declared.response(resting(), **declared.default_shape())
    assert np.abs(found).max() <= 1e-15


@pytest.mark.parametrize(
    "id", [id for id, d in ACTING.items() if isinstance(d, BiasEffect) and "T" in d.needs]
)
def test_bias_of_the_coils_temperature_does_not_know_the_rate(id: str) -> None:
    declared = effect(id)
    count = 12000
    ramp = 25.0 + 30.0 * np.clip((np.arange(count) - 1000.0) / 6000.0, 0.0, 1.0)
    nodes = dict.fromkeys(resting().temperatures, ramp) | {"T_electronics": ramp[::-1].copy()}
    still = resting(temperatures=nodes)
    turning = replace(still.afresh(), table_rate=np.full(count, 50.0), cache={})
    shape = declared.default_shape()
    assert np.array_equal(declared.response(still.afresh(), **shape), declared.response(turning, **shape))


@pytest.mark.parametrize("id", [id for id, d in ACTING.items() if isinstance(d, ScaleFactorEffect)])
def test_scale_factor_is_odd_in_the_rate_and_vanishes_with_it(id: str) -> None:
    """Odd but for the asymmetry, which is even; in proportion but for the nonlinearity."""
    declared, shape = effect(id), effect(id).default_shape()
    warm = {name: np.linspace(25.0, 60.0, 600) for name in resting().temperatures}

    def shown(rate: float) -> FloatArray:
        given = resting(10, temperatures=warm, drives={"dose": np.linspace(0.0, 5.0, 600)})
        return declared.response(replace(given, table_rate=np.full(600, rate)), **shape)

    sign = 1.0 if id == "sf_asymmetry" else -1.0
    assert shown(20.0) == pytest.approx(sign * shown(-20.0), abs=1e-12)
    assert not shown(0.0).any() and shown(20.0).any()
    if id != "sf_nonlinearity":
        assert shown(40.0) == pytest.approx(2.0 * shown(20.0), rel=1e-9, abs=1e-12)


SCALING = {
    "shupe_winding": (1.0, -1.0),
    "pigtail_shupe": (0.0, -1.0),
    "shupe_trim": (0.0, -1.0),
    "intensity_modulation": (-1.0, -1.0),
    "fringe_jump": (-1.0, -1.0),
    "proper_frequency_mismatch": (0.0, 0.0),
}
"""Powers of the coil's length and diameter that a response goes with: K_S is in proportion to both."""


@pytest.mark.parametrize("id", list(SCALING))
def test_responses_scale_with_the_units_coil(id: str) -> None:
    declared, (of_length, of_diameter) = effect(id), SCALING[id]
    time = np.arange(4000.0)
    nodes = {"T": 25.0 + 0.01 * time, "T_case": 25.0 + 0.02 * time, "T_electronics": 25.0 + 0.003 * time}
    nodes["T_out"] = 25.0 + 1e-6 * time**2

    def shown(coil: Coil) -> FloatArray:
        given = Inputs(time, nodes, np.zeros(4000), coil=coil, rate_window_s=0.0)
        return declared.response(given, **declared.default_shape())

    reference = shown(Coil())
    assert np.abs(reference).max() > 0.0
    assert shown(Coil(length=3000.0)) == pytest.approx(3.0**of_length * reference)
    assert shown(Coil(diameter=0.05)) == pytest.approx(0.5**of_diameter * reference)


def test_a_twin_states_its_coil_and_its_replay_knows_it(tmp_path) -> None:
    from fogml.twin.twin_file import save_twin

    twin = replace(Twin(plant=load_twin("tactical").plant), coil=Coil(length=2000.0, diameter=0.06))
    twin = twin.with_effect("pigtail_shupe").with_effect("intensity_modulation")
    save_twin(twin, tmp_path / "twin.yaml")
    again = load_twin(tmp_path / "twin.yaml")
    assert again.coil == twin.coil
    made = simulate(PROGRAMME, twin, sample_s=5.0)
    assert replay(again, made.run) == pytest.approx(made.run.gyro, abs=1e-6)
    reference = replace(twin, coil=Coil())
    assert np.abs(replay(reference, made.run) - made.run.gyro).max() > 1e-2


@pytest.mark.parametrize("id", ["logger_skew", "averaging"])
def test_a_clock_and_an_average_leave_a_constant_alone(id: str) -> None:
    declared, output = effect(id), np.full(600, 7.5)
    assert isinstance(declared, LoggerEffect)
    found = declared.record(output, resting(10), declared.amplitude.typical(), **declared.default_shape())
    assert np.array_equal(found, output)
