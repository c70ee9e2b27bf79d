"""Whole answers: nothing where nothing is missing, a twin's wrong size, dropped rows."""

import pickle
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.diagnosis import diagnose
from fogml.gap.inference import infer
from fogml.gap.model import TwinModel
from fogml.gap.reading import rows_of
from fogml.gap.settings import Priors
from fogml.runs.run import Run
from fogml.twin.programme import programme_from
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin


def _run(twin, seed, sample_s=60.0, hot=50):
    steps = [
        "soak at 25 degC for 1 h",
        f"ramp to {hot} degC at 1 degC/min",
        f"soak at {hot} degC for 1.5 h",
        "ramp to -10 degC at 1 degC/min",
        "soak at -10 degC for 1.5 h",
        "ramp to 25 degC at 0.5 degC/min",
        "soak at 25 degC for 1 h",
    ]
    return _simulated(twin, steps, seed, sample_s)


def _simulated(twin, steps, seed, sample_s=60.0):
    values = {"schema": "fogml.programme/1", "name": f"p{seed}", "steps": steps}
    programme = programme_from(values | {"start_temperature": "25 degC", "power": "on"}, "test")
    return simulate(programme, twin, sample_s=sample_s, seed=seed).run


@pytest.fixture(scope="module")
def tactical():
    return load_twin("tactical")


@pytest.fixture(scope="module")
def runs(tactical):
    return [_run(tactical, 1), _run(tactical, 2, hot=40), _run(tactical, 3, hot=45)]


def test_the_same_twin_with_its_own_sensors_leaves_no_gap(tactical, runs):
    quieter = replace(tactical, noise=replace(tactical.noise, N=0.5 * tactical.noise.N))
    static = _simulated(quieter, ["soak at 25 degC for 6 h"], 9)
    # White noise that differs from the static run's is no evidence of anything.
    found = diagnose(TwinModel(tactical), runs[:2], runs[2:], noise=static, plan=False)
    assert found.verdict == "no_gap"
    assert found.noise.coefficients["N"] == pytest.approx(tactical.noise.N, rel=0.1)
    assert not found.named
    errors = [abs(c.value - getattr(tactical.nominal, c.name)) / c.se for c in found.constants]
    assert max(errors) < 3.0


def test_slow_noise_beyond_what_the_twin_states_is_no_unknown(tactical):
    """Flicker and random walk of a tactical gyro are 10 times what the shipped nominal twin expects."""
    nominal = load_twin("nominal")
    loud = replace(nominal, noise=tactical.noise)
    made = [_run(loud, 21), _run(loud, 22, hot=40), _run(loud, 23, hot=45)]
    found = diagnose(TwinModel(nominal), made[:2], made[2:], plan=False)
    assert found.verdict == "no_gap"
    noise = found.noise.coefficients
    assert max(noise["B"] / nominal.noise.B, noise["K"] / nominal.noise.K) > 5.0
    assert any("what the model states" in line and "--noise" in line for line in found.headline)


def test_what_goes_in_time_alone_may_be_slow_noise_where_no_static_run_says(tactical, runs):
    tenth = np.floor(np.linspace(0.0, 11.0, len(runs[0])))
    moved = runs[0].with_columns(gyro=runs[0].gyro_deg_h + 4.0 * np.isin(tenth, (2, 5, 6, 9)))
    found = diagnose(TwinModel(tactical), [moved, runs[1]], runs[2:], plan=False)
    assert found.unknown.probability > 0.9
    assert found.unknown.looks_like.startswith(("goes in steps in time", "wanders with time"))
    assert any("give a static run (--noise)" in line for line in found.headline)


def test_turn_on_bias_closes_beside_a_constant_of_the_held_out_run(tactical):
    twin = replace(tactical.without_effect("turn_on_bias"), noise=replace(tactical.noise, B=0.0, K=0.0))
    made = [_run(twin, seed, sample_s=120.0) for seed in range(5)]
    runs = [r.with_columns(gyro=r.gyro_deg_h + b) for r, b in zip(made, (0.5, -0.4, 0.9, 0.1, -0.8))]
    found = diagnose(TwinModel(twin), runs[:4], runs[4:], plan=False)
    assert [f.effect for f in found.named] == ["turn_on_bias"]
    far, series = found.how_far[0], found.series[-1]
    # No run tells the constant of another one: the rest is at the noise about its own mean.
    assert far.after == pytest.approx(np.std(series.gap_recalibrated), rel=0.05)
    assert np.mean(series.gap_after) == pytest.approx(0.0, abs=0.01) and far.closed > 0.95
    assert "constant of the run's own" in found.headline[-1]
    assert pickle.loads(pickle.dumps(found)).as_dict() == found.as_dict()


