"""Evidence of change: against integrals done numerically, and against its own promise."""

from __future__ import annotations

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from fogml.errors import InputError
from fogml.monitor.changes import _change, change_chart
from fogml.monitor.evidence import ChangePrior, FigureEvidence, flicker_covariance
from fogml.signals.random_noise import flicker_noise


def _marginal(y, column, size, covariance, line=()):
    """Integral over mean, slope along a line and log deviation of a normal likelihood with a random
    coefficient of `column`."""
    usual = np.stack((np.ones(len(y)), *line))
    n, p = len(y), len(usual)
    # They are taken out by contrasts, whose density does not depend on them.
    contrasts = np.linalg.svd(usual)[2][p:]
    turned = contrasts @ y
    moved = contrasts @ column
    spread = multivariate_normal(
        np.zeros(n - p), contrasts @ covariance @ contrasts.T + size**2 * np.outer(moved, moved)
    )

    def density(log_deviation):
        return spread.pdf(turned * np.exp(-log_deviation)) * np.exp(-(n - p) * log_deviation)

    volume = np.sqrt(np.linalg.det(usual @ usual.T))
    return quad(density, -4.0, 12.0, limit=200, epsabs=0.0, epsrel=1e-7)[0] / volume


@pytest.mark.parametrize("ages", [np.arange(8.0), np.array([0.0, 1.0, 3.0, 3.5, 8.0, 9.0, 15.0, 16.0])])
def test_the_statistic_is_the_sum_of_ratios_of_marginal_likelihoods(ages):
    y = np.random.default_rng(3).normal(size=8)
    own = np.exp(np.random.default_rng(4).normal(size=8))
    prior = ChangePrior(sizes=(3.0,), ramp_sizes=(0.5,), between=(0.3, 1.0), wander=(0.0, 0.5))
    interval = (ages[2] - ages[0]) / 2
    chart = change_chart({"level": y}, ages, 1e9, prior, {"level": 0.1 * own})
    relative = own**2 / np.exp(np.mean(np.log(own[:3] ** 2)))
    wander = flicker_covariance((ages - ages[0]) / interval, prior.longest_wander)
    covariances = [np.diag(w + (1 - w) * relative) + q * wander for w in (0.3, 1.0) for q in (0.0, 0.5)]
    for n in (5, 8):
        logs = []
        for onset in range(1, n - 1):  # the last run alone confirms nothing
            step = (np.arange(n) >= onset).astype(float)
            ramp = np.where(np.arange(n) >= onset, (ages[:n] - ages[onset - 1]) / interval, 0.0)

            def likelihood(column, size, n=n):
                return np.mean([_marginal(y[:n], column, size, c[:n, :n]) for c in covariances])

            plain = likelihood(step, 0.0)
            logs += [np.log(likelihood(step, 3.0) / plain), np.log(likelihood(ramp, 0.5) / plain)]
        assert chart.statistic[n - 1] == pytest.approx(np.sum(np.exp(logs)) / 2.0, rel=1e-6)


def test_that_a_run_alone_is_off_is_a_ratio_of_marginal_likelihoods():
    y, t = np.random.default_rng(3).normal(size=8), np.arange(8.0)
    y[1] += 8.0
    prior = ChangePrior(sizes=(3.0,), ramp_sizes=(0.5,), wander=(0.0, 0.5))
    told = FigureEvidence(y, t, 0, prior, None)
    told.go_to(6)
    covariances = [np.eye(7) + q * flicker_covariance(t[:7], prior.longest_wander) for q in (0.0, 0.5)]

    def likelihood(run, size):
        return sum(_marginal(y[:7], np.eye(7)[run], size, c) for c in covariances)

    ratios = [likelihood(run, 3.0) / likelihood(run, 0.0) for run in range(6)]  # nothing confirms the last
    np.testing.assert_allclose(np.exp(told.alone), ratios, rtol=1e-6)
    assert np.argmax(told.alone) == 1


@pytest.mark.parametrize("bad", [1, 7])
def test_a_bad_run_is_told_and_hides_no_later_change(bad):
    """As usual scatter it hid steps a third as large in most units."""
    ages, seen, held = np.arange(30.0), [], []
    for seed in range(6):
        rng = np.random.default_rng([11, seed])
        errors = 0.5 * np.exp(0.3 * rng.normal(size=30))
        level = np.hypot(1.0, errors) * rng.normal(size=30) + 10.0 * (ages >= 20.0)
        level[bad] += 30.0
        chart = change_chart(
            {"level": level, "other": rng.normal(size=30)}, ages, 300.0, errors={"level": errors}
        )
        outlier, *_ = chart.outliers
        assert (outlier.figure, outlier.index) == ("level", bad) and bad < outlier.told_at < 15
        held.append(outlier.size_ci90[0] <= 30.0 <= outlier.size_ci90[1])
        assert np.flatnonzero(np.isnan(chart.usual("level", level))).tolist() == [bad]
        seen += [change.raised_at for change in chart.changes]
    assert sum(place in (21, 22) for place in seen) >= 5 and len(seen) <= 7
    assert sum(held) >= 4


