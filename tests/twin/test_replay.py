"""Replay: a simulated run comes back, from truth to rounding, from its columns to the sensors' errors."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.twin import simulate as simulating
from fogml.twin.effect import NoiseEffect, SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import NoiseConstants
from fogml.twin.nominal import NominalConstants
from fogml.twin.registry import effect, effects
from fogml.twin.replay import inputs_of_run, replay
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import DEFAULT_COLUMNS, simulate
from fogml.twin.truth import read_truth, truth_from_columns
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin

PROGRAMME = [
    {"soak at 25 degC for 40 min": ["power on at minute 2", "turn at 5 deg/s for 60 s from minute 10"]},
    {"ramp to -10 degC at 1 degC/min": ["power off for 5 min from minute 20"]},
    {
        "soak at -10 degC for 1 h": [
            "turn at -5 deg/s for 60 s from minute 30",
            "fan off for 5 min from minute 40",
        ]
    },
    "ramp to 40 degC at 2 degC/min",
    "soak at 40 degC for 30 min",
]
SEEN: list[object] = [{"soak at 25 degC for 40 min": ["turn at 5 deg/s for 60 s from minute 10"]}]
SEEN += ["ramp to -10 degC at 1 degC/min", *PROGRAMME[2:]]
"""The same with the power on throughout: what moves while it is off is in no row."""
DAMAGE = ("fringe_jump", "units_and_gaps")
COLUMNS = (*DEFAULT_COLUMNS, "T_top", "T_bottom")
CONSTANTS = NominalConstants(300, 20, 0.2, 2, 0.02, 2e-4, 0.3, 1.0)
NOISE = NoiseConstants(N=0.01, B=0.05, K=0.01)


def everything(stop: type | tuple[type, ...] = (), seeded: bool = True, **more) -> Twin:
    """All effects on but damage, those of some kinds, and where not wanted those that a simulation draws."""
    twin = Twin("all", nominal=CONSTANTS, noise=NOISE, **more)
    for id, declared in effects().items():
        wanted = not isinstance(declared, stop) and (seeded or not declared.seeded)
        if id not in DAMAGE and not declared.conflicts and wanted:
            twin = twin.with_effect(id)
    return twin


def test_truth_comes_back_to_rounding(monkeypatch):
    # Blocks as in a long simulation: the replay works the whole run at once.
    monkeypatch.setattr(simulating, "BLOCK_ROWS", 3000)
    twin = everything(sensors=Sensors(SensorErrors(0.01, 0.01, 20.0)))
    assert len(twin.settings) > 45
    made = simulate(SEEN, twin, seed=1, truth=True)
    found = replay(twin, made.run, truth=made.truth)
    assert np.abs(found - made.truth.noise_free).max() <= 1e-9
    assert np.abs(made.run.gyro - made.truth.noise_free).max() > 0.1


def test_recorded_columns_without_sensor_errors_are_as_good():
    twin = everything(SensorEffect, seeded=False)
    made = simulate(SEEN, twin, truth=True, columns=COLUMNS)
    found = replay(twin, made.run)
    assert np.abs(found - made.truth.noise_free).max() <= 1e-9


def test_recorded_columns_are_good_to_the_sensors_errors():
    """No worse than errors of the stated size make the replay, worked out by other draws of them."""
    errors = SensorErrors(noise=0.01, resolution=0.01)
    twin = everything(SensorEffect, sensors=Sensors(errors))
    made = simulate(PROGRAMME, twin, seed=1, truth=True)
    left = replay(twin, made.run) - made.truth.noise_free
    rng, drawn = np.random.default_rng(5), []
    exact = {name: made.truth.nodes[name] for name in made.run.temperature_columns}
    for _ in range(4):
        noisy = {n: x + 0.01 * rng.standard_normal(len(x)) for n, x in exact.items()}
        stepped = {n: 0.01 * np.rint(x / 0.01) for n, x in noisy.items()}
        drawn.append(replay(twin, made.run.with_columns(**stepped)) - made.truth.noise_free)
    allowed = np.std(drawn)
    assert np.std(left) <= 1.2 * allowed
    assert np.abs(left).max() <= 1.5 * np.abs(drawn).max()
    # And it is small beside what there is to replay.
    assert np.std(left) < 0.03 * np.std(made.run.error_deg_h)


def test_missing_nodes_come_from_the_plant():
    """With the case not recorded the plant gives it: nearly as good, and better than a stand-in."""
    twin = Twin(nominal=CONSTANTS).with_effect("pigtail_shupe", 0.5).with_effect("source_wavelength", 50.0)
    made = simulate(PROGRAMME, twin, truth=True)
    size = np.std(sum(made.truth.contributions[id] for id in twin.settings))
    poor = Run(
        "poor",
        {n: v for n, v in made.run.columns.items() if n not in ("T_case", "T_electronics")},
        made.run.facts,
    )
    left = np.std(replay(twin, poor) - made.truth.noise_free)
    assert left < 0.02 * size
    blind = Run("blind", {n: v for n, v in poor.columns.items() if n != "T_chamber"}, poor.facts)
    assert np.std(replay(twin, blind) - made.truth.noise_free) < 0.25 * size


def test_only_one_effect():
    twin = everything(SensorEffect, seeded=False)
    made = simulate(PROGRAMME, twin, sample_s=5.0, truth=True, columns=COLUMNS)
    whole = replay(twin, made.run)
    for id in ("thermal_hysteresis", "coil_expansion", "deadband", "logger_skew"):
        wanted = whole - replay(twin.without_effect(id), made.run)
        np.testing.assert_allclose(replay(twin, made.run, only=id), wanted, atol=1e-9)
        np.testing.assert_allclose(replay(twin, made.run, only=id, truth=made.truth), wanted, atol=1e-6)
    bias = Twin().with_effect("thermal_hysteresis").with_effect("warmup_bias")
    clean = simulate(PROGRAMME, bias, sample_s=5.0, truth=True)
    np.testing.assert_allclose(
        replay(bias, clean.run, only="thermal_hysteresis"),
        clean.truth.contributions["thermal_hysteresis"],
        atol=1e-9,
    )
    with pytest.raises(InputError, match="'moisture' is not on"):
        replay(bias, clean.run, only="moisture")


def test_only_an_effect_on_the_nodes():
    twin = Twin(nominal=CONSTANTS).with_effect("self_heating", 10.0)
    made = simulate(PROGRAMME, twin, sample_s=5.0, truth=True)
    # The truth holds the nodes, so that the simulation's own difference is the answer.
    np.testing.assert_array_equal(
        replay(twin, made.run, only="self_heating", truth=made.truth),
        made.truth.contributions["self_heating"],
    )
    bare = replace(made.truth, contributions={})
    with pytest.raises(InputError, match="acts by way of the temperatures"):
        replay(twin, made.run, only="self_heating", truth=bare)


def test_a_changed_effect_alone_is_worked_out_again(monkeypatch):
    twin = everything()
    made = simulate(PROGRAMME, twin, sample_s=10.0)
    replay(twin, made.run)
    calls = []
    for id in effects():
        kind = type(effect(id))
        plain = kind.signature

        def counted(self, inputs, _plain=plain, **shape):
            calls.append(self.id)
            return _plain(self, inputs, **shape)

        monkeypatch.setattr(kind, "signature", counted)
    changed = twin.with_effect("thermal_hysteresis", half_width=5.0).with_effect("moisture", 0.7)
    found = replay(changed, made.run)
    linear = {id for id in calls if effect(id).stage in ("rig", "bias", "scale_factor", "sensor", "thermal")}
    # An amplitude alone costs no signature at all.
    assert linear == {"thermal_hysteresis"}
    again = Run("again", made.run.columns, made.run.facts)
    np.testing.assert_array_equal(found, replay(changed, again))


def test_nominal_constants_change_what_sensors_cost():
    """Slopes go with the constants: nothing stale is reused."""
    twin = Twin(nominal=CONSTANTS).with_effect("sensor_lag", 100.0)
    made = simulate(PROGRAMME, twin, sample_s=10.0)
    replay(twin, made.run)
    steeper = twin.with_nominal(b1=0.5)
    again = Run("again", made.run.columns, made.run.facts)
    np.testing.assert_array_equal(replay(steeper, made.run), replay(steeper, again))


def test_power_cycles_are_read_back():
    made = simulate(PROGRAMME, Twin().with_effect("turn_on_bias"), truth=True)
    inputs, windows = inputs_of_run(made.run)
    assert inputs.powered_on_s == 120.0
    assert inputs.power_ons_s == pytest.approx((40 * 60 + 25 * 60,))
    assert windows[0][1] == pytest.approx(40 * 60 + 20 * 60, abs=1.0)
    # What each cycle drew, only the truth holds.
    told = replay(Twin().with_effect("turn_on_bias"), made.run, truth=made.truth)
    np.testing.assert_allclose(told, made.truth.noise_free, atol=1e-12)


def test_another_runs_truth_is_refused():
    twin = Twin()
    made = simulate(PROGRAMME, twin, sample_s=10.0, truth=True)
    other = simulate(PROGRAMME, twin, sample_s=20.0).run
    with pytest.raises(InputError, match="not those of the truth"):
        replay(twin, other, truth=made.truth)
    with pytest.raises(InputError, match="no column 'noise_free'"):
        columns = made.truth.columns()
        truth_from_columns({cell: v for cell, v in columns.items() if "noise_free" not in cell})


@pytest.mark.parametrize("name", ["thermal-cycle-2-x", "cold-start-y", "two-temperatures-hot-z"])
def test_recordings_replay_with_every_effect(name):
    run = shipped_run(name)
    twin = everything(NoiseEffect)
    found = replay(twin, run)
    assert found.shape == (len(run),) and np.isfinite(found).all()


def test_a_single_sensor_leaves_the_gradient_out():
    time = np.arange(0.0, 3600.0)
    run = Run.from_columns("one", time=time, gyro=np.zeros(3600), T=25.0 + time / 60.0)
    found = replay(Twin(nominal=NominalConstants(b0=1.0, b1=0.1, g=5.0)).with_effect("shupe_pure"), run)
    without = replay(Twin(nominal=NominalConstants(b0=1.0, b1=0.1)).with_effect("shupe_pure"), run)
    np.testing.assert_array_equal(found, without)
    assert np.abs(without - (1.0 + 0.1 * (run.columns["T"] - 25.0))).max() > 0.01


def test_without_temperatures_the_message_says_so():
    run = Run.from_columns("none", time=np.arange(10.0), gyro=np.zeros(10))
    with pytest.raises(InputError, match="no temperature"):
        replay(load_twin("tactical"), run)


def test_rates_of_noisy_readings_come_without_delay():
    """Windows on both sides of a sample: what the replay makes is where the truth is, not a window later."""
    twin = Twin(nominal=CONSTANTS, sensors=Sensors(SensorErrors(noise=0.002))).with_effect("shupe_pure", 10.0)
    made = simulate(PROGRAMME, twin, seed=2, truth=True)
    true = made.truth.contributions["shupe_pure"]
    found = replay(twin, made.run, only="shupe_pure")
    shifts = (-60, -20, 0, 20, 60)
    inner = slice(100, -100)
    off = [np.std((np.roll(found, -shift) - true)[inner]) for shift in shifts]
    assert shifts[int(np.argmin(off))] == 0
    assert off[2] < 0.3 * np.std(true)


def test_a_steady_turn_dims_a_side_on_gradient_as_its_mean_over_the_sample():
    """A quarter of a turn from sample to sample: the mean of the cosine, worked out over fine steps."""
    time = 10.0 * np.arange(200.0)
    given = Inputs(
        time=time,
        temperatures={"T_in": 25.0 - time / 60.0, "T_out": 25.0 + time / 60.0},
        table_rate=np.full(200, 9.0),
        drives={"angle": (9.0 * time) % 360.0},
        rate_window_s=0.0,
    )
    found = effect("azimuthal_gradient").signature(given, phase=40.0)
    fine = (np.arange(1000) + 0.5) / 1000.0
    angles = 9.0 * (time[1:, None] - 10.0 + 10.0 * fine)
    np.testing.assert_allclose(found[1:], 2.0 * np.cos(np.radians(angles - 40.0)).mean(axis=1), atol=1e-4)


@pytest.mark.parametrize("sample_s", [1.0, 30.0, 120.0])
def test_replay_of_a_noise_free_run_is_the_simulation_however_slow_its_samples(sample_s):
    """Smooth temperatures of slow samples are no noisy ones."""
    twin = Twin(plant=load_twin("tactical").plant).with_effect("shupe_pure").with_effect("shupe_mohr")
    made = simulate("multi-point-cycle", twin, sample_s=sample_s)
    assert np.abs(made.run.gyro - made.run.gyro[0]).max() > 0.1
    np.testing.assert_allclose(replay(twin, made.run), made.run.gyro, atol=1e-9)


@pytest.mark.parametrize("every", [10, 20, 45, 60, 100, 128, 200])
def test_a_run_that_kept_few_samples_has_the_gyros_own_windows_of_64_s(every):
    """Replayed from one sample in so many of a run at 1 s: what the gyro put out there."""
    twin = Twin(plant=load_twin("tactical").plant).with_nominal(m=2.0)
    run = simulate("multi-point-cycle", twin).run
    few = Run("few", {name: values[::every] for name, values in run.columns.items()}, run.facts)
    later = few.time > 400.0
    found, true = replay(twin, few)[later], few.gyro[later]
    assert np.abs(true).max() > 1.9
    assert found @ true == pytest.approx(true @ true, rel=3e-3)
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.03 * np.sqrt(np.mean(true**2))


@pytest.mark.parametrize("sample_s", [1.0, 30.0])
def test_noisy_readings_are_still_told_from_quiet_ones(sample_s):
    twin = replace(load_twin("tactical"), settings={})
    noisy, _ = inputs_of_run(simulate("multi-point-cycle", twin, sample_s=sample_s).run)
    assert noisy.rate_window_s > 0.0


def test_warm_up_of_a_unit_that_draws_no_power_begins_when_it_was_switched_on() -> None:
    twin = replace(Twin().with_effect("warmup_bias", 2.0), noise=NoiseConstants())
    made = simulate(["hold for 10 min", {"hold for 1 h": ["power on"]}], twin, sample_s=10.0, truth=True)
    assert made.truth is not None and not made.run.columns["power"].any()
    np.testing.assert_allclose(replay(twin, made.run), made.truth.noise_free, atol=1e-9)


def test_a_drawn_effect_of_no_size_leaves_the_replay_of_a_truth_alone() -> None:
    twin = replace(Twin().with_nominal(b0=1.0).with_effect("turn_on_bias", 0.0), noise=NoiseConstants())
    made = simulate(["hold for 10 min"], twin, sample_s=10.0, truth=True)
    assert made.truth is not None
    np.testing.assert_allclose(replay(twin, made.run, truth=made.truth), made.truth.noise_free)


def test_a_truth_that_went_through_a_spreadsheet(tmp_path) -> None:
    """A time since power-on of no value comes back as an empty cell; a column that comes twice is told."""
    cells = "time [s],rate [deg/s],time_on [s],noise_free [deg/h],noise [deg/h],T_in [degC]"
    (tmp_path / "empty.csv").write_text(f"{cells}\n0,0,,1,0,25\n1,0,,1,0,25\n")
    assert np.isinf(read_truth(tmp_path / "empty.csv").time_on).all()
    (tmp_path / "twice.csv").write_text(f"{cells},T_in [degC]\n0,0,,1,0,25,25\n")
    with pytest.raises(InputError, match="two of its columns have one name"):
        read_truth(tmp_path / "twice.csv")


def test_what_is_kept_of_a_replay_is_its_own_run_s_and_goes_with_it():
    """Equal runs are not sought by what they hold, which would read a long run whole."""
    run = simulate(["soak at 25 degC for 10 min"], "nominal", sample_s=10.0).run
    expected = replay("nominal", run)
    again = Run(run.name, run.columns, run.facts)
    assert np.array_equal(replay("nominal", again), expected)
    assert "hash" not in {**vars(run), **vars(again)} and again == run
    kept = weakref.ref(run)
    del run
    gc.collect()
    assert kept() is None