def test_a_run_of_another_turn_on_bias_is_within_what_the_twin_draws(tactical):
    bare = tactical.without_effect("turn_on_bias")
    made = [_run(bare, seed) for seed in (1, 2, 3)]
    # Half a deg/h more than in the runs before: one deviation of such a unit, and far beyond noise.
    held = made[2].with_columns(gyro=made[2].gyro_deg_h + 0.5)
    drawn = diagnose(TwinModel(bare.with_effect("turn_on_bias", 0.5)), made[:2], [held], plan=False)
    steady = diagnose(TwinModel(bare), made[:2], [held], plan=False)
    assert drawn.verdict == steady.verdict == "no_gap"
    assert drawn.how_far[0].closed is None and "drawn anew on each run" in drawn.how_far[0].note
    assert steady.how_far[0].closed is not None and "leaves" in steady.headline[0]


def test_a_table_that_turns_all_the_time_makes_no_noise(tactical):
    # Scale factor off by 950 ppm: at turning rates that change from row to row, hundreds of times the noise.
    runs = [_run(tactical, seed) for seed in (1, 2)]
    turned = []
    for run in runs:
        rate = 3.0 * np.sin(run.time / 300.0 + 0.5 * np.sin(run.time / 77.0))
        gyro = run.gyro_deg_h + (1.0 + 950e-6) * 3600.0 * rate
        turned.append(run.with_columns(rate=rate, gyro=gyro))
    held = diagnose(TwinModel(tactical), turned[:1], turned[1:], plan=False).how_far[0]
    still = diagnose(TwinModel(tactical), runs[:1], runs[1:], plan=False).how_far[0]
    assert held.floor == pytest.approx(still.floor, rel=0.15)
    assert "white noise" not in held.note


def test_a_size_that_the_twin_has_wrong_gets_its_own_name(tactical, runs, tmp_path):
    wrong = tactical.with_effect("thermal_hysteresis", 0.9, half_width=8.0)
    found = diagnose(TwinModel(wrong), runs[:2], runs[2:], plan=False, rehearsed=True)
    assert [f.effect for f in found.named] == ["thermal_hysteresis"]
    (cause,) = found.named
    assert cause.amplitude.value == pytest.approx(0.12 - 0.9, abs=4.0 * cause.amplitude.se)
    assert found.how_far[0].closed is not None and found.how_far[0].closed > 0.8
    # The twin that is written holds all of the effect, not the correction alone.
    found.write_model(TwinModel(wrong), tmp_path / "twin.yaml")
    written = load_twin(tmp_path / "twin.yaml").settings["thermal_hysteresis"]
    assert written.amplitude == pytest.approx(0.12, abs=4.0 * cause.amplitude.se)
    assert cause.consistent and cause.onset is None and cause.grows is None
    _rehearsed(found.rehearsal)


def _rehearsed(rows):
    """What hardly shows is missed; of one form a larger size shows as much more, and is no less sure."""
    assert {r.outcome for r in rows if r.length < 2.0} == {"missed"}
    own = [r for r in rows if r.effect == "thermal_hysteresis" and r.form == "usual"]
    usual, large = sorted(own, key=lambda r: r.length)
    assert (usual.size, large.size) == ("usual", "found")
    assert large.outcome == "named" and "thermal_hysteresis" in large.named_as
    assert large.probability >= usual.probability
    assert all((r.outcome == "missed") == (not r.named_as) for r in rows)


def test_an_effect_that_no_one_knows_is_no_candidate(tactical, runs):
    with pytest.raises(InputError, match="there is no such effect"):
        diagnose(TwinModel(tactical), runs[:1], without=["phlogiston"])


def test_dropped_rows_change_nothing_that_is_systematic(tactical):
    run = _run(load_twin("nominal"), 4, sample_s=5.0)
    keep = np.random.default_rng(1).random(len(run)) > 0.08
    keep[[0, -1]] = True
    less = Run(name="less", columns={n: v[keep] for n, v in run.columns.items()}, facts=run.facts)
    whole, part = (rows_of(r, tactical, 600) for r in (run, less))
    assert len(part) == len(whole)
    held = np.isin(whole.end_s, part.end_s)
    assert held.all()
    scale = np.abs(whole.constants).max(axis=0)
    # What is left is the noise of the readings that were dropped.
    assert np.all(np.abs(part.constants - whole.constants) < 1e-2 * np.maximum(scale, 1e-12))


