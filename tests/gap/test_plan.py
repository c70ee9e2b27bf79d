"""Planned runs: Fisher information, expected standard errors, and what a plan promises."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.planning.fisher import covariance, expected, information, merit, responses, unknowns
from fogml.gap.planning.lab import Lab
from fogml.gap.planning.plan import plan_runs
from fogml.gap.planning.plan_result import plan_values
from fogml.gap.planning.programme_family import Design, Family
from fogml.gap.planning.rehearsal import FINE_S, Rehearsal, Together, stage
from fogml.gap.settings import STANDARD
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.noise import NoiseConstants
from fogml.twin.registry import effect
from fogml.twin.replay import Replayer
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.twin_file import load_twin

TWIN = replace(load_twin("nominal"), sensors=Sensors())
NOISE = NoiseModel(TWIN.noise.N, TWIN.noise.B, TWIN.noise.K)
FACTS = Facts(latitude=39.9, input_axis="up")
VALUES = dict.fromkeys(("e0", "k1", "k2", "b0", "b1", "b2", "g", "m"), 0.0)
SHORT = Design(rates=(2.0, None, None), soak_s=1800.0, ladder="one rate")


@pytest.fixture(scope="module")
def rehearsed():
    on = stage(TWIN, NOISE, VALUES, facts=FACTS)
    return on, Rehearsal(on, Family(), SHORT, FINE_S)


def test_rows_are_as_long_where_the_power_goes_off_for_a_while(rehearsed):
    on, rehearsal = rehearsed
    paused = Rehearsal(on, Family(), replace(SHORT, power_steps="each"), FINE_S).rows
    assert len(paused.run) < round(paused.run.span_s / FINE_S) + 1
    assert paused.row_s == rehearsal.rows.row_s == FINE_S


def test_information_is_that_of_the_replay_and_the_dense_covariance(rehearsed):
    on, rehearsal = rehearsed
    of = unknowns(on, ["thermal_hysteresis", "shupe_pure", "k1"])
    rows = rehearsal.rows
    replayer = Replayer(rows.run)

    def output(x):
        values = dict(zip((p.name for p in of.parameters), x))
        twin = on.model.twin.with_nominal(**{name: values[name] for name in VALUES})
        for e in of.effects:
            shape = {name: values[f"{e.id}.{name}"] for name in e.shape}
            twin = twin.with_effect(e.id, values[f"{e.id}.amplitude"], **shape)
        return replayer.output(twin)[rows.kept]

    at = np.array([p.value for p in of.parameters])
    slopes = []
    for i, p in enumerate(of.parameters):
        step = np.zeros(len(at))
        step[i] = 1e-3 * p.scale
        slopes.append((output(at + step) - output(at - step)) / 2e-3)
    span = rows.end_s[-1] - rows.end_s[0] + rows.row_s
    ladder = NOISE.ladder(rows.row_s, STANDARD.noise.longest_runs * span)
    dense = NOISE.covariance(rows.end_s, rows.row_s, ladder)
    slopes = np.array(slopes)
    exact = slopes @ np.linalg.solve(dense, slopes.T)
    size = np.sqrt(np.diag(exact))
    white = responses(rehearsal, of)
    found = white.T @ white
    # Windows of DeltaT are integrals there and sums of samples in a replay.
    np.testing.assert_allclose(found / np.outer(size, size), exact / np.outer(size, size), atol=0.015)
    names = [of.parameters[i].name for i in of.wanted]
    assert names == [
        "k1",
        "thermal_hysteresis.amplitude",
        "thermal_hysteresis.half_width",
        "shupe_pure.amplitude",
    ]
    # What is always a little off takes some of it, and never adds any.
    left = found + of.prior_information() - information(rehearsal, of)
    assert np.linalg.eigvalsh(left / np.outer(size, size)).min() > -1e-9


@pytest.mark.parametrize(
    ("id", "size", "shape", "moved"),
    [
        ("deadband", 0.5, {}, "amplitude"),
        ("warmup_bias", 2.0, {"fast_time_constant": 0.1}, "fast_time_constant"),
        ("warmup_bias", 2.0, {"slow_time_constant": 50.0}, "slow_time_constant"),
    ],
)
def test_responses_are_slopes_at_what_the_twin_states(id, size, shape, moved):
    """Of a dead zone about its own size; of a shape at or near the least that there is."""
    on = stage(TWIN.with_effect(id, size, **shape), NOISE, VALUES, facts=FACTS)
    rehearsal = Rehearsal(on, Family(), replace(SHORT, ladder="slow rates", cold_start=True), 30.0)
    of = unknowns(on, [f"{id}.{moved}"])
    (place,) = of.wanted
    step = 0.01 * of.parameters[place].scale
    replayer, made = Replayer(rehearsal.rows.run), []
    for end in (max(of.parameters[place].value - step, 0.1), of.parameters[place].value + step):
        values = {"amplitude": size, **shape, moved: end}
        twin = TWIN.with_effect(id, values.pop("amplitude"), **values)
        made.append((end, rehearsal._whiten(replayer.output(twin)[rehearsal.rows.kept][:, None])[:, 0]))
    (low, below), (high, above) = made
    slope = of.parameters[place].scale * (above - below) / (high - low)
    found = responses(rehearsal, of)[:, place]
    assert found == pytest.approx(slope, abs=1e-6 * max(np.abs(slope).max(), 1.0))
    assert np.isfinite(expected(rehearsal, of)).all()


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


def test_expected_errors_are_those_of_fits_whose_prior_is_the_plan(rehearsed):
    """Widths drawn about the plan's; outputs and fits in plain least squares, beside what is always off."""
    on, rehearsal = rehearsed
    of = unknowns(on, ["thermal_hysteresis"])
    (at,) = of.effects
    low, high = effect(at.id).shape[0].range("tactical")
    rng, errors = np.random.default_rng(0), []
    for _ in range(150):
        width = at.shape["half_width"] * np.exp(0.5 * np.log(high / low) / 1.6449 * rng.standard_normal())
        columns = responses(rehearsal, replace(of, effects=(replace(at, shape={"half_width": width}),)))
        table = np.column_stack((columns, rehearsal.nuisances))
        precision = np.append(np.diag(of.prior_information()), np.ones(rehearsal.nuisances.shape[1]))
        true = rng.standard_normal(table.shape[1])
        true[of.wanted[0]], true[of.wanted[1]] = (
            0.0,
            (width - at.shape["half_width"]) / of.parameters[-1].scale,
        )
        output = table @ true + rng.standard_normal(len(table))
        fit = np.linalg.solve(table.T @ table + np.diag(precision), table.T @ output)
        errors.append((fit - true)[list(of.wanted)])
    size, width = np.sqrt(np.diag(expected(rehearsal, of)))[list(of.wanted)]
    found = np.sqrt(np.mean(np.square(errors), axis=0))
    assert width == pytest.approx(found[1], rel=0.15)
    # At the plan's own width it would be less; the size's is that.
    alone = np.sqrt(np.diag(np.linalg.inv(information(rehearsal, of))))[list(of.wanted)]
    assert width > 1.2 * alone[1] and size == pytest.approx(alone[0])