@pytest.mark.parametrize("first", [0, 7])
def test_two_bad_runs_are_changes_there_and_back_and_hide_no_later_one(first):
    """As the first runs since an alarm, or of all, they hid steps a third as large for a dozen runs."""
    ages, errors, raised = np.arange(26.0), {"level": np.full(26, 0.3)}, []
    for seed in range(5):
        level = np.random.default_rng([13, seed]).normal(size=26) + 10.0 * (ages >= 20.0)
        level[first : first + 2] += 30.0
        changes = change_chart({"level": level}, ages, 300.0, errors=errors).changes
        assert [change.onset for change in changes[-2:]] == [first + 2, 20]
        assert changes[-2].size == pytest.approx(-30.0, abs=3.0)
        raised.append(changes[-1].raised_at)
    assert np.median(raised) <= 22


def test_a_step_is_no_run_alone_and_normal_runs_are_none():
    alone = 0
    for seed in range(15):
        level = np.random.default_rng([12, seed]).normal(size=30)
        alone += len(change_chart({"level": level}, np.arange(30.0), 300.0).outliers)
        level[15:] += 8.0
        chart = change_chart({"level": level}, np.arange(30.0), 300.0)
        assert chart.changes[0].onset == 15
        alone += len(chart.outliers)
    # Stated: 3 in 30 times 30 runs at most, in the mean.
    assert alone <= 3


def test_after_a_change_constants_and_lines_are_as_likely_from_the_first_runs_on():
    t = np.array([0.0, 1.0, 2.0, 3.0, 4.5, 5.0, 6.5])
    y = 0.3 * t + np.random.default_rng(3).normal(size=7)
    prior = ChangePrior(sizes=(3.0,), ramp_sizes=(0.5,), wander=(0.0, 0.5))
    told = FigureEvidence(y, t, 0, prior, None, moves=True)
    told.go_to(6)
    spread = [np.eye(7) + q * flicker_covariance(t, prior.longest_wander) for q in (0.0, 0.5)]

    def likelihood(column, size):
        total = 0.0
        for line in ((), (t,)):
            first = sum(_marginal(y[:4], column[:4], 0.0, c[:4, :4], [x[:4] for x in line]) for c in spread)
            total += sum(_marginal(y, column, size, c, line) for c in spread) / first
        return total

    for place, onset in enumerate(range(1, 6)):
        step = (np.arange(7) >= onset).astype(float)
        ramp = np.where(np.arange(7) >= onset, t - t[onset - 1], 0.0)
        ratios = [likelihood(step, 3.0), likelihood(ramp, 0.5)] / likelihood(step, 0.0) / 2.0
        confirmed = np.where(told.logs[place] == 0.0, 1.0, ratios)
        np.testing.assert_allclose(np.exp(told.logs[place]), confirmed, rtol=1e-6)
    assert np.any(told.logs != 0.0)


@pytest.mark.parametrize("slope", [0.5, 3.0, 30.0])
def test_a_ramp_that_goes_on_is_one_alarm_and_its_end_another(slope):
    age, late = np.arange(60.0), []
    for seed in range(3):
        level = np.random.default_rng([3, seed]).normal(size=60) + slope * np.clip(age - 15.0, 0.0, 25.0)
        (first, *others) = change_chart({"level": level}, age, 300.0).changes
        assert first.shape == "ramp" and not first.off_course
        # Before, a new alarm every three runs.
        assert len(others) <= 1
        late += [(change.raised_at > 40, change.off_course, change.size) for change in others]
    after, off_course, sizes = np.array(late).T
    assert len(late) >= 2 and np.all(after) and np.all(off_course)
    np.testing.assert_allclose(sizes, -slope, rtol=0.4)


def test_outliers_of_single_runs_are_no_change_and_steps_are_found_with_the_next_run():
    rng, ages, false, late = np.random.default_rng(7), np.arange(30.0), 0, []
    errors = {name: np.full(30, 0.2) for name in "abcd"}
    for _ in range(20):
        figures = {name: rng.standard_t(3, 30) for name in "abcd"}
        false += bool(change_chart(figures, ages, 1000.0, errors=errors).changes)
    for _ in range(5):
        figures = {name: rng.standard_normal(30) for name in "abcd"}
        figures["a"][15:] += 10.0
        late.append(change_chart(figures, ages, 1000.0, errors=errors).changes[0].raised_at - 15)
    assert not false  # by one run alone two of them
    assert np.median(late) == 1


