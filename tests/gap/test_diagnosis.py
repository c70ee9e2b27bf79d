"""The whole diagnosis on synthetic units: what is named, what is not, what is refused."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap import diagnose
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.nominal import PRIOR_SD
from fogml.twin.programme import load_programme
from fogml.twin.replay import replay
from fogml.twin.twin_file import load_twin

TWIN = load_twin("nominal")
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


def test_with_nothing_added_there_is_no_gap_and_a_run_that_can_not_be_used_says_why():
    a, b, c = plain(1)
    found = diagnose(TWIN, [a, b, replace(b[:15], name="short.csv")], [c], noise=static(), plan=False)
    assert found.verdict == "no_gap" and not found.named
    (far,) = found.how_far
    assert far.after == far.recalibrated < 2.0 * far.floor < far.before
    ((name, reason),) = found.unusable
    assert name == "short.csv" and "a diagnosis needs more" in reason
    assert found.fit == ("a.csv", "b.csv")
    assert found.as_dict()["runs"]["unusable"] == [{"run": name, "reason": reason}]


ADDED = {
    "thermal_hysteresis": (0.2, {"half_width": 8.0}),
}


@cache
def with_effect(id):
    """Two runs to fit and one to hold out, of a unit with an effect."""
    amplitude, shape = ADDED[id]
    return simulated(unit(7).with_effect(id, amplitude, **shape), 7)


@pytest.mark.parametrize("id", ADDED)
def test_a_single_effect_is_named_with_its_size(id):
    a, b, c = with_effect(id)
    found = diagnose(TWIN, [a, b], [c], noise=static(), plan=False)
    assert found.verdict in ("explained", "ambiguous")
    (one,) = found.named
    assert one.effect == id and one.probability > 0.5
    assert abs(one.amplitude.value - ADDED[id][0]) < 3.0 * one.amplitude.se
    (far,) = found.how_far
    assert far.after < 0.7 * far.recalibrated and far.closed is not None and far.closed > 0.7


def test_a_line_has_its_amplitude_though_its_phase_is_another_one_on_each_run():
    frequency, amplitude = 0.0063, 0.03
    runs = []
    for run, phase in zip(plain(3), (0.3, 2.1, 4.4)):
        line = amplitude * np.sin(2.0 * np.pi * frequency * run.time + phase)
        runs.append(replace(run, columns={**run.columns, "gyro": run.columns["gyro"] + line}))
    found = diagnose(TWIN, runs[:2], runs[2:], noise=static(), plan=False)
    (one,) = found.named
    assert one.effect == "sinusoidal"
    assert one.amplitude.value == pytest.approx(amplitude, rel=0.2)
    # Two runs tell little of a spread over runs.
    assert one.amplitude.se < amplitude
    assert one.parameters["frequency"].value == pytest.approx(frequency, rel=0.01)
    # The twin that is written has the same.
    assert [e.amplitude for e in found.effects] == [one.amplitude.value]


def test_an_effect_that_is_no_candidate_gets_no_certain_wrong_name():
    a, b, _ = with_effect("thermal_hysteresis")
    found = diagnose(TWIN, [a, b], noise=static(), without=["thermal_hysteresis"], plan=False)
    assert "thermal_hysteresis" not in {m for f in found.found for m in f.members}
    # A relative may stand in for it; then a class of several or the unknown shows the doubt.
    for one in found.named:
        assert len(one.members) > 1 or found.unknown.probability > 0.05, one
    assert found.verdict != "no_gap"
    # With no held-out run the last stretch is kept back.
    assert found.held_out_is_part and found.held_out == ("b.csv",)
    (far,) = found.how_far
    assert far.run == "b.csv" and far.recalibrated > 0.0


def test_a_run_whose_last_stretch_is_too_short_to_be_judged_is_fitted_all_the_same():
    a, b, _ = plain(1)
    found = diagnose(TWIN, [a, b[:30]], plan=False)
    assert found.fit == ("a.csv", "b.csv") and not found.how_far
    ((name, reason),) = found.unusable
    assert name == "b.csv, kept-back part" and "rows lie long enough after its start" in reason


def test_records_without_noise_have_no_gap_to_the_twin_that_made_them():
    a, _, c = (r.with_columns(gyro=replay(TWIN, r)) for r in plain(1))
    found = diagnose(TWIN, [a], [c], plan=False)
    assert found.verdict == "no_gap" and found.how_far[0].after < 1e-3


def still():
    time = np.arange(0.0, 7200.0, 10.0)
    return Run.from_columns("still", time=time, gyro=np.sin(time), T=np.full(len(time), 25.0))


def of_a_gyro(run):
    """A run of no twin, whose gyro was not connected."""
    return replace(run.with_columns(gyro=np.zeros(len(run))), facts=Facts())


def of_unit(run, name):
    return replace(run, facts=Facts(**{**run.facts.model_dump(exclude_none=True), "unit": name}))


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda a, b, c: ([a, b], [b], {}), "b.csv: given as a held-out run and as a fit run"),
        (lambda a, b, c: ([a, a], [c], {}), "the same samples as a.csv; give each run once"),
        (lambda a, b, c: ([a, of_unit(b, "other")], [c], {}), "runs are of different units"),
        (lambda a, b, c: ([still()], [c], {}), "temperature moves by 0 degC in all"),
        (lambda a, b, c: ([of_a_gyro(a)], [c], {}), "'gyro' is 0 in every sample"),
        (lambda a, b, c: ([a[:15]], [c], {}), "a diagnosis needs more"),
        (lambda a, b, c: ([], [c], {}), "no run to diagnose"),
        (
            lambda a, b, c: ([a.with_columns(gyro=a.gyro + i) for i in range(200)], [c], {}),
            "200 runs to fit on: a diagnosis takes 93 at most",
        ),
        (lambda a, b, c: ([a], [c], {"without": ["no_such"]}), "--without no_such: there is no such effect"),
        (lambda a, b, c: ([a], [c], {"noise": b}), "the table turns in it"),
        (lambda a, b, c: ([a], [c], {"noise": a}), "a.csv: given as a fit run and as the noise run too"),
        (lambda a, b, c: ([a], [c], {"noise": of_a_gyro(b)}), "'gyro' is 0 in every sample"),
        (
            lambda a, b, c: ([of_unit(a, "1")], [c], {"noise": of_unit(still(), "2")}),
            "different units .* still is unit 2",
        ),
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