def test_an_effect_that_the_twin_has_too_much_of_explains_what_it_is_too_much():
    """A lag can't be negative, and what corrects one that is too long is."""
    twin = load_twin("nominal").with_nominal(b1=0.1, g=1.0, m=1.0, b2=1e-3)
    real, late = (twin.with_effect("sensor_lag", lag_s) for lag_s in (20.0, 100.0))
    runs = [_run(real, 1, 20.0), _run(real, 2, 20.0, hot=40)]
    found = infer(TwinModel(late), runs, (), None, (), Priors())
    gains = {found.columns.families[f].id: gain for f, gain in found.search.alone().items()}
    assert gains["sensor_lag"] > 30.0
    assert gains["sensor_lag"] > max(gains.values()) - 3.0


def test_a_stretch_that_is_kept_back_is_foretold_with_what_came_before_it():
    """A node that lags by an hour is warm where the last stretch begins, in the cold."""
    twin = load_twin("nominal")
    steps = ["soak at 25 degC for 1 h"]
    for hot, cold in ((50, -10), (45, -5), (55, -15)):
        steps += [f"ramp to {hot} degC at 1 degC/min", f"soak at {hot} degC for 1 h"]
        steps += [f"ramp to {cold} degC at 1 degC/min", f"soak at {cold} degC for 1 h"]
    steps += ["ramp to 25 degC at 1 degC/min", "soak at 25 degC for 2 h"]
    run = _simulated(twin.with_effect("hidden_thermal_node", 0.1), steps, 5, 30.0)
    found = diagnose(TwinModel(twin), [run], plan=False)
    assert found.held_out_is_part and "hidden_thermal_node" in found.named[0].members
    (far,) = found.how_far
    assert far.closed == pytest.approx(1.0, abs=0.1)
    # Of the whole run the last quarter is drawn, and no more.
    (held,) = (s for s in found.series if s.role == "held_out")
    assert held.time_s[0] == pytest.approx(0.75 * run.time[-1], abs=200.0)
    (fitted,) = (s for s in found.series if s.role == "fit")
    assert fitted.time_s[-1] < held.time_s[0]


def test_a_noise_run_through_which_temperature_moves_is_told(tactical, runs):
    """Drift that no straight line in temperature holds counts as noise of it, which hides a gap."""
    static = _simulated(tactical, ["soak at 25 degC for 6 h"], 9)
    for noise, moves in ((static, False), (_run(tactical, 8), True)):
        found = diagnose(TwinModel(tactical), runs[:2], noise=noise, plan=False)
        assert any("no static run" in said for said in found.headline) == moves


def test_a_held_out_run_is_no_noise_run(tactical, runs):
    with pytest.raises(InputError, match="as a held-out run and as the noise run too"):
        diagnose(TwinModel(tactical), runs[:2], runs[2:3], noise=runs[2])


def test_runs_that_can_not_be_are_told(tactical, runs):
    """A held-out run cut from a fit run with an overlap; two runs of one unit at one time."""
    whole, other, third = (replace(run, name=name) for run, name in zip(runs, ("one", "two", "three")))
    tail = replace(whole[len(whole) // 2 :], name="tail")
    start = datetime(2026, 3, 2, 8, tzinfo=UTC)
    dated = [
        run.with_facts(run.facts.model_copy(update={"started": start + timedelta(hours=hours)}))
        for run, hours in ((whole, 0.0), (other, 3.0), (third, 48.0))
    ]

    def said(fit, held_out):
        told = diagnose(TwinModel(tactical), fit, held_out, plan=False).headline
        return [line for line in told if "holds samples" in line or "overlap" in line]

    assert said([whole, other], third) == []
    (cut,) = said([whole, other], tail)
    assert cut.startswith("tail holds samples of the fit run one (about 100 %)")
    (both,) = said(dated[:2], dated[2])
    assert both.startswith("one and two are of one unit and overlap by 4.6 h by their 'started'")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"cost_of_false_name": 0.0}, "cost_of_false_name is 0"),
        ({"cost_of_false_name": float("nan")}, "cost_of_false_name is nan"),
        ({"cost_of_false_name": "1"}, "cost_of_false_name is '1'"),
        ({"noise": "static.csv"}, "runs are needed, found str"),
        ({"without": "moistur"}, "did you mean 'moisture'"),
        ({"model": None}, "a twin, its name or file"),
    ],
)
def test_arguments_that_are_none_are_refused_by_what_they_are(runs, given, message):
    with pytest.raises(InputError, match=message):
        diagnose(**{"model": "tactical", "fit": runs[:1], "held_out": runs[2]} | given)
