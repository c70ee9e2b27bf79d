"""Weights are asked of runs left out, and intervals from them cover another run."""

import numpy as np
import pytest
from scipy.stats import norm

from fogml.features.features import Features
from fogml.models.box import direction_is_told
from fogml.models.combination import LeftOut, combined
from fogml.models.linear import LinearRegressor
from fogml.models.table import TrainingTable
from fogml.models.weights import intervals_of, shift_share, shifts_apart, skill_of, weights_of


def part(predicted, told, kind="runs"):
    rows = np.arange(len(told))
    return LeftOut(kind, predicted, told, np.ones(predicted.shape), (rows[:0], rows))


def test_of_several_runs_what_is_told_within_a_run_has_no_say():
    rng = np.random.default_rng(0)
    z = rng.normal(size=(3, 50))
    runs = [part(np.column_stack([0.99 * told, -told]), told) for told in z]
    blocks = [part(np.column_stack([-told, 0.99 * told]), told, "blocks") for told in z]
    np.testing.assert_allclose(weights_of([*runs, *blocks], 2, True), [1.0, 0.0], atol=0.03)
    np.testing.assert_allclose(weights_of(blocks, 2, True), [0.0, 1.0], atol=0.03)


def test_shifts_of_runs_count_as_generalised_least_squares_has_them():
    """Of the course with s^2 and of the means with s^2 + b^2; runs of one temperature count whole."""
    rng = np.random.default_rng(2)
    course, shifts = rng.normal(size=(4, 500)), np.array([5.0, -3.0, 1.0, -2.0])
    course -= course.mean(axis=1, keepdims=True)
    told = course + shifts[:, None]
    plain, better = told * 0.0 + 0.2, 0.9 * course
    runs = [part(np.column_stack(columns), z) for *columns, z in zip(plain, better, told)]
    share = shift_share([z - p for z, p in zip(told, better)], list(told))
    s2, b2 = 0.01 * np.mean(course**2), np.mean(shifts**2)
    assert share == pytest.approx(np.sqrt(s2 / (s2 + b2)), rel=0.01)
    for one, before, shift in zip(shifts_apart(runs), runs, shifts):
        assert one.told.mean() == pytest.approx(share * shift)
        np.testing.assert_allclose(one.told - one.told.mean(), before.told - before.told.mean(), atol=1e-12)
    assert weights_of(shifts_apart(runs), 2, True)[1] > 0.9
    assert not weights_of(runs, 2, True).any()
    still = [
        part(np.column_stack((0.5 * z, z)), z + noise)
        for z, noise in zip(told * 0.0 + shifts[:, None], course)
    ]
    assert [one.told.mean() for one in shifts_apart(still)] == pytest.approx(shifts.tolist())


def test_what_a_member_adds_to_temperature_must_gain_on_both_of_two_runs():
    rng = np.random.default_rng(1)
    told = rng.normal(size=(2, 300))
    plain = told + 0.3 * rng.normal(size=told.shape)

    def weight_of(*sizes):
        other = told + np.array(sizes)[:, None] * rng.normal(size=told.shape)
        runs = [part(np.column_stack(columns), z) for *columns, z in zip(plain, other, told)]
        return weights_of(runs, 2, True, beside=[0])[1]

    assert weight_of(0.1, 0.1) > 0.8
    # Far better on one run by luck, a little worse on the other: on both together it would win.
    assert weight_of(0.02, 0.33) == 0.0


@pytest.mark.parametrize("kind", ["runs", "blocks"])
def test_a_member_that_ties_with_one_it_must_improve_on_gets_no_weight(kind):
    rng = np.random.default_rng(3)
    told = rng.normal(size=(10, 300))
    plain, same = told + 0.3 * rng.normal(size=told.shape), told + 0.3 * rng.normal(size=told.shape)
    better = told + 0.2 * rng.normal(size=told.shape)

    def weights(*members, beside):
        parts = [part(np.column_stack(columns), z, kind) for *columns, z in zip(*members, told)]
        return weights_of(parts, len(members), True, beside)

    tied = weights(plain, same, beside=[])
    assert tied == pytest.approx([0.5, 0.5], abs=0.1)
    assert weights(plain, same, beside=[0])[1] == 0.0
    found = weights(plain, same, better, beside=[0])
    assert found[1] == 0.0 and found[2] > found[0] > 0.0


