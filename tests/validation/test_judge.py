"""Judgements with known answers: which reference, which rows, which limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.runs.facts import EARTH_RATE_DEG_H, Facts
from fogml.runs.run import Run
from fogml.validation.judge import judge
from tests.validation.known_drift import KnownDrift

pytestmark = pytest.mark.usefixtures("without_noise_terms")

LATITUDE = 30.0
EARTH = EARTH_RATE_DEG_H * 0.5


def ramp_run(name: str, bias: float, *, facts: Facts | None = None, low: float = 0.0, n: int = 4000) -> Run:
    """A ramp from `low` over 40 degC at 1 Hz; error = bias + 0.01 T, no noise."""
    time = np.arange(float(n))
    temperature = low + 40.0 * time / n
    facts = facts or Facts()
    earth = facts.earth_rate_deg_h or 0.0
    return Run.from_columns(name, facts, time=time, gyro=earth + bias + 0.01 * temperature, T=temperature)


def slope_law(run):
    return 0.01 * run.temperature("T")


KNOWN = Facts(latitude=LATITUDE, input_axis="up")


def test_known_earth_rate_is_taken_off_and_nothing_else():
    train, test = ramp_run("a.csv", 0.3, facts=KNOWN), ramp_run("b.csv", 0.5, facts=KNOWN)
    result = judge(KnownDrift(slope_law).fit(train), train, test)
    (run,) = result.test
    assert run.bias_reference == "earth rate"
    assert run.after.bias == pytest.approx(0.5)
    assert run.before.bias == pytest.approx(0.7, abs=0.01)
    assert run.after.bias_stability == pytest.approx(0.0, abs=1e-12)


def test_unknown_earth_rate_takes_the_training_mean_off_both():
    train, test = ramp_run("a.csv", EARTH), ramp_run("b.csv", EARTH + 0.2)
    result = judge(KnownDrift(slope_law).fit(train), train, test)
    (run,) = result.test
    assert run.bias_reference == "training mean"
    assert run.before.bias == pytest.approx(0.2, abs=1e-9)
    assert run.after.bias == pytest.approx(0.2, abs=1e-9)
    assert result.train[0].after.bias == pytest.approx(0.0, abs=1e-9)
    assert any("constant is estimated" in note for note in result.notes)
    # What is drawn and written beside each other is about the same mean.
    np.testing.assert_allclose(run.series.before - run.series.drift, run.series.after, atol=1e-12)
    np.testing.assert_allclose(np.ptp(run.series.drift), np.ptp(run.series.before), rtol=1e-6)


def test_no_model_leaves_before_and_after_the_same():
    train, test = ramp_run("a.csv", 3.0), ramp_run("b.csv", 3.4)
    (run,) = judge(KnownDrift().fit(train), train, test).test
    assert run.before == run.after


def test_earth_rate_known_for_some_runs_only_is_said():
    train, test = ramp_run("a.csv", 0.1, facts=KNOWN), ramp_run("b.csv", EARTH)
    result = judge(KnownDrift(slope_law).fit(train), train, test)
    assert any("not for b.csv" in note for note in result.notes)


def test_rows_without_a_full_window_are_left_out():
    train = ramp_run("a.csv", 0.0)
    spoiled = np.where(train.time < 500.0, 1e6, 0.0)
    test = train.with_columns(gyro=train.gyro + spoiled)
    test = replace(test, name="b.csv")
    model = KnownDrift(slope_law, full_from_s=500.0).fit(train)
    (run,) = judge(model, train, test).test
    assert run.after.rms == pytest.approx(0.0, abs=1e-9)
    assert (run.rows_used, run.rows_left_out) == (3500, 500)


def test_turns_tell_the_scale_factor_and_not_the_bias():
    rate = np.zeros(6000)
    rate[3000:3060], rate[3060:3120] = 10.0, -10.0
    time = np.arange(6000.0)
    columns = {"time": time, "rate": rate, "T": 20.0 + time / 600.0}
    train = Run.from_columns("a.csv", KNOWN, gyro=EARTH + 3600.0 * rate * (1 + 200e-6), **columns)
    (run,) = judge(KnownDrift().fit(train), train, train).test
    assert run.before.scale_factor_error == pytest.approx(200.0, rel=1e-9)
    assert run.before.rms == pytest.approx(0.0, abs=1e-9)


def test_share_outside_training_is_of_the_rows_that_count():
    train, test = ramp_run("a.csv", 0.0), ramp_run("b.csv", 0.1, low=10.0)
    model = KnownDrift(slope_law, hottest=40.0).fit(train)
    (run,) = judge(model, train, test).test
    assert run.outside_training == pytest.approx(0.25, abs=0.001)
    assert [finding.code for finding in run.findings] == ["outside_training"]
    assert judge(model, train, train).train[0].outside_training == 0.0


def test_limits_take_the_worst_test_run():
    train = ramp_run("a.csv", 0.0, facts=KNOWN)
    tests = [ramp_run("b.csv", -0.5, facts=KNOWN), ramp_run("c.csv", 0.2, facts=KNOWN)]
    model = KnownDrift(slope_law).fit(train)
    result = judge(model, train, tests, design_index=0.4, limits={"bias": 0.6})
    assert result.design_index is not None
    assert result.design_index.value == pytest.approx(0.5)
    assert not result.design_index.met
    assert result.limits[0].value == pytest.approx(0.5)
    assert result.limits[0].met
    assert not result.met
    assert judge(model, train, tests, design_index=0.6).met


def test_an_unknown_limit_lists_the_known():
    train = ramp_run("a.csv", 0.0)
    with pytest.raises(InputError, match=r"'stability'.*bias_stability.*scale_factor_error"):
        judge(KnownDrift().fit(train), train, train, limits={"stability": 1.0})


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan")])
def test_a_limit_that_is_no_positive_number(limit):
    train = ramp_run("a.csv", 0.0)
    with pytest.raises(InputError, match="positive"):
        judge(KnownDrift().fit(train), train, train, limits={"rms": limit})
    with pytest.raises(InputError, match="positive"):
        judge(KnownDrift().fit(train), train, train, design_index=limit)


def test_a_limit_that_no_run_tells_is_an_error():
    train = ramp_run("a.csv", 0.0)
    with pytest.raises(InputError, match="no test run tells it"):
        judge(KnownDrift().fit(train), train, train, limits={"scale_factor_error": 10.0})


def test_another_axis_is_refused_unless_allowed():
    train = ramp_run("a.csv", 0.0, facts=Facts(axis="x"))
    test = ramp_run("b.csv", 0.0, facts=Facts(axis="y"))
    model = KnownDrift(slope_law).fit(train)
    with pytest.raises(InputError, match="axis 'y'"):
        judge(model, train, test)
    (run,) = judge(model, train, test, any_unit=True).test
    assert any("axis 'y'" in note for note in run.notes)


def test_a_test_run_that_was_trained_on_is_said():
    train = ramp_run("a.csv", 0.0)
    (run,) = judge(KnownDrift().fit(train), train, replace(train, name="copy.csv")).test
    assert [finding.code for finding in run.findings] == ["seen_in_training"]


def test_a_run_of_the_models_card_is_told_though_it_is_not_named_as_a_training_run():
    first, second, third = (ramp_run(f"{name}.csv", 0.1 * i) for i, name in enumerate("abc"))
    model = make_model("polynomial", "T").fit([first, second])
    told = [judge(model, first, run).test[0].findings for run in (second, third)]
    assert [[finding.code for finding in found] for found in told] == [["seen_in_training"], []]


def test_series_for_the_figures():
    train = ramp_run("a.csv", 0.0)
    (run,) = judge(KnownDrift(slope_law, half_width=0.3).fit(train), train, train).test
    series = run.series
    assert len(series.time) == 40
    np.testing.assert_allclose(series.rate, 40.0 / 4000 * 60, rtol=1e-9)
    np.testing.assert_allclose(series.upper, 0.3)
    np.testing.assert_allclose(series.lower, -0.3)
    np.testing.assert_allclose(series.before.std(), run.before.bias_stability)
    assert series.regime.shape == series.flag.shape == (40,)


def test_the_floor_is_the_noise_and_not_the_drift():
    train = ramp_run("a.csv", 0.0, n=40_000)
    noise = np.random.default_rng(5).normal(scale=2.0, size=len(train))
    test = replace(train.with_columns(gyro=train.gyro + noise), name="b.csv")
    (run,) = judge(KnownDrift().fit(train), train, test).test
    assert run.floor == pytest.approx(0.2, rel=0.1)


def test_the_floor_counts_the_samples_that_averages_hold():
    """Four in ten samples lost at random: averages over 100 s scatter by 2 / sqrt(60)."""
    train = ramp_run("a.csv", 0.0, n=40_000)
    rng = np.random.default_rng(6)
    noise = rng.normal(scale=2.0, size=len(train))
    test = replace(train.with_columns(gyro=train.gyro + noise)[rng.random(len(train)) < 0.6], name="b.csv")
    for judged in (
        judge(KnownDrift(slope_law).fit(train), train, test).test[0],
        judge(KnownDrift(slope_law).fit(train), train, test, noise=test).test[0],
    ):
        assert judged.after.bias_stability == pytest.approx(2.0 / np.sqrt(60.0), rel=0.1)
        assert judged.floor == pytest.approx(2.0 / np.sqrt(60.0), rel=0.04)


@pytest.mark.parametrize("memory", ["lag(T, 3600 s)", "play(T, 15 degC)"])
def test_what_is_outside_counts_while_a_memory_settles(memory):
    time = np.arange(0.0, 7200.0, 4.0)
    held = 25.0 + 20.0 * np.sin(2.0 * np.pi * time / 7200.0)
    train = Run.from_columns("a.csv", time=time, gyro=0.1 * held, T=held)
    test = Run.from_columns("b.csv", time=time, gyro=0.1 * (held + 60.0), T=held + 60.0)
    (run,) = judge(make_model("polynomial", f"T, {memory}").fit(train), train, test).test
    assert run.not_settled > 0.1
    assert run.outside_training == 1.0


def test_coverage_is_of_averages_over_the_interval_s_own_time_whatever_that_of_the_figures_is():
    """A line and white noise: about nine of ten averages over 100 s, by hand, with figures of 10 to 500 s."""
    rng = np.random.default_rng(3)
    runs = [ramp_run(name, 0.3, n=12000) for name in ("a.csv", "b.csv")]
    runs = [run.with_columns(gyro=run.gyro + rng.standard_normal(len(run))) for run in runs]
    model = make_model("polynomial", "T").fit(runs[0])
    half, over_s = float(model.intervals_.half_width(0.9)), model.intervals_.averaging_s
    left = runs[1].error_deg_h - model.predict(runs[1])
    inside = np.abs(left.reshape(-1, round(over_s)).mean(axis=1)) <= half
    for averaging_s in (10.0, 100.0, 500.0):
        (run,) = judge(model, runs[0], runs[1], averaging_s=averaging_s).test
        assert run.coverage == pytest.approx(inside.mean(), abs=0.02)


@pytest.mark.parametrize(
    ("start", "stop", "coarse", "share"),
    [
        (0, 4000, 0.0, 1.0),
        (1000, 3000, 0.0, 1.0),
        (2000, 6000, 0.0, 0.5),
        (2000, 6000, 0.5, 0.5),
        (4000, 8000, 0.5, 0.0),
    ],
)
def test_samples_of_a_training_run_are_told_though_cut_and_on_another_clock(start, stop, coarse, share):
    """Of 8000 samples the first half is trained on; the test run is another part, its clock begun anew."""
    rng = np.random.default_rng(5)
    whole = ramp_run("whole.csv", 0.3, n=8000)
    gyro = whole.gyro + rng.standard_normal(len(whole))
    whole = whole.with_columns(gyro=np.round(gyro / coarse) * coarse if coarse else gyro)
    train, part = whole[:4000], whole[start:stop]
    test = Run("test.csv", {**part.columns, "time": part.time - part.time[0]})
    (run,) = judge(KnownDrift(slope_law).fit(train), train, test).test
    told = [finding for finding in run.findings if finding.code == "seen_in_training"]
    assert bool(told) == bool(share)
    assert sum(finding.count for finding in told) == pytest.approx(share * len(test), abs=len(test) / 16)


def test_outputs_that_stand_still_alike_are_not_taken_for_the_same_samples():
    train = Run("a", {**ramp_run("a", 0.3).columns, "gyro": np.full(4000, 0.3)})
    test = Run("b", {**train.columns, "T": train.columns["T"] + 1.0})
    (run,) = judge(KnownDrift(slope_law).fit(train), train, test).test
    assert not any(finding.code == "seen_in_training" for finding in run.findings)