def test_what_the_lag_of_sensors_hides_is_no_part_of_what_is_promised():
    """A lag known to within its own size is one more unknown, whose response is a replay of late readings."""
    values = {**VALUES, "k1": 12.0}
    exact, late = (
        Rehearsal(stage(replace(TWIN, sensors=s), NOISE, values, facts=FACTS), Family(), SHORT, FINE_S)
        for s in (Sensors(), Sensors(common=SensorErrors(lag=10.0)))
    )
    of = unknowns(exact.stage, ["k1"])
    rows, twin = exact.rows, exact.stage.model.twin.with_nominal(k1=12.0)
    run, time = rows.run, rows.run.time

    def white_of_late(name):
        moved = np.interp(time - 1.0, time, run.columns[name])
        outputs = [Replayer(r).output(twin) for r in (run.with_columns(**{name: moved}), run)]
        return exact._whitener.whiten((outputs[0] - outputs[1])[rows.kept])

    hidden = np.column_stack([exact.nuisances, *(10.0 * white_of_late(n) for n in ("T_in", "T_out"))])
    white = responses(exact, of)
    table = np.column_stack([white, hidden])
    prior = np.diag(np.append(np.diag(of.prior_information()), np.ones(hidden.shape[1])))
    wanted = np.sqrt(np.diag(np.linalg.inv(table.T @ table + prior)))[: white.shape[1]]
    told = np.sqrt(np.diag(expected(late, of)))
    np.testing.assert_allclose(told, wanted, rtol=0.02)
    (k1,) = of.wanted
    assert told[k1] > 1.5 * np.sqrt(np.diag(expected(exact, of)))[k1]


