"""Runs as rows: what is masked, constants far off, what each run draws anew."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.catalogue import families_of, machines, moisture, other_plant, power_cycles
from fogml.gap.field import Columns
from fogml.gap.frame import setting_of
from fogml.gap.model import TwinModel
from fogml.gap.own_simulator import candidates_of
from fogml.gap.reading import rows_of
from fogml.gap.result_parts import ConstantFit
from fogml.gap.scene import Family, Scene, steps_are_coarse
from fogml.gap.sentences import assumed
from fogml.gap.settings import Priors
from fogml.gap.thermal_families import hidden_node, warm_up
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.nominal import NAMES
from fogml.twin.registry import effect
from fogml.twin.set_up import Sensors
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin

NOISE = NoiseModel(0.005, 0.0, 0.0)


def _cycle(name="a", offset=0.0, seed=1):
    """White noise of 0.1 deg/h about a constant, the temperature up and down by 40 degC."""
    time = 5.0 * np.arange(3000)
    gyro = offset + 0.1 * np.random.default_rng(seed).standard_normal(len(time))
    temperature = 25.0 + 20.0 * np.sin(2.0 * np.pi * time / time[-1])
    return Run.from_columns(name, time=time, gyro=gyro, T=temperature)


def _scene(*runs):
    return Scene(tuple(rows_of(run, load_twin("nominal"), 600) for run in runs), len(runs), "tactical")


@pytest.mark.parametrize("sample_s", [1.0, 7.0, 10.0, 20.0, 45.0, 60.0, 100.0])
def test_columns_of_the_constants_are_what_a_replay_makes_of_them(sample_s):
    """DeltaT is over 64 s in both, however slow the samples; they differ by when it is, some seconds."""
    time = sample_s * np.arange(max(300, int(18000.0 / sample_s)))
    temperature = 25.0 + 20.0 * np.sin(2.0 * np.pi * time / 9000.0)
    twin = load_twin("nominal")
    outer = temperature + 0.3 * np.cos(time / 2000.0)
    run = Run.from_columns("a", time=time, gyro=np.zeros(len(time)), T_in=temperature, T_out=outer)
    rows = rows_of(run, twin, 600)
    bare = rows.gap_of(twin)
    for name, column in zip(NAMES, rows.constants.T, strict=True):
        told = bare - rows.gap_of(twin.with_nominal(**{name: 1.0}))
        # The first rows meet a start that a replay knows no more of.
        later = rows.end_s > time[0] + 300.0
        slack = (0.04 if name == "m" else 2e-3) * max(np.abs(told).max(), 1e-9)
        assert column[later] == pytest.approx(told[later], abs=slack), name


def test_a_table_that_turns_across_the_axis_moves_the_air_as_in_a_simulation():
    """The case follows the chamber the faster; the rate about a level axis on an upright table is 0."""
    twin = replace(load_twin("tactical"), settings={}, sensors=Sensors())
    steps = [
        "soak at 25 degC for 1 h",
        {"ramp to 60 degC at 1 degC/min": ["turn at 80 deg/s"]},
        "soak at 60 degC for 1 h",
    ]
    facts = Facts(latitude=40.0, input_axis="north", table_axis="up")
    columns = ["T_chamber", "T_in", "rate", "angle", "fan"]
    made = simulate(steps, twin, sample_s=5.0, columns=columns, facts=facts, truth=True)
    even = rows_of(made.run, twin, 400).even
    case = np.interp(even.time, made.truth.time, made.truth.nodes["T_case"])
    assert even.temperature("T_case") == pytest.approx(case, abs=0.05)  # 0.5 with the air of a table at rest


def test_a_power_cycle_of_a_unit_that_was_warm_starts_its_warm_up():
    """Off for an hour in the middle: a decay since then, as much of it as the unit cooled by."""
    made = _cycle()
    on = (made.time < 5000.0) | (made.time >= 8600.0)
    run = Run.from_columns("a", **made.columns, power=np.where(on, 3.0, 0.0))
    rows = rows_of(run, load_twin("nominal"), 600)
    grids = Priors().grids
    (block,) = warm_up(rows, SimpleNamespace(grids=grids))
    since = rows.end_s - 0.5 * rows.row_s - 8600.0
    later = since > rows.row_s
    for tau, column in zip(grids.warm_ups_s, block.columns.T, strict=True):
        wanted = (1.0 - np.exp(-3600.0 / tau)) * np.exp(-since[later] / tau)
        assert column[later] == pytest.approx(wanted, rel=0.02)
        assert not column[since < -3700.0].any()


def test_spikes_and_a_limit_of_the_output_are_masked():
    clean = _cycle()
    gyro = clean.gyro.copy()
    gyro[[500, 1200, 1900]] += [30.0, -40.0, 25.0]
    gyro[2400:2420] = 0.5  # no other sample but a spike is as great
    spoilt = Run.from_columns("spoilt", time=clean.time, gyro=gyro, T=clean.columns["T"])
    rows, whole = (rows_of(run, load_twin("nominal"), 600) for run in (spoilt, clean))
    assert rows.masked == {"outliers": 3, "saturated": 20}
    assert np.abs(rows.gap).max() < 1.5 * np.abs(whole.gap).max()
    assert not whole.masked


@pytest.mark.parametrize(("values", "masked"), [(50, {}), (51, {"saturated": 20})])
def test_an_output_of_few_values_has_no_limit(values, masked):
    """Of 50 values or fewer each comes again and again, the greatest too."""
    time = 5.0 * np.arange(2000)
    gyro = 0.01 * np.random.default_rng(3).permutation(np.arange(2000) % (values - 1))
    gyro[700:720] = 0.01 * (values - 1)
    run = Run.from_columns("counts", time=time, gyro=gyro, T=25.0 + 0.001 * time)
    assert rows_of(run, load_twin("nominal"), 600).masked == masked


def test_a_quiet_output_that_rests_at_its_least_and_greatest_values_has_no_limit():
    """In 81 steps of ten times its noise: it rests at each of them, and longest where it is hot and cold."""
    time = np.arange(0.0, 36000.0, 5.0)
    T = np.interp(time, [0, 3600, 9000, 18000, 26000, 36000], [25, 25, 60, 60, -20, -20])
    gyro = 0.1 * (T - 25.0) + 0.01 * np.random.default_rng(1).standard_normal(len(time))
    run = Run.from_columns("steps", time=time, gyro=0.1 * np.round(gyro / 0.1), T=T)
    rows = rows_of(run, load_twin("nominal"), 1200)
    assert not rows.masked and rows.temperature.max() > 59.0


def test_a_table_that_goes_round_is_between_two_samples_where_it_was():
    """Its recorded angle begins anew after 360 deg, often in the middle of a row."""
    time = 10.0 * np.arange(1200)
    turned = 0.5 * time + 3.0
    columns = {"rate": np.full(len(time), 0.5), "angle": turned % 360.0, "T": 25.0 + 0.001 * time}
    rows = rows_of(
        Run.from_columns("turns", time=time, gyro=1800.0 + 0.0 * time, **columns), load_twin("nominal"), 600
    )
    expected = np.exp(1j * np.radians(np.interp(rows.even.time, time, turned)))
    np.testing.assert_allclose(np.exp(1j * np.radians(rows.even.angle_deg)), expected, atol=1e-9)


def test_no_cause_follows_the_noise_of_a_recorded_rate_of_a_table_that_rests():
    run, twin = _cycle(), load_twin("nominal")
    rate = 1e-4 * np.random.default_rng(5).standard_normal(len(run))
    rows = rows_of(run.with_columns(rate=rate, gyro=run.gyro - 3600.0 * rate), twin, 600)
    assert not rows.turns
    scene = Scene((rows,), 1, "tactical", candidates=candidates_of(TwinModel(twin)))
    dead_zone = effect("deadband")
    assert not np.any(rows.response(dead_zone, dead_zone.default_shape("tactical")))
    (bent,) = (f for f in families_of(twin, scene) if f.id == "sf_nonlinearity")
    assert not any(np.any(block.columns) for block in bent.build(rows, scene))
    # Of a table that turns it does.
    turned = rows_of(run.with_columns(rate=np.where(run.time > 5000.0, 1.0, 0.0)), twin, 600)
    assert turned.turns and np.any(turned.response(dead_zone, dead_zone.default_shape("tactical")))


def test_a_constant_far_off_is_said_and_fitted_all_the_same():
    scene = _scene(_cycle(offset=-40.0))
    twin = load_twin("nominal")
    setting = setting_of(TwinModel(twin), twin, scene, Priors(), NOISE)
    assert setting.values["b0"] == pytest.approx(-40.0, abs=0.1)
    assert setting.widened["b0"] == pytest.approx(2.0 * 40.0 / 5.0, rel=0.05)
    found = SimpleNamespace(setting=setting, points=SimpleNamespace(source="-"))
    far = ConstantFit("b0", "deg/h", 0.0, 5.0, -40.0, 0.01)
    (said,) = [line for line in assumed(found, [far]) if "standard deviations off" in line]
    assert said.startswith("b0 = \N{MINUS SIGN}40") and "is 8 standard deviations off" in said
    # What was far off until a cause was found is not.
    assert "standard deviations off" not in " ".join(assumed(found, [replace(far, value=1.0)]))


def test_a_constant_far_off_that_hardly_shows_is_told_by_the_prior_that_its_column_has():
    """What it is fitted to be changes with its prior, from one fit to the next."""
    run = _cycle()
    across = 0.05 * np.sin(run.time / 800.0)
    columns = {"T_in": run.columns["T"], "T_out": run.columns["T"] + across}
    faces = Run.from_columns("faces", time=run.time, gyro=run.gyro - 20.0 * across, **columns)
    scene, twin = _scene(faces), load_twin("nominal")
    noise = NoiseModel(0.1, 0.05, 0.0)
    setting = setting_of(TwinModel(twin), twin, scene, Priors(), noise)
    assert setting.values["g"] == pytest.approx(20.0, rel=0.02) and setting.widened["g"] > 1.0
    own = setting.fixed[0][:, : len(setting.constants)]
    np.testing.assert_allclose(own, scene.runs[0].constants * setting.deviations)


def test_what_each_run_draws_anew_has_columns_of_its_own():
    scene = _scene(_cycle("a"), _cycle("b", seed=2))
    family = Family("turn_on_bias", "known", power_cycles, drawn_per_run=True)
    one, other = Columns.of([family], scene).by_run
    assert one.shape[1] == other.shape[1] == 2
    np.testing.assert_array_equal(one, np.column_stack([np.ones(len(one)), np.zeros(len(one))]))
    np.testing.assert_array_equal(other, np.column_stack([np.zeros(len(other)), np.ones(len(other))]))


def test_steps_of_a_chambers_set_point_are_no_coarse_sensors():
    twin, time = load_twin("nominal"), np.arange(0.0, 36000.0, 60.0)
    x = 25.0 + 20.0 * np.sin(time / 5000.0)

    def coarse(inner):
        columns = {
            "T_in": inner,
            "T_out": x + 0.1 * np.cos(time / 900.0),
            "T_chamber": np.rint(2.0 * x) / 2.0,
        }
        run = Run.from_columns("a", time=time, gyro=np.zeros(len(time)), **columns)
        return steps_are_coarse(Scene((rows_of(run, twin, 600),), 1, "tactical"), twin)

    assert not coarse(x)
    assert coarse(np.rint(10.0 * x) / 10.0)


def test_places_in_the_winding_are_its_middle_and_its_faces_and_none_outside():
    run = _cycle()
    T_in, T_out = run.columns["T"] + 3.0, run.columns["T"] - 1.0
    columns = {"time": run.time, "gyro": run.gyro, "T_in": T_in, "T_out": T_out}
    scene = _scene(Run.from_columns("faces", **columns))
    (rows,) = scene.runs
    inner, outer = rows.even.temperature("T_in"), rows.even.temperature("T_out")
    places = [place.temperature for place in scene.coil(rows)]
    assert [np.flatnonzero([np.allclose(p, q) for p in places]).tolist() for q in (inner, outer)] == [
        [1],
        [2],
    ]
    np.testing.assert_allclose(places[0], 0.5 * (inner + outer))
    assert len(places) == 3


@pytest.mark.parametrize("poor_first", [False, True])
def test_what_one_run_alone_records_keeps_its_place_beside_runs_that_do_not(poor_first):
    """Each family has the same blocks on all runs; the rich run has those it has without the poor one."""
    poor = _cycle("poor", seed=2)
    hours = poor.time / 3600.0
    more = {
        "T_out": poor.columns["T"] + np.sin(7.0 * hours),
        "T_chamber": poor.columns["T"] + 3.0 * np.sin(9.0 * hours),
        "humidity": 50.0 + 20.0 * np.sin(5.0 * hours),
        "heater": 0.5 + 0.5 * np.sin(30.0 * hours),
    }
    rich = Run.from_columns("rich", time=poor.time, gyro=_cycle().gyro, T_in=poor.columns["T"], **more)
    alone, beside = (_scene(*runs) for runs in ((rich,), (poor, rich) if poor_first else (rich, poor)))
    for build in (moisture, machines, hidden_node, other_plant):
        family = Family("any", "known", build)
        held, both = (
            Columns.of([family], replace(scene, constants={"k1": 0.01})) for scene in (alone, beside)
        )
        own = both.by_run[1 if poor_first else 0]
        # Beside a run that records no machine a line may be one, which comes first.
        np.testing.assert_allclose(own[:, own.shape[1] - held.by_run[0].shape[1] :], held.by_run[0])


def test_cross_talk_weighs_the_more_the_less_light_the_twin_has():
    """0.05 dB for each degree off 25 degC."""
    twin = load_twin("nominal").with_effect("light_power", 0.1, power_loss=0.05, power_slope=0.0)
    rows = rows_of(_cycle(), twin, 600)
    off = rows.of(rows.even.temperature("T_electronics")) - 25.0
    told = rows.response(effect("electronic_crosstalk"), {"supply_ratio": 0.0})
    np.testing.assert_allclose(told, off * 10.0 ** (0.005 * np.abs(off)), rtol=1e-12)
