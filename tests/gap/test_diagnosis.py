"""The whole diagnosis on synthetic units: what is named, what is not, what repeats, what is refused."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from fogml.cli.main import app
from fogml.errors import InputError
from fogml.gap import diagnose
from fogml.gap.frame import Frame
from fogml.gap.model import EffectValue
from fogml.gap.observation import observe
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.twin_model import TwinModel
from fogml.runs.facts import Facts
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from fogml.runs.writing import write_run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.nominal import PRIOR_SD
from fogml.twin.programme import load_programme
from fogml.twin.registry import effect
from fogml.twin.twin_file import load_twin
from tests.gap.small_model import SmallModel, noise_of, ramps, recorded

TWIN = load_twin("nominal")
NOISE = NoiseModel(TWIN.noise.N, TWIN.noise.B, TWIN.noise.K)
D_PRIME = 25.0
TURNS = "turn at 10 deg/s for 60 s, then -10 deg/s for 60 s, then 1 deg/s for 60 s, from minute 30"


def programme(levels, rate):
    steps: list = [{f"soak at {levels[0]} degC for 50 min": [TURNS]}]
    for level in levels[1:]:
        steps += [f"ramp to {level} degC at {rate} degC/min", {f"soak at {level} degC for 50 min": [TURNS]}]
    return load_programme(steps)


PROGRAMMES = {
    "a": programme((25, 60, -20, 25), 1),
    "b": programme((25, -10, 50, 10), 0.5),
    "c": programme((25, 45, -15, 30), 0.8),
}


def unit(seed):
    """The twin with constants from their priors."""
    rng = np.random.default_rng(seed)
    return TWIN.with_nominal(**{name: float(sd * rng.normal()) for name, sd in asdict(PRIOR_SD).items()})


def simulated(twin, seed):
    runs = []
    for number, (name, steps) in enumerate(PROGRAMMES.items()):
        run = twin.simulate(steps, sample_s=10.0, seed=10 * seed + number).run
        runs.append(replace(run, name=f"{name}.csv"))
    return runs


@cache
def static():
    soak = load_programme(["soak at 25 degC for 6 h"])
    return replace(TWIN.simulate(soak, sample_s=10.0, seed=99).run, name="static.csv")


@cache
def plain(seed):
    return simulated(unit(seed), seed)


def amplitude_at(id, runs, d_prime=D_PRIME):
    """The amplitude whose response, beside the constants, has a whitened length of `d_prime`."""
    model = TwinModel(TWIN)
    observations = [observe(run, model) for run in runs]
    values = {c.name: c.mean for c in model.constants}
    whiteners = [RunWhitener(NOISE, o, values) for o in observations]
    frame = Frame(observations, whiteners, model.constants, values)
    column = frame.responses(id, [effect(id).default_shape()])
    return d_prime / float(np.sqrt(frame.beside(column)[0, 0]))


@cache
def with_effect(id, seed):
    """Two runs to fit and one to hold out, of a unit with an effect at d' = 25."""
    amplitude = amplitude_at(id, plain(seed)[:2])
    return simulated(unit(seed).with_effect(id, amplitude), seed), amplitude


@pytest.mark.parametrize("seed", [1, 2])
def test_with_nothing_added_there_is_no_gap(seed):
    a, b, c = plain(seed)
    found = diagnose(TWIN, [a, b], [c], noise=static() if seed % 2 else None, plan=False)
    assert found.verdict == "no_gap" and not found.named
    (far,) = found.how_far
    assert far.after == far.recalibrated < 2.0 * far.floor < far.before


MAIN = ["thermal_hysteresis", "bias_polynomial", "sf_nonlinearity"]


@pytest.mark.parametrize("id", MAIN)
def test_a_single_effect_is_named_alone_or_in_its_class(id):
    (a, b, c), amplitude = with_effect(id, 7)
    found = diagnose(TWIN, [a, b], [c], noise=static(), plan=False)
    assert found.verdict in ("explained", "ambiguous")
    (one,) = found.named
    assert id in one.members and one.probability > 0.5
    if one.effect == id:
        assert abs(one.amplitude.value - amplitude) < 3.0 * one.amplitude.se
        # One that the runs leave open, with its shape, may have either sign.
        assert one.amplitude.value * amplitude > 0.0 or abs(one.amplitude.value) < one.amplitude.se
    (far,) = found.how_far
    assert far.after < far.recalibrated


def test_a_line_has_its_amplitude_though_its_phase_is_another_one_on_each_run():
    frequency, amplitude = 0.0063, 0.03
    runs = []
    for run, phase in zip(plain(3), (0.3, 2.1, 4.4)):
        line = amplitude * np.sin(2.0 * np.pi * frequency * run.time + phase)
        runs.append(replace(run, columns={**run.columns, "gyro": run.columns["gyro"] + line}))
    found = diagnose(TWIN, runs[:2], runs[2:], noise=static(), plan=False)
    (one,) = found.named
    assert one.effect == "sinusoidal"
    assert abs(one.amplitude.value - amplitude) < 2.0 * one.amplitude.se < 0.5 * amplitude
    assert one.parameters["frequency"].value == pytest.approx(frequency, rel=0.01)
    # The twin that is written has the same.
    assert [e.amplitude for e in found.effects] == [one.amplitude.value]