def test_no_shape_is_expected_to_be_told_worse_than_beforehand(rehearsed):
    """Nor a size not at all, where a programme shows nothing of some of the shapes, as of a fringe jump."""
    on, rehearsal = rehearsed
    for id in ("radiation", "fringe_jump", "sf_hysteresis", "ageing"):
        of = unknowns(on, [id])
        planned, promised = covariance(information(rehearsal, of)), expected(rehearsal, of)
        shapes = [i for i in of.wanted if not of.parameters[i].name.endswith("amplitude")]
        assert np.all(np.diag(promised)[shapes] <= np.maximum(1.0, np.diag(planned)[shapes]) * (1.0 + 1e-9))
        others = [i for i in range(len(planned)) if i not in shapes]
        np.testing.assert_allclose(np.diag(promised)[others], np.diag(planned)[others])


def test_a_plan_promises_what_it_finds_and_repeats():
    ask = {"hours": 10.0, "most": 12, "seed": 2, "separate": [["thermal_hysteresis", "stress_relaxation"]]}
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
    plan = plan_runs(TWIN, ["k1"], hours=6.0, most=30, criterion="A", facts=FACTS)
    assert any(plan.runs[0].programme.schedule.table_rate.values)
    error = plan.outlook.errors[0]
    assert error.se < 0.01 * error.prior


def test_what_the_twin_has_beside_what_is_asked_is_told_to_be_taken_as_known():
    ask = {"hours": 5.0, "most": 1, "facts": FACTS}
    told = plan_runs(load_twin("tactical"), ["shupe_pure"], **ask).assumed
    (known,) = (text for text in told if "taken as known exactly" in text)
    assert "thermal_hysteresis" in known and "shupe_pure" not in known
    assert not any("exactly" in text for text in plan_runs(TWIN, ["b1"], **ask).assumed)


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
        ({"want": ["turn_on_bias"]}, "drawn by chance"),
        ({"want": [], "separate": [["thermal_shock", "shupe_pure"]]}, "drawn by chance"),
        ({"want": ["k1"], "twin": replace(TWIN, noise=NoiseConstants())}, "no white noise"),
        ({"want": ["k1"], "lab": Lab(fastest_ramp=0.5), "hours": 5.0}, "the shortest programme"),
        ({"want": ["k1"], "hours": 1.0}, "the shortest programme"),
        ({"want": ["k1"], "criterion": "E"}, "D or A was expected"),
        ({"want": ["k1"], "runs": 0}, "1 to 8 can be planned"),
        ({"want": [], "separate": [["shupe_pure", "shupe_pure"]]}, "named twice"),
    ],
)
def test_what_cannot_be_planned_is_refused(ask, message):
    with pytest.raises(InputError, match=message):
        plan_runs(**{"twin": TWIN, **ask})
