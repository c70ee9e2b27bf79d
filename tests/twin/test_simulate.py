"""Simulation: blocks against the whole, files against memory, truth against the run, and what is refused."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.facts import EARTH_RATE_DEG_H, Facts
from fogml.runs.reading import read_run
from fogml.signals.allan import allan_deviation
from fogml.twin import simulate as simulating
from fogml.twin.noise import NoiseConstants
from fogml.twin.nominal import NominalConstants
from fogml.twin.registry import effects
from fogml.twin.replay import replay
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import simulate, world_of, write_world
from fogml.twin.truth import read_truth
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin
from tests.twin.allan import allan_variance

QUICK = [
    {"soak at 25 degC for 20 min": ["power on at minute 2", "turn at 5 deg/s for 60 s from minute 10"]},
    "ramp to 45 degC at 2 degC/min",
    {"soak at 45 degC for 20 min": ["power off for 3 min from minute 10"]},
]
# Jumps of hundreds of deg/s and wrong units would hide all else.
DAMAGE = ("fringe_jump", "units_and_gaps")


def everything(**more) -> Twin:
    twin = Twin("all", nominal=NominalConstants(300, 20, 0.2, 2, 0.02, 2e-4, 0.3, 1.0), **more)
    for id, declared in effects().items():
        if id not in DAMAGE and not declared.conflicts:
            twin = twin.with_effect(id)
    return twin


@pytest.mark.parametrize("skew", [2.4, -60.0, -300.0], ids="late {}".format)
def test_blocks_do_not_matter(monkeypatch, skew):
    """Nor where a clock runs ahead, by more than a block too."""
    twin = everything(
        noise=NoiseConstants(N=0.01, B=0.1, K=0.1), sensors=Sensors(SensorErrors(0.01, 0.01, 20.0))
    ).with_effect("logger_skew", skew, growth=0.3)
    whole = simulate(QUICK, twin, seed=4, truth=True)
    monkeypatch.setattr(simulating, "BLOCK_ROWS", 333)
    pieces = simulate(QUICK, twin, seed=4, truth=True)
    assert set(whole.run.columns) == set(pieces.run.columns)
    for name, values in whole.run.columns.items():
        np.testing.assert_allclose(pieces.run.columns[name], values, rtol=1e-11, atol=1e-9, err_msg=name)
    for cell, values in whole.truth.columns().items():
        np.testing.assert_allclose(pieces.truth.columns()[cell], values, rtol=1e-10, atol=1e-8, err_msg=cell)


@pytest.mark.parametrize("id", ["logger_skew", "averaging", "output_counts", "units_and_gaps"])
def test_a_unit_may_be_off_for_longer_than_a_block_before_it_is_first_on(monkeypatch, id):
    """Nothing is logged of such a block."""
    twin = replace(load_twin("tactical"), settings={}, noise=NoiseConstants()).with_effect(id)
    steps = ["soak at 25 degC for 20 min", {"ramp to 40 degC at 1 degC/min": ["power on at minute 10"]}]
    whole = simulate(steps, twin, truth=True)
    monkeypatch.setattr(simulating, "BLOCK_ROWS", 300)
    pieces = simulate(steps, twin, truth=True)
    assert len(whole.run) == 300
    np.testing.assert_allclose(pieces.run.gyro, whole.run.gyro, atol=1e-9)
    part = whole.truth.contributions[id]
    np.testing.assert_allclose(pieces.truth.contributions[id], part, atol=1e-9)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_file_holds_what_memory_does(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(simulating, "BLOCK_ROWS", 700)
    twin, path, beside = load_twin("tactical"), tmp_path / f"run{suffix}", tmp_path / f"truth{suffix}"
    seen = []
    rows = write_world(world_of(QUICK, twin, 2.0, 9, None, None, truth=True), path, beside, seen.append)
    expected = simulate(QUICK, twin, sample_s=2.0, seed=9, truth=True)
    run, true = read_run(path), read_truth(beside)
    assert rows == len(run) == len(expected.run)
    # The programme lasts 3000 s.
    assert seen == [700, 700, 100]
    assert run.facts == expected.run.facts and run.facts.unit == "tactical"
    assert run.facts.notes is not None and run.facts.notes.startswith("synthetic: ")
    for name, values in expected.run.columns.items():
        np.testing.assert_array_equal(run.columns[name], values, err_msg=name)
    for cell, values in expected.truth.columns().items():
        np.testing.assert_array_equal(true.columns()[cell], values, err_msg=cell)


def test_the_seed_is_all_that_is_random():
    twin = load_twin("tactical")
    a, b, c = (simulate(QUICK, twin, sample_s=5.0, seed=s).run for s in (1, 1, 2))
    assert a.hash == b.hash != c.hash
    # A source of its own for each: another column leaves the rest alone.
    fewer = simulate(QUICK, twin, sample_s=5.0, seed=1, columns=("T_out",)).run
    assert list(fewer.columns) == ["time", "gyro", "T_out", "time_on"]
    np.testing.assert_array_equal(fewer.gyro, a.gyro)
    np.testing.assert_array_equal(fewer.columns["T_out"], a.columns["T_out"])


def test_nothing_is_recorded_while_the_unit_is_off():
    run = simulate(QUICK, Twin(), sample_s=1.0).run
    total = 20 * 60 + 10 * 60 + 20 * 60
    assert len(run) == total - 120 - 180
    assert run.time[0] == 120.0 and run.facts.powered_on == 120.0
    (again,) = np.flatnonzero(np.diff(run.time) > 1.0)
    assert run.columns["time_on"][0] == 0.0 and run.columns["time_on"][again + 1] == 0.0
    with pytest.raises(InputError, match="never on"):
        simulate([{"soak at 25 degC for 1 min": ["power off"]}], Twin())


def test_truth_adds_up():
    result = simulate(QUICK, everything(noise=NoiseConstants(N=0.02)), sample_s=2.0, truth=True)
    true, gyro = result.truth, result.run.gyro
    parts, stage = true.contributions, {id: declared.stage for id, declared in effects().items()}
    beside = {id for id in parts if stage.get(id) in ("thermal", "sensor") and id != "hidden_thermal_node"}
    random = {id for id in parts if stage.get(id) == "noise" and id != "rate_ramp"}
    added = np.sum([values for id, values in parts.items() if id not in beside | random], axis=0)
    np.testing.assert_allclose(added, true.noise_free, rtol=0.0, atol=1e-8)
    assert set(parts) == {"nominal", *everything().settings}
    assert all(np.isfinite(values).all() for values in parts.values())
    # Loggers move the noise as well; without them it is on top.
    bare = everything(noise=NoiseConstants(N=0.02))
    bare = bare.without_effect(*(id for id in bare.settings if stage[id] == "logger"))
    result = simulate(QUICK, bare, sample_s=2.0, truth=True)
    total = result.truth.noise_free + result.truth.noise
    np.testing.assert_allclose(total, result.run.gyro, rtol=1e-13, atol=1e-9)
    assert not np.array_equal(gyro, result.run.gyro)


def test_each_logger_effect_has_its_own_contribution():
    """A delay, then a mean: each against the two made by hand from the output before the logger."""
    both = Twin(nominal=NominalConstants(m=2.0)).with_effect("logger_skew", 2.0, growth=0.0)
    both = both.with_effect("averaging", 4.0)
    parts = simulate(QUICK, both, truth=True).truth.contributions
    delayed = np.concatenate([parts["nominal"][:1], parts["nominal"][:1], parts["nominal"][:-2]])
    rows = slice(130, 1000)
    np.testing.assert_allclose(parts["logger_skew"][rows], (delayed - parts["nominal"])[rows], atol=1e-9)
    mean = sum(0.25 * np.roll(delayed, k) for k in range(4))
    np.testing.assert_allclose(parts["averaging"][rows], (mean - delayed)[rows], atol=1e-7)
    assert np.abs(parts["logger_skew"][rows]).max() > 1.0 < np.abs(parts["averaging"][rows]).max()


def test_each_random_effect_has_its_own_part_of_the_noise():
    ids = {"angle_random_walk": 0.03, "bias_instability": 0.5, "gauss_markov": 0.4, "sinusoidal": 0.2}
    twin = Twin(noise=NoiseConstants(N=0.02))
    for id, amplitude in ids.items():
        twin = twin.with_effect(id, amplitude)
    true = simulate(QUICK, twin, seed=3, truth=True).truth
    rest = true.noise - np.sum([true.contributions[id] for id in ids], axis=0)
    own = simulate(QUICK, twin.without_effect(*ids), seed=3, truth=True).truth.noise
    np.testing.assert_allclose(rest, own, atol=1e-12)
    for id in ids:
        # A source of its own: the others don't matter to it.
        single = Twin().with_effect(id, ids[id], **twin.settings[id].shape)
        alone = simulate(QUICK, single, seed=3, truth=True)
        np.testing.assert_array_equal(alone.truth.noise, true.contributions[id], err_msg=id)
    assert np.std(true.contributions["angle_random_walk"]) == pytest.approx(0.03 * 60.0, rel=0.05)
    plain = simulate(QUICK, twin, seed=3).run
    np.testing.assert_array_equal(plain.gyro, simulate(QUICK, twin, seed=3, truth=True).run.gyro)


def test_allan_deviation_is_that_of_own_noise_and_random_effects_together():
    twin = Twin(noise=NoiseConstants(Q=2.0, N=0.02, B=0.3)).with_effect("angle_random_walk", 0.03)
    twin = twin.with_effect("bias_instability", 0.4).with_effect("quantisation", 3.0)
    found = simulate(["soak at 25 degC for 40 h"], twin, sample_s=2.0, seed=1, columns=(), truth=True)
    taus = np.array([2.0, 16.0, 128.0, 1024.0])
    wanted = np.sqrt(allan_variance(taus, Q=np.hypot(2.0, 3.0), N=np.hypot(0.02, 0.03), B=0.5))
    np.testing.assert_allclose(allan_deviation(found.truth.noise, 2.0, taus).adev, wanted, rtol=0.12)


def test_photon_noise_rises_with_the_light_that_is_lost():
    """Closed form of the catalogue with P0 falling by 0.05 dB per degC off 25 degC."""
    shape = {"power": 10.0, "modulation_depth": 2.4, "power_loss": 0.05}
    twin = Twin().with_effect("arw_physics", 1.0, **shape)
    hot = [{"soak at 85 degC for 5 h": ["power on at minute 60"]}]
    found = simulate(hot, twin, truth=True, seed=2).truth
    # Past the heating of the electronics after power-on.
    rows = slice(7200, None)
    away = np.mean(found.nodes["T_electronics"][rows]) - 25.0
    assert away > 55.0

    def walk(power: float) -> float:
        current = 0.9 * power * (1.0 + np.cos(2.4)) / 2.0
        excess = 2.0 * np.sqrt(2.0 * np.log(2.0) / np.pi) * 1550e-9**2 / (299_792_458.0 * 10e-9)
        density = 2 * 1.602176634e-19 * current + 4 * 1.380649e-23 * 300.0 / 100e3 + current**2 * excess
        density /= (0.9 * power * np.sin(2.4) / 2.0) ** 2
        return np.degrees(np.sqrt(density / 2.0) / 1.352) * 60.0

    wanted = walk(10e-6 * 10 ** (-0.005 * away))
    assert wanted > 1.15 * walk(10e-6)
    assert np.std(found.noise[rows]) / 60.0 == pytest.approx(wanted, rel=0.02)


def test_misalignment_costs_12_5_ppm_of_the_rate_in_simulation_and_replay():
    twin = Twin().with_effect("input_axis_misalignment", 5.0, direction=90.0)
    facts = Facts(latitude=90.0, input_axis="up")
    found = simulate(QUICK, twin, facts=facts, truth=True)
    rate = 3600.0 * found.run.rate + found.run.facts.earth_rate_deg_h
    wanted = -12.5e-6 * rate
    part = found.truth.contributions["input_axis_misalignment"]
    # At the pole the Earth turns about the upright table: no rate across it.
    np.testing.assert_allclose(part, wanted, rtol=1e-5, atol=1e-12)
    replayed = replay(twin, found.run, only="input_axis_misalignment")
    np.testing.assert_allclose(replayed, wanted, rtol=1e-5, atol=1e-9)
    assert np.abs(wanted).max() == pytest.approx(12.5e-6 * 18000.0, rel=1e-2)


def test_thermal_contribution_is_the_difference_of_two_simulations():
    twin = load_twin("tactical").with_noise(N=0.0, B=0.0, K=0.0, Q=0.0).with_effect("self_heating", 12.0)
    with_it = simulate(QUICK, twin, sample_s=5.0, truth=True)
    without = simulate(QUICK, twin.without_effect("self_heating"), sample_s=5.0)
    difference = with_it.run.gyro - without.run.gyro
    assert np.abs(difference).max() > 1e-3
    np.testing.assert_allclose(with_it.truth.contributions["self_heating"], difference, atol=1e-9)


def test_recorded_temperatures_are_the_nodes_with_stated_errors():
    exact = simulate(QUICK, Twin(), sample_s=1.0, truth=True)
    for name in ("T_in", "T_out", "T_case", "T_electronics", "T_chamber"):
        np.testing.assert_array_equal(exact.run.columns[name], exact.truth.nodes[name])
    stated = Twin(sensors=Sensors(SensorErrors(noise=0.02, resolution=0.05)))
    found = simulate(QUICK, stated, sample_s=1.0, columns=("T_in",), truth=True)
    error = found.run.columns["T_in"] - found.truth.nodes["T_in"]
    assert np.std(error) == pytest.approx(np.hypot(0.02, 0.05 / np.sqrt(12)), rel=0.1)


def test_coil_sensors_read_their_places():
    sensors = Sensors(single={"T4": SensorErrors(reads={"T_out": 0.75, "T_case": 0.25})})
    found = simulate(QUICK, Twin(sensors=sensors), sample_s=5.0, columns=("T1", "T2", "T3", "T4"), truth=True)
    nodes, columns = found.truth.nodes, found.run.columns
    np.testing.assert_array_equal(columns["T1"], nodes["T_in"])
    np.testing.assert_array_equal(columns["T3"], nodes["T_in"])
    np.testing.assert_array_equal(columns["T2"], nodes["T_out"])
    np.testing.assert_allclose(columns["T4"], 0.75 * nodes["T_out"] + 0.25 * nodes["T_case"], rtol=1e-14)


def test_attitude():
    turn = [{"soak at 25 degC for 10 min": ["turn at 5 deg/s for 60 s from minute 2"]}]
    up, down, north = (
        simulate(turn, Twin(), facts=Facts(latitude=30.0, input_axis=axis)).run
        for axis in ("up", "down", "north")
    )
    np.testing.assert_allclose(down.gyro, -up.gyro, atol=1e-9)
    assert up.gyro.max() == pytest.approx(5 * 3600 + 15.041067 * 0.5)
    # A table with an upright axis turns a level input axis through the headings instead.
    assert not north.rate.any()
    angle = np.radians(north.columns["angle"])
    np.testing.assert_allclose(north.gyro, 15.041067 * np.cos(np.radians(30.0)) * np.cos(angle), atol=1e-9)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"columns": ("T_hub",)}, "'T_hub' can't be recorded"),
        ({"columns": ("gyro",)}, "'gyro' can't be recorded"),
        ({"columns": ("rate", "rate")}, "named twice"),
        ({"sample_s": 0.0}, "'sample_s' is 0"),
        ({"seed": -1}, "'seed' is -1"),
    ],
)
def test_refused(more, message):
    with pytest.raises(InputError, match=message):
        simulate(QUICK, Twin(), **{"sample_s": 10.0, **more})


def test_a_sensor_needs_its_place():
    twin = Twin(sensors=Sensors(single={"T3": SensorErrors(reads={"T_nowhere": 1.0})}))
    with pytest.raises(InputError, match="'T3' reads 'T_nowhere'"):
        simulate(QUICK, twin, sample_s=10.0, columns=("T3",))


def test_a_run_of_bare_steps_says_so() -> None:
    notes = simulate(["soak at 25 degC for 10 min"], "tactical", seed=5).run.facts.notes
    assert notes == "synthetic: steps of its own, twin tactical, seed 5"


def test_facts_that_state_no_input_axis_leave_it_to_the_programme() -> None:
    """At 60 deg latitude an axis to the north sees half of Earth's rate, and turned to the west none."""
    stated = Facts(latitude=60.0)
    run = simulate("four-positions", Twin(), facts=stated).run
    assert run.facts.input_axis == "north"
    half = 0.5 * EARTH_RATE_DEG_H
    assert run.gyro[[30, 100, 170, 240]] == pytest.approx([half, 0.0, -half, 0.0], abs=1e-9)
    east = simulate("four-positions", Twin(), facts=stated.model_copy(update={"input_axis": "east"})).run
    assert east.facts.input_axis == "east"


def test_a_simulated_run_is_held_once() -> None:
    """Of each sample more than 200,000, memory grows by less than 1.6 times what the run holds of it."""
    held, most = [], []
    simulate(["soak at 25 degC for 2 h"], Twin(), sample_s=1.0)
    for count in (200_000, 400_000):
        tracemalloc.start()
        run = simulate(["soak at 25 degC for 2 h"], Twin(), sample_s=7200.0 / count).run
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        held.append(sum(values.nbytes for values in run.columns.values()))
    assert most[1] - most[0] < 1.6 * (held[1] - held[0])