def test_runs_that_follow_change_nothing_of_those_before_and_take_little_room():
    """Beyond the runs that are judged at once; before, 300 runs of a figure took 90 MB."""
    rng = np.random.default_rng(8)
    level, age = rng.normal(size=300), np.cumsum(rng.uniform(0.5, 2.0, 300))
    errors = np.exp(0.3 * rng.normal(size=300))
    tracemalloc.start()
    whole = change_chart({"level": level}, age, 1e9, errors={"level": errors})
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    part = change_chart({"level": level[:100]}, age[:100], 1e9, errors={"level": errors[:100]})
    np.testing.assert_allclose(whole.statistic[:100], part.statistic, rtol=1e-8)
    assert peak < 25e6


def test_without_a_change_alarms_are_as_rare_as_stated():
    rng = np.random.default_rng(0)
    runs, between, repeats = 30, 75.0, 60
    prior = ChangePrior(wander=(0.0,))
    alarmed = 0
    for _ in range(repeats):
        figures = {"level": rng.normal(size=runs), "scatter": 7.0 + 0.1 * rng.normal(size=runs)}
        alarmed += bool(change_chart(figures, np.arange(float(runs)), between, prior).changes)
    # By Doob's inequality the share is at most 30 / 75; most paths stay well below.
    assert 0.0 < alarmed / repeats < 0.4


def test_what_is_told_badly_and_what_wanders_is_no_change():
    rng = np.random.default_rng(5)
    alarmed = np.zeros(2, dtype=int)
    for _ in range(40):
        errors = np.exp(1.5 * rng.normal(size=30))
        told = {"level": 0.1 * rng.normal(size=30) + errors * rng.normal(size=30)}
        wanders = {
            "level": np.linalg.cholesky(flicker_covariance(np.arange(30.0), 1e3)) @ rng.normal(size=30)
        }
        for place, (figures, se) in enumerate(((told, {"level": errors}), (wanders, None))):
            alarmed[place] += bool(change_chart(figures, np.arange(30.0), 300.0, None, se).changes)
    # Stated: at most 30 / 300 of either.
    assert np.all(alarmed <= 4)


@pytest.mark.parametrize("size", [4.0, 10.0])
def test_a_step_is_found_where_it_is(size):
    rng = np.random.default_rng(1)
    found = []
    for _ in range(25):
        level = rng.normal(size=30)
        level[15:] += size
        figures = {"level": level, "rate_slope": rng.normal(size=30)}
        changes = change_chart(figures, np.arange(30.0), 1000.0).changes
        if changes:
            first = changes[0]
            held = first.onset_ci90[0] <= 15 <= first.onset_ci90[1]
            within = first.size_ci90[0] <= size <= first.size_ci90[1]
            found.append((first.figure == "level", held, within, first.raised_at - 15))
    right, held, within, delay = np.array(found, dtype=float).T
    assert len(found) >= (24 if size == 10.0 else 18)
    assert right.mean() > 0.9
    assert held.mean() > 0.85
    assert within.mean() > 0.7
    assert np.median(delay) <= (6 if size == 4.0 else 1)


def test_what_changed_is_told_by_the_runs_since_and_the_alarm_stands_as_it_was_raised():
    ages, at_once, since = np.arange(30.0), [], []
    for seed in range(20):
        rng = np.random.default_rng([5, seed])
        errors = 0.5 * np.exp(0.3 * rng.normal(size=30))
        level = np.hypot(1.0, errors) * rng.normal(size=30) + 6.0 * (ages >= 16.0)
        told = change_chart({"level": level}, ages, 300.0, errors={"level": errors}).changes[0]
        stop = told.raised_at + 1
        cut = {"level": level[:stop]}
        first = change_chart(cut, ages[:stop], 300.0, errors={"level": errors[:stop]}).changes[0]
        assert (first.raised_at, first.statistic) == (told.raised_at, pytest.approx(told.statistic, rel=1e-9))
        at_once.append((first.shape == "step", first.size - 6.0))
        since.append((told.shape == "step", told.size - 6.0))
        assert told.size_ci90[1] - told.size_ci90[0] < first.size_ci90[1] - first.size_ci90[0]
    assert all(step for step, _ in since)
    rms = [np.sqrt(np.mean([off**2 for step, off in told if step])) for told in (at_once, since)]
    assert rms[1] < 0.6 and rms[1] < 0.7 * rms[0]