def test_one_that_each_run_draws_anew_keeps_the_sign_of_its_amplitude():
    model, rng = SmallModel(("bend", "cube_drawn")), np.random.default_rng(3)
    acting, runs = (EffectValue("cube_drawn", -2.0, {}),), []
    for name, turns in (("a", 2), ("b", 3), ("c", 4)):
        run = ramps(name, count=400, turns=turns)
        runs.append(recorded(run, model, {"offset": 1.0}, acting, noise_of(run, rng)))
    found = diagnose(model, runs[:2], runs[2:], plan=False)
    (one,) = found.named
    assert abs(one.amplitude.value + 2.0) < 2.0 * one.amplitude.se < 1.0
    assert [e.amplitude for e in found.effects] == [one.amplitude.value]
    (far,) = found.how_far
    assert far.after < 2.0 * far.floor < far.recalibrated


@pytest.mark.parametrize("id", ["thermal_hysteresis"])
def test_an_effect_that_is_no_candidate_gets_no_certain_wrong_name(id):
    (a, b, c), _ = with_effect(id, 7)
    found = diagnose(TWIN, [a, b], [c], noise=static(), without=[id], plan=False)
    assert id not in {m for f in found.found for m in f.members}
    # A relative may stand in for it; then a class of several or the unknown shows the doubt.
    for one in found.named:
        assert len(one.members) > 1 or found.unknown.probability > 0.05, one
    assert found.verdict != "no_gap"


def test_the_same_seed_gives_the_same_from_python_and_from_the_command_line(tmp_path):
    (a, b, c), _ = with_effect("thermal_hysteresis", 7)
    paths = []
    for run in (a, b, c):
        paths.append(tmp_path / run.name)
        write_run(run[::3], paths[-1])
    runs = [read_run(path) for path in paths]
    first = diagnose(TWIN, runs[:2], runs[2:], seed=4).as_dict()
    line = ["diagnose", str(paths[0]), str(paths[1]), "--held-out", str(paths[2])]
    out = tmp_path / "out"
    result = CliRunner().invoke(app, [*line, "--seed", "4", "--out", str(out)], catch_exceptions=False)
    assert result.exit_code == 0
    assert json.loads((out / "gap.json").read_text()) == json.loads(json.dumps(first))


def test_a_run_that_can_not_be_used_says_why_and_others_go_on():
    a, b, c = plain(1)
    found = diagnose(TWIN, [a, b, replace(b[:30], name="short.csv")], [c], noise=static(), plan=False)
    ((name, reason),) = found.unusable
    assert name == "short.csv" and "at least 600 s" in reason
    assert found.fit == ("a.csv", "b.csv") and found.verdict == "no_gap"
    assert found.as_dict()["runs"]["unusable"] == [{"run": name, "reason": reason}]


def test_with_no_held_out_run_the_last_stretch_is_kept_back():
    a, b, _ = plain(2)
    found = diagnose(TWIN, [a, b], noise=static(), plan=False)
    assert found.held_out_is_part and found.held_out == ("b.csv",)
    (far,) = found.how_far
    assert far.run == "b.csv" and far.recalibrated > 0.0


def still():
    time = np.arange(0.0, 7200.0, 10.0)
    return Run.from_columns("still", time=time, gyro=np.zeros(len(time)), T=np.full(len(time), 25.0))


def of_unit(run, name):
    return replace(run, facts=Facts(**{**run.facts.model_dump(exclude_none=True), "unit": name}))


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda a, b, c: ([a, b], [b], {}), "b.csv: given as a held-out run and as a fit run"),
        (lambda a, b, c: ([a, a], [c], {}), "the same samples as a.csv; give each run once"),
        (lambda a, b, c: ([a, of_unit(b, "other")], [c], {}), "runs are of different units"),
        (lambda a, b, c: ([still()], [c], {}), "temperature moves by 0 degC in all"),
        (lambda a, b, c: ([a[:30]], [c], {}), "needs at least 600 s"),
        (lambda a, b, c: ([], [c], {}), "no run to diagnose"),
        (lambda a, b, c: ([a], [c], {"without": ["no_such"]}), "--without no_such: there is no such effect"),
        (lambda a, b, c: ([a], [c], {"noise": b}), "the table turns in it"),
        (
            lambda a, b, c: ([a.with_columns(flow=np.full(len(a), np.nan))], [c], {}),
            "column 'flow' holds no number",
        ),
    ],
)
def test_bad_input_is_refused_in_one_sentence(ask, message):
    fit, held_out, more = ask(*plain(1))
    with pytest.raises(InputError, match=message) as refused:
        diagnose(TWIN, fit, held_out, **more)
    assert "\n" not in str(refused.value)