def test_skill_of_few_runs_counts_beyond_its_standard_error():
    # The factor and its error are those of least squares through the origin with a run as one observation.
    rng = np.random.default_rng(2)
    p, own = rng.normal(size=(2, 3, 400))
    kept = []
    for size in (0.05, 0.5, 1.3, 1.5, 3.0):
        told = 0.8 * p + size * own
        k = np.sum(p * told) / np.sum(p * p)
        error = np.sqrt(np.mean((told - k * p) ** 2) / (3 * np.mean(p * p)))
        kept.append(k > error)
        found = skill_of([part(a[:, None], b) for a, b in zip(p, told)], np.ones(1))
        assert found == pytest.approx(k if kept[-1] else 0.0, abs=1e-9)
        # Blocks of one run are no observations of another.
        blocks = skill_of([part(a[:, None], b, "blocks") for a, b in zip(p, told)], np.ones(1))
        assert blocks == pytest.approx(min(k, 1.0))
    assert kept == [True, True, True, False, False]


def test_direction_is_told_by_a_run_both_ways_or_by_two_of_each():
    up, down = np.linspace(0.0, 50.0, 300), np.linspace(50.0, 0.0, 300)
    assert direction_is_told([np.concatenate([up, down])])
    assert direction_is_told([np.concatenate([up, down]), up])
    assert direction_is_told([up, down, up, down])
    for runs in ([up], [up, down], [up, up, down]):
        assert not direction_is_told(runs)


@pytest.mark.parametrize(
    ("count", "about"), [(1, 0.0), (2, 0.0), (3, 0.0), (9, 0.0), (30, 0.0), (2, 1.0), (2, 5.0), (3, 2.0)]
)
def test_intervals_of_runs_left_out_cover_another_run(count, about):
    # What is left is a shift of each run, and scatter about it: of K runs left out and one more, 9 of 10 are
    # covered.
    rng = np.random.default_rng(count)
    rows = 20
    table = TrainingTable(np.zeros((rows, 1)), rng.normal(size=rows), *[np.zeros(rows, dtype=int)] * 3, 100.0)
    covered, others = [], 16
    for _ in range(200):
        shifts = rng.normal(size=count + others)
        told = shifts[:, None] + about * rng.normal(size=(count + others, rows))
        lefts = [part(np.zeros((rows, 1)), left) for left in told[others:]]
        half = intervals_of(lefts, np.ones(1), table, True, np.ones((rows, 1))).half_width(0.9)
        covered.append(np.mean(np.abs(told[:others]) <= half))
    # Three standard errors of the trials; ranks of few runs are coarse, to the safe side.
    assert 0.9 - 0.04 <= np.mean(covered) <= 0.9 + 0.04 + 1.0 / (count + 1) * (count >= 9)


def test_what_a_direction_left_out_tells_counts_as_of_a_fit_to_both():
    # White noise, least squares: a direction foretells the other with ten times the noise and more. Intervals
    # of another run are those of the noise, times the shift that one run does not show.
    rng = np.random.default_rng(8)
    rows, noise, widths, left = 400, 0.02, [], []
    rising = np.arange(rows) < rows // 2
    T = np.interp(np.arange(rows), [0, 199, 399], [-1.0, 1.0, -1.0])
    rate = np.where(rising, 1.0, -1.0) + 0.05 * rng.normal(size=rows)
    design = np.column_stack([np.ones(rows), T, T**2, rate, T * rate])

    def fitted(fit, to, y):
        gain = np.linalg.pinv(design[fit])
        return design[to] @ gain @ y[fit], noise * np.sqrt(1.0 + np.sum((design[to] @ gain) ** 2, axis=1))

    halves = (np.flatnonzero(rising), np.flatnonzero(~rising))
    for _ in range(40):
        y = noise * rng.normal(size=rows)
        time_s = 100.0 * np.arange(rows)
        table = TrainingTable(design[:, 1:], y, np.zeros(rows, dtype=int), time_s, np.arange(rows), 100.0)
        parts = []
        for fit, held in (halves, halves[::-1]):
            predicted, errors = fitted(fit, held, y)
            parts.append(LeftOut("directions", predicted[:, None], y[held], errors[:, None], (fit, held)))
        errors = fitted(np.arange(rows), np.arange(rows), y)[1][:, None]
        widths.append(intervals_of(parts, np.ones(1), table, True, errors).half_width(0.9))
        left.append(y[held] - predicted)
    assert np.std(left) > 4.0 * noise
    assert np.mean(widths) == pytest.approx(2.0**0.5 * norm.ppf(0.95) * noise, rel=0.15)


@pytest.mark.parametrize("weights", [[0.5, 0.5], [0.2, 0.6], [1.0, 0.0]])
def test_a_model_weighed_with_itself_is_as_uncertain_as_that_model(weights):
    rng = np.random.default_rng(2)
    columns = rng.normal(size=(200, 2)) * [1.0, 30.0]
    one = LinearRegressor().fit(columns, 2.0 * columns[:, 0] + rng.normal(size=200))
    _, both = combined([(Features("T, dT"), one)] * 2, np.array(weights), 0.0)
    np.testing.assert_allclose(both.standard_errors(), sum(weights) * one.standard_errors())
    np.testing.assert_allclose(both.covariance_, sum(weights) ** 2 * one.covariance_)