@pytest.mark.parametrize("far_off", [1, 2])
def test_a_run_that_is_far_off_raises_no_alarm_and_after_two_the_alarm_does_not_stand(far_off):
    raised, latest = [], []
    for seed in range(15):
        level = np.random.default_rng([9, seed]).normal(size=26)
        level[20 : 20 + far_off] += 12.0
        errors = {"level": np.full(26, 0.3)}
        changes = change_chart({"level": level}, np.arange(26.0), 300.0, errors=errors).changes
        raised += [change.raised_at for change in changes]
        latest += [change.latest_statistic for change in changes]
    if far_off == 1:
        assert not raised  # as a ramp that begins with the run before it, four of these
    else:
        # Without a change the evidence is the number of runs, or less.
        assert raised.count(21) >= 13 and np.median(latest) < 26.0


def test_where_nothing_wanders_small_steps_are_found_and_where_it_does_alarms_are_raised():
    rng = np.random.default_rng(6)
    found = dict.fromkeys(("step", "step, steady", "wandering, steady"), 0)
    for _ in range(20):
        level, wandering = rng.normal(size=30), flicker_noise(rng, 30, 1.0)
        level[15:] += 3.0
        for name, values, prior in (
            ("step", level, ChangePrior()),
            ("step, steady", level, ChangePrior().steady()),
            ("wandering, steady", wandering, ChangePrior().steady()),
        ):
            found[name] += bool(change_chart({"level": values}, np.arange(30.0), 1000.0, prior).changes)
    assert found["step, steady"] >= 18 > 12 >= found["step"]
    assert found["wandering, steady"] >= 3


def test_a_ramp_is_told_from_a_step_and_runs_that_do_not_tell_are_passed_over():
    rng = np.random.default_rng(2)
    age = np.arange(60.0)
    level = 0.3 * rng.normal(size=60) + np.where(age > 20, 0.2 * (age - 20), 0.0)
    level[rng.choice(60, 15, replace=False)] = np.nan
    (change, *_) = change_chart({"level": level}, age, 1000.0).changes
    assert change.shape == "ramp"
    assert change.size == pytest.approx(0.2, rel=0.2)
    assert np.isfinite(level[change.onset])


@settings(max_examples=25, deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3), st.floats(0.1, 100.0))
def test_units_and_offsets_change_nothing(offset, scale, day):
    rng = np.random.default_rng(4)
    level = rng.normal(size=12)
    plain = change_chart({"level": level}, np.arange(12.0), 1e12)
    other = change_chart({"level": offset + scale * level}, day * np.arange(12.0), 1e12)
    np.testing.assert_allclose(other.statistic, plain.statistic, rtol=1e-5)


def test_equal_values_are_no_change():
    assert not change_chart({"level": np.full(20, 0.3)}, np.arange(20.0), 10.0).changes


def test_what_is_wrong_is_said():
    level = np.zeros(5)
    with pytest.raises(InputError, match="go back"):
        change_chart({"level": level}, np.array([0.0, 1.0, 0.5, 2.0, 3.0]), 10.0)
    with pytest.raises(InputError, match="at least 1"):
        change_chart({"level": level}, np.arange(5.0), 0.0)
    with pytest.raises(InputError, match="shape"):
        change_chart({"level": level[:3]}, np.arange(5.0), 10.0)


def test_an_onset_is_one_of_the_fewest_that_hold_nine_tenths():
    chart = SimpleNamespace(onset=lambda place: place, size_quantiles=lambda levels, shape: levels)
    shares = np.array([0.05, 0.5, 0.41, 0.03, 0.01])
    logs = {"bias": np.log(np.column_stack([shares, 1e-3 * shares]))}
    found = _change({"bias": chart}, logs, 9, 2000.0)
    assert (found.shape, found.onset, found.onset_ci90) == ("step", 1, (1, 2))
    assert found.probability == pytest.approx(1.0 / 1.001)


def test_the_size_of_a_ramp_counts_that_its_onset_is_not_known() -> None:
    held, runs = [], np.arange(40.0)
    for seed in range(40):
        level = np.random.default_rng(seed).standard_normal(40) + 0.7 * np.maximum(runs - 19.0, 0.0)
        changes = change_chart({"level": level}, runs, 300.0).changes
        if changes and changes[0].shape == "ramp":
            held.append(changes[0].size_ci90[0] <= 0.7 <= changes[0].size_ci90[1])
    # From the likeliest run alone, intervals held half of the true sizes.
    assert len(held) >= 30 and np.mean(held) > 0.8
