"""Planned runs: Fisher information, expected standard errors, and what a plan promises."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.fisher import covariance, information, merit, unknowns
from fogml.gap.fitting import fit_model
from fogml.gap.model import EffectValue
from fogml.gap.observation import observe
from fogml.gap.plan import plan_runs
from fogml.gap.plan_json import plan_values
from fogml.gap.programme_design import Design
from fogml.gap.programme_family import Family
from fogml.gap.rehearsal import Rehearsal, Together, stage
from fogml.gap.run_whitener import LONGEST_RUNS, RunWhitener
from fogml.gap.twin_model import TwinModel
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.set_up import Sensors
from fogml.twin.twin_file import load_twin

TWIN = replace(load_twin("nominal"), sensors=Sensors())
NOISE = NoiseModel(TWIN.noise.N, TWIN.noise.B, TWIN.noise.K)
FACTS = Facts(latitude=39.9, input_axis="up")
VALUES = dict.fromkeys(("e0", "k1", "k2", "b0", "b1", "b2", "g", "m"), 0.0)
SHORT = Design(rates=(2.0, None, None), soak_s=1800.0, ladder="one rate")


@pytest.fixture(scope="module")
def rehearsed():
    on = stage(TWIN, NOISE, VALUES, facts=FACTS)
    return on, Rehearsal(on, Family(), SHORT)


def test_information_is_that_of_the_replay_and_the_dense_covariance(rehearsed):
    on, rehearsal = rehearsed
    of = unknowns(on, ["thermal_hysteresis", "shupe_pure", "k1"])
    o = rehearsal.observation

    def output(x):
        values = dict(zip((p.name for p in of.parameters), x))
        effects = tuple(
            EffectValue(
                e.id, values[f"{e.id}.amplitude"], {name: values[f"{e.id}.{name}"] for name in e.shape}
            )
            for e in of.effects
        )
        return o.averaged(o.model.output({name: values[name] for name in VALUES}, effects))

    at = np.array([p.value for p in of.parameters])
    slopes = []
    for i, p in enumerate(of.parameters):
        step = np.zeros(len(at))
        step[i] = 1e-3 * p.scale
        slopes.append((output(at + step) - output(at - step)) / 2e-3)
    dense = NOISE.covariance(
        o.time, o.row_s, NOISE.ladder(o.row_s, LONGEST_RUNS * (o.time[-1] - o.time[0] + o.row_s))
    )
    slopes = np.array(slopes)
    expected = slopes @ np.linalg.solve(dense, slopes.T) + of.prior_information()
    size = np.sqrt(np.diag(expected))
    found = information(rehearsal, of)
    np.testing.assert_allclose(found / np.outer(size, size), expected / np.outer(size, size), atol=0.02)
    names = [of.parameters[i].name for i in of.wanted]
    assert names == [
        "k1",
        "thermal_hysteresis.amplitude",
        "thermal_hysteresis.half_width",
        "shupe_pure.amplitude",
    ]


def test_merits_are_those_of_the_covariance(rehearsed):
    on, rehearsal = rehearsed
    of = unknowns(on, ["k1", "b1"])
    info = information(rehearsal, of)
    block = np.linalg.inv(info)[np.ix_(of.wanted, of.wanted)]
    assert merit(info, of.wanted, "D") == pytest.approx(-0.25 * np.log(np.linalg.det(block)), rel=1e-6)
    assert merit(info, of.wanted, "A") == pytest.approx(-0.5 * np.log(np.trace(block) / 2), rel=1e-6)
    # Two runs alike tell twice as much, the priors apart.
    twice = information(Together([rehearsal, rehearsal]), of) - of.prior_information()
    np.testing.assert_allclose(twice, 2.0 * (info - of.prior_information()), rtol=1e-9)


def test_expected_standard_errors_are_the_scatter_of_fits():
    rng = np.random.default_rng(11)
    family, fits = Family(), []
    sample_s, count = 60.0, 40
    twin = replace(TWIN, noise=replace(TWIN.noise, N=0.02))
    on = stage(twin, NoiseModel(0.02, TWIN.noise.B, TWIN.noise.K), VALUES, facts=FACTS)
    of = unknowns(on, ["temperature_rate_product", "b1", "g"])
    expected = np.sqrt(np.diag(covariance(information(Rehearsal(on, family, SHORT, sample_s), of))))
    (effect,) = of.effects
    programme = family.programme(SHORT)
    ready = replace(on.model.twin, noise=twin.noise)
    for seed in range(count):
        # Constants from their priors, as the expected errors take them.
        drawn = {c.name: float(rng.normal(c.mean, c.sd)) for c in on.model.constants}
        true = ready.with_nominal(**drawn).with_effect(effect.id, effect.amplitude)
        run = true.simulate(programme, sample_s=sample_s, seed=seed, facts=FACTS).run
        o = observe(run, TwinModel(ready))
        whitener = RunWhitener(on.noise, o, VALUES)
        fit = fit_model([o], [whitener], on.model.constants, [effect], on.model.candidates())
        found = {**fit.constants, f"{effect.id}.amplitude": fit.effects[0].amplitude}
        told = {**drawn, f"{effect.id}.amplitude": effect.amplitude}
        fits.append([found[p.name] - told[p.name] for p in of.parameters])
    scatter = np.sqrt(np.mean(np.square(fits), axis=0)) / [p.scale for p in of.parameters]
    ratio = (scatter / expected)[list(of.wanted)]
    # The scatter of 40 fits is known to 11 %.
    assert ((ratio > 0.65) & (ratio < 1.4)).all(), ratio


def test_a_plan_promises_what_it_finds_and_repeats():
    ask = {"hours": 10.0, "most": 20, "seed": 2, "separate": [["thermal_hysteresis", "stress_relaxation"]]}
    plan = plan_runs(load_twin("nominal"), ["thermal_hysteresis.half_width", "k1"], runs=2, **ask)
    assert [e.name for e in plan.outlook.errors] == ["k1", "thermal_hysteresis.half_width"]
    assert all(run.programme.total_hours <= 10.0 for run in plan.runs)
    # A second run never takes away what the first one told.
    first, second = (run.outlook for run in plan.runs)
    assert all(b.se <= a.se for a, b in zip(first.errors, second.errors))
    assert second.separations[0].distance >= first.separations[0].distance
    assert all(e.se < e.prior for e in plan.outlook.errors)
    again = plan_runs(load_twin("nominal"), ["thermal_hysteresis.half_width", "k1"], runs=2, **ask)
    assert plan_values(again) == plan_values(plan)


def test_scale_factor_is_planned_with_turns():
    plan = plan_runs(TWIN, ["k1"], hours=6.0, most=80, criterion="A", facts=FACTS)
    assert any(plan.runs[0].programme.schedule.table_rate.values)
    error = plan.outlook.errors[0]
    assert error.se < 0.01 * error.prior


def test_what_is_within_the_constants_is_said_not_to_show():
    plan = plan_runs(TWIN, ["coil_expansion"], hours=5.0, most=20, facts=FACTS)
    (error,) = plan.outlook.errors
    # It is k1 under another name: all that is known of it is k1's prior.
    assert error.se == pytest.approx(50.0, rel=0.01) and not error.shown


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        ({"want": []}, "nothing is asked for"),
        ({"want": ["thermal_histeresis"]}, "did you mean 'thermal_hysteresis'"),
        ({"want": ["k9"]}, "constants are b0, b1, b2, e0"),
        ({"want": ["thermal_hysteresis.width"]}, "it has amplitude, half_width"),
        ({"want": ["angle_random_walk"]}, "is a random error"),
        ({"want": ["k1"], "hours": 1.0}, "the shortest programme"),
        ({"want": ["k1"], "criterion": "E"}, "D or A was expected"),
        ({"want": ["k1"], "runs": 0}, "1 to 8 can be planned"),
        ({"want": [], "separate": [["shupe_pure", "shupe_pure"]]}, "named twice"),
    ],
)
def test_what_cannot_be_planned_is_refused(ask, message):
    with pytest.raises(InputError, match=message):
        plan_runs(TWIN, **ask)
