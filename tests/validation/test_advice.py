"""The verdict on a model: each thing that speaks against use is told and alone decides; the gravest leads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from fogml.models.names import make_model
from fogml.report.verdict import advice_words
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.validation.advice import Asked, advice_on, which_to_use
from fogml.validation.judge import judge
from fogml.validation.report_json import judgement_json
from fogml.validation.results import Judgement, RunJudgement
from tests.report.judgements import FLOOR, judgement

SEEN = Finding("seen_in_training", "holds the same samples as training run a.csv")

DEAD = Finding("dead_output", "'gyro' is 0 in every sample, as of one not connected", "gyro", 1, 36128)
STUCK = Finding("stuck_sensor", "'gyro' stays at 1.5 from 10 s to 8000 s", "gyro", 10, 8000)

CUT = Finding("saturation", "900 samples of 'gyro' at its extreme", "gyro", 1, 900, at_rest=900)
TURNING_CUT = replace(CUT, at_rest=0)

SIGN = Finding("implausible_scale_factor", "the output follows the table rate -1 times", "gyro", 1, 100)


def trained_on(finding: Finding) -> Judgement:
    """A judgement of a model that was trained on a run of which something was noticed."""
    base = judgement()
    return replace(base, train=(replace(base.train[0], findings=(finding,)),))


def of_ways(run: RunJudgement, way: str) -> RunJudgement:
    """A run whose temperature goes one way only."""
    ends = (-20.0, 60.0) if way == "up" else (60.0, -20.0)
    temperature = np.linspace(*ends, len(run.series.time))
    return replace(run, series=replace(run.series, temperature=temperature))


def one_way(way: str, test_way: str) -> Judgement:
    base = judgement()
    return replace(base, train=(of_ways(base.train[0], way),), test=(of_ways(base.test[0], test_way),))


def narrow() -> Judgement:
    base = judgement()
    (run,) = base.train
    flat = replace(run.series, temperature=25.0 + 0.01 * run.series.temperature)
    return replace(base, train=(replace(run, series=flat),))


def judged_at_one_temperature() -> Judgement:
    base = judgement()
    return replace(base, test=(replace(base.test[0], series=narrow().train[0].series),))


def used_there(judged: Judgement) -> Judgement:
    """A judgement whose test run stays at the temperature trained at."""
    (run,), (trained,) = judged.test, judged.train
    kept = replace(run.series, temperature=trained.series.temperature)
    return replace(judged, test=(replace(run, series=kept),))


def overconfident() -> Judgement:
    base = judgement()
    (run,) = base.test
    return replace(base, test=(replace(run, coverage=0.5),))


def test_nothing_against_is_use() -> None:
    found = advice_on(judgement())
    assert (found.grade, found.brief) == ("use", "judged on a run it has not seen")
    # The end of a range that only the turning table reaches speaks against no drift model.
    turning = judgement(findings=(TURNING_CUT,))
    assert advice_on(turning).grade == "use" and turning.test[0].saturated is None


@pytest.mark.parametrize(
    ("make", "grade", "brief"),
    [
        (lambda: one_way("up", "down"), "do_not_use", "trained one way"),
        (lambda: one_way("down", "up"), "do_not_use", "trained one way"),
        (lambda: one_way("up", "up"), "use_with_care", "trained one way"),
        (lambda: judgement(findings=(SEEN,)), "do_not_use", "not judged on another run"),
        (lambda: judgement(left=3.0), "do_not_use", "worse than none on b.csv"),
        (lambda: judgement(left=3.0, findings=(DEAD,)), "do_not_use", "the output of b.csv stands still"),
        (lambda: judgement(findings=(STUCK,)), "use_with_care", "the output of b.csv stands still"),
        (lambda: judgement(findings=(CUT,)), "use_with_care", "the output of b.csv saturates"),
        (lambda: trained_on(CUT), "use_with_care", "the output of a.csv saturates"),
        (lambda: trained_on(STUCK), "use_with_care", "the output of a.csv stands still"),
        (lambda: trained_on(DEAD), "do_not_use", "the output of a.csv stands still"),
        (
            lambda: trained_on(SIGN),
            "use_with_care",
            "the output or the table's rate of a.csv can't be as stated",
        ),
        (lambda: judgement(findings=(SIGN,)), "use_with_care", "the output or the table's rate of b.csv"),
        (lambda: judgement(offset=-2.0), "use_with_care", "the mean of b.csv moved"),
        (lambda: judgement(left=1.0, offset=-2.0), "do_not_use", "takes away less than the noise on b.csv"),
        (lambda: judgement(left=3.0, offset=-5.0), "use_with_care", "less steady than without on b.csv"),
        (lambda: judgement(kind="mean", left=1.0), "do_not_use", "takes away less than the noise on b.csv"),
        (lambda: judgement(outside=0.1), "use_with_care", "10 % of b.csv is outside of what was trained"),
        (lambda: judgement(outside=0.7), "use_with_care", "70 % of b.csv is outside of what was trained"),
        (lambda: judgement(limit=1e-3), "do_not_use", "rms over its limit"),
        (overconfident, "use_with_care", "its interval does not hold on b.csv"),
        (narrow, "do_not_use", "trained at one temperature"),
        (judged_at_one_temperature, "use_with_care", "judged at one temperature"),
        (lambda: used_there(narrow()), "use_with_care", "trained at one temperature"),
        (
            lambda: replace(narrow(), test=judgement(left=3.0).test),
            "do_not_use",
            "trained at one temperature",
        ),
    ],
)
def test_each_reason_alone_decides(make: Callable[[], Judgement], grade: str, brief: str) -> None:
    judged = make()
    if brief != "rms over its limit":
        judged = replace(judged, design_index=None, limits=())
    found = advice_on(judged)
    assert found.grade == grade and found.brief.startswith(brief)
    assert found.next_step


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        ([(0.3, 0.79)], "39 of the 80 degC"),
        ([(0.0, 0.2), (0.5, 0.75)], "36 of the 80 degC"),
        ([(-0.5, 0.4), (0.2, 0.3)], "32 of the 80 degC"),
        ([(0.2, 0.71)], ""),
        ([(0.0, 0.3), (0.2, 0.6)], ""),
    ],
)
def test_what_test_runs_do_not_go_over_is_not_judged(parts: list[tuple[float, float]], told: str) -> None:
    """Trained from -20 to 60 degC; what counts is what the test runs go over together."""
    base = judgement()
    train, (run,) = (of_ways(base.train[0], "up"), of_ways(base.train[0], "down")), base.test
    tests = []
    for ends in parts:
        course = np.linspace(*(-20.0 + 80.0 * np.array(ends)), len(run.series.time))
        tests.append(replace(run, series=replace(run.series, temperature=course)))
    found = advice_on(replace(base, train=train, test=tuple(tests)))
    assert found.grade == ("use_with_care" if told else "use")
    assert (found.brief == "judged over a part of its temperatures") == bool(told)
    assert told in found.reasons[0]


def test_a_reason_that_asks_ends_with_its_question() -> None:
    asking = replace(SIGN, message="is its sign wrong?")
    (reason, *_) = advice_on(trained_on(asking)).reasons
    assert "is its sign wrong? If it is" in reason


def beside(times: float) -> Judgement:
    """A judgement beside another model that leaves so many times as much."""
    base = replace(judgement(), design_index=None, limits=())
    (run,) = base.test
    other = replace(run, after=replace(run.after, rms=times * run.after.rms))
    return replace(base, beside={"auto": (other,)})


def test_of_two_models_the_one_that_leaves_less_is_named() -> None:
    better = advice_on(beside(0.9))
    assert (better.grade, better.brief) == ("do_not_use", "auto leaves less")
    assert better.reasons[0].startswith("Use auto: ") and better.next_step == "Train auto in its place."
    assert advice_on(beside(1.1)).grade == "use"
    assert which_to_use(beside(1.1))[1].startswith("Use this model rather than auto")
    for times in (0.97, 1.03):
        assert which_to_use(beside(times))[0] is None and advice_on(beside(times)).grade == "use"
        assert which_to_use(beside(times))[1].startswith("Use either")
    assert which_to_use(judgement()) == (None, "")


def test_where_the_mean_of_the_run_moved_the_steadier_model_is_named() -> None:
    """A shift of 3 deg/h beside 0.03 or 0.1 deg/h about the mean: hypot(3, 0.1) is 3.0017."""
    base = replace(judgement(), design_index=None, limits=())
    (run,) = base.test

    def leaving(stability: float) -> RunJudgement:
        rms = float(np.hypot(3.0, stability))
        return replace(run, after=replace(run.after, bias=3.0, bias_stability=stability, rms=rms))

    for own, other, better, told in ((0.1, 0.03, "auto", "Use auto"), (0.03, 0.1, None, "Use this model")):
        judged = replace(base, test=(leaving(own),), beside={"auto": (leaving(other),)})
        name, sentence = which_to_use(judged)
        assert name == better and sentence.startswith(told) and "bias stability" in sentence


@pytest.mark.parametrize(
    ("drift", "left", "grade", "brief"),
    [
        # Drift of 1.4 times the noise hardly shows beside it: 1.7 times the noise become 1.
        (1.4, 0.0, "use", "judged on a run it has not seen"),
        (0.6, 0.0, "use_with_care", "takes away less than the noise on b.csv"),
        (9.0, 0.95, "use_with_care", "leaves most of it on b.csv"),
        (9.0, 0.999, "do_not_use", "takes away less than the noise on b.csv"),
        (9.0, 1.001, "do_not_use", "takes away less than the noise on b.csv"),
        (9.0, 1.01, "do_not_use", "worse than none on b.csv"),
    ],
)
def test_what_is_taken_away_is_told_by_squares(drift: float, left: float, grade: str, brief: str) -> None:
    judged = replace(judgement(), design_index=None, limits=())
    (run,) = judged.test
    before, after = (FLOOR * float(np.hypot(1.0, part * drift)) for part in (1.0, left))
    figures = [replace(run.before, bias=0.0, bias_stability=rms, rms=rms) for rms in (before, after)]
    run = replace(run, before=figures[0], after=figures[1], coverage=None)
    found = advice_on(replace(judged, test=(run,)))
    assert (found.grade, found.brief) == (grade, brief)


def test_a_model_that_is_mostly_outside_and_leaves_most_of_it_is_not_to_be_used() -> None:
    judged = replace(judgement(left=0.97, outside=0.7), design_index=None, limits=())
    alone = advice_on(replace(judgement(left=0.97), design_index=None, limits=()))
    assert (alone.grade, alone.brief) == ("use_with_care", "leaves most of it on b.csv")
    found = advice_on(judged)
    assert (found.grade, found.brief) == ("do_not_use", "70 % of b.csv is outside of what was trained")


def test_a_shift_of_the_power_on_alone_is_no_fault_of_the_model() -> None:
    """Shifts of one size either way: what is left within the run is the same, so no verdict is 'do not'."""
    for offset in (-2.0, -0.02, 0.02, 2.0):
        judged = replace(judgement(offset=offset), design_index=None, limits=())
        assert judged.test[0].after.bias_stability == pytest.approx(judgement().test[0].after.bias_stability)
        assert advice_on(judged).grade != "do_not_use"
    told = advice_on(replace(judgement(offset=-2.0), design_index=None, limits=())).reasons[0]
    assert "0.216 deg/h of bias stability become 0.0072" in told and "that power-on shifted it" in told


def test_another_unit_needs_care() -> None:
    base = judgement(unit="FOG-0418")
    assert advice_on(base).brief == "trained on another unit"


def test_the_gravest_reason_leads_and_all_are_told() -> None:
    found = advice_on(replace(judgement(outside=0.1, left=3.0), design_index=None, limits=()))
    assert found.grade == "do_not_use" and len(found.reasons) >= 2
    assert found.reasons[0].startswith("It makes b.csv worse")
    assert any("did not hold" in reason for reason in found.reasons)


def test_one_of_several_test_runs_seen_needs_care() -> None:
    base = judgement(2)
    judged = replace(base, test=(replace(base.test[0], findings=(SEEN,)), base.test[1]))
    assert advice_on(judged).grade == "use_with_care"


def test_what_is_asked_may_be_changed() -> None:
    judged = replace(judgement(outside=0.1), design_index=None, limits=())
    assert advice_on(judged, Asked(outside=0.2)).grade == "use"


def test_report_and_words_say_the_same() -> None:
    judged = one_way("up", "down")
    values = judgement_json(judged)
    told = advice_words(advice_on(judged))
    assert values["verdict"] == "do_not_use" and list(told["reasons"]) == values["reasons"]
    assert told["words"] == "Do not use: trained one way" and told["sign"] == "✗"
    assert values["test"][0]["coverage"] == judged.test[0].coverage


@pytest.mark.parametrize(
    ("times", "told"),
    [
        (3600.0, "in deg/s, 3600 times"),
        (1.0 / 3600.0, "in deg/s, 3600 times"),
        (1000.0, "in thousandths?"),
        (180.0 / np.pi, "in deg/min, 60 times deg/h, or in radians"),
        (1.0 / 60.0, "in deg/min, 60 times deg/h, or in radians"),
        (648_000.0 / np.pi, "in rad/s"),
        (1e8, "in another unit?"),
        (20.0, ""),
    ],
)
def test_a_run_in_another_unit_is_told_from_one_that_moves_more(times: float, told: str) -> None:
    time = 10.0 * np.arange(1500)
    warm = 20.0 - 30.0 * np.cos(time / 2400.0)
    drift = 5.0 + 0.05 * warm + np.random.default_rng(1).normal(0.0, 0.05, (2, len(time)))
    runs = [
        Run(name, {"time": time, "gyro": scale * gyro, "T": warm})
        for name, scale, gyro in zip("ab", (1.0, times), drift, strict=True)
    ]
    judged = judge(make_model("polynomial", "T").fit(runs[0]), *runs)
    advice = advice_on(judged)
    assert ("different units" in advice.brief) == bool(told)
    assert told in advice.reasons[0]
    both = judge(make_model("polynomial", "T").fit(runs), runs, [runs[0]])
    assert ("different units" in advice_on(both).brief) == bool(told)


@pytest.mark.parametrize(
    ("sign", "slope", "noise", "told"),
    [(-1.0, 0.05, 0.05, True), (1.0, 0.05, 0.05, False), (1.0, 0.0, 0.05, False), (-1.0, 0.05, 8.0, False)],
)
def test_a_run_of_the_other_sign_is_told_where_its_drift_shows(
    sign: float, slope: float, noise: float, told: bool
) -> None:
    rng, time = np.random.default_rng(1), 10.0 * np.arange(1500)
    warm = 20.0 - 30.0 * np.cos(time / 2400.0)
    trained = 5.0 + 0.05 * warm + rng.normal(0.0, 0.05, len(time))
    judged = sign * (5.0 + slope * warm) + rng.normal(0.0, noise, len(time))
    runs = [Run(name, {"time": time, "gyro": gyro, "T": warm}) for name, gyro in zip("ab", (trained, judged))]
    advice = advice_on(judge(make_model("polynomial", "T").fit(runs[0]), *runs))
    assert ("reversed" in advice.brief) == told


@pytest.mark.parametrize(
    ("signs", "told"),
    [
        ((1.0, 1.0), ""),
        ((1.0, -1.0), "a and b seem to be of opposite signs"),
        ((1.0, -1.0, 1.0), "the output of b seems to be reversed"),
        ((-1.0, 1.0, 1.0, 1.0), "the output of a seems to be reversed"),
        ((1.0, 1.0, 1.0), ""),
    ],
)
def test_a_training_run_of_the_other_sign_is_told(signs: tuple[float, ...], told: str) -> None:
    """What they teach cancels: the model is merely worse, and a test run shows no reversed course."""
    rng, time = np.random.default_rng(2), 10.0 * np.arange(1500)
    runs = []
    for name, sign in zip("abcd", signs, strict=False):
        warm = 20.0 - 30.0 * np.cos(time / 2400.0 + rng.uniform(0.0, 6.0)) + rng.normal(0.0, 3.0)
        rate = 60.0 * np.gradient(warm, time)
        drift = 5.0 + 0.05 * warm - 2e-4 * warm**2 + 0.3 * rate
        runs.append(Run(name, {"time": time, "gyro": sign * drift + rng.normal(0.0, 0.05, 1500), "T": warm}))
    model = make_model("polynomial", "T, dT").fit(runs)
    advice = advice_on(judge(model, runs, [runs[-1]]))
    assert told in advice.brief
    assert any("cancels" in reason for reason in advice.reasons) == bool(told)


@pytest.mark.parametrize(("slope", "noise"), [(0.0, 0.05), (0.002, 0.5)])
def test_runs_that_share_no_course_are_of_no_sign(slope: float, noise: float) -> None:
    rng, time = np.random.default_rng(3), 10.0 * np.arange(1500)
    warm = 20.0 - 30.0 * np.cos(time / 2400.0)
    runs = [
        Run(name, {"time": time, "gyro": sign * slope * warm + rng.normal(0.0, noise, 1500), "T": warm})
        for name, sign in (("a", 1.0), ("b", -1.0))
    ]
    judged = judge(make_model("polynomial", "T").fit(runs), runs, [runs[0]])
    assert not any("cancels" in reason for reason in advice_on(judged).reasons)
