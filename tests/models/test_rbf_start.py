"""What tuning starts from: averaged rows, centres, the share of independent rows."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.rbf.blocks import average_in_blocks
from fogml.models.rbf.centres import kmeans_centres, ols_centres, orthogonal_least_squares
from fogml.models.rbf.search import independent_share


def test_blocks_are_means_of_neighbours_and_do_not_cross_runs() -> None:
    first, second = np.linspace(0.0, 1.0, 1003), np.linspace(5.0, 6.0, 998)
    values = np.concatenate([first, second])
    label = np.repeat([0, 1], [len(first), len(second)])
    found = average_in_blocks(values[:, None], 2.0 * values, 200, groups=label)
    assert found.in_time and 180 <= len(found.target) <= 202
    np.testing.assert_allclose(found.target, 2.0 * found.inputs[:, 0])
    assert not np.any((found.inputs > 1.0) & (found.inputs < 5.0))
    assert found.inputs[0, 0] == pytest.approx(first[:11].mean())


def test_blocks_are_of_time_where_times_are_given() -> None:
    time = np.concatenate([np.arange(1000.0), 50_000.0 + np.arange(1000.0)])
    values = time / 1000.0
    found = average_in_blocks(values[:, None], values, 100, time=time)
    assert found.in_time
    assert not np.any((found.target > 1.0) & (found.target < 50.0))


def test_few_rows_stay_as_they_are() -> None:
    rows = np.random.default_rng(0).normal(size=(50, 2))
    found = average_in_blocks(rows, rows[:, 0], 50)
    np.testing.assert_array_equal(found.inputs, rows)
    assert found.per_row == 1.0


def test_rows_out_of_order_are_averaged_with_those_near_in_the_inputs() -> None:
    draw = np.random.default_rng(1)
    rows = draw.uniform(-1.0, 1.0, size=(20_000, 2))
    truth = np.sin(3.0 * rows[:, 0]) + rows[:, 1]
    found = average_in_blocks(rows, truth, 500)
    assert not found.in_time
    assert found.per_row == pytest.approx(len(rows) / len(found.target))
    # Averages in order of rows would all lie near the middle.
    assert np.ptp(found.inputs[:, 0]) > 1.8
    expected = np.sin(3.0 * found.inputs[:, 0]) + found.inputs[:, 1]
    np.testing.assert_allclose(found.target, expected, atol=0.02)


def test_blocks_of_a_long_run_are_averaged_with_those_near_in_the_inputs() -> None:
    # 97 rows to a period: a hundred rows in a block average it out, six of them keep it.
    draw = np.random.default_rng(2)
    rows = np.sin(2.0 * np.pi * np.arange(50_000)[:, None] / 97.0)
    target = rows[:, 0] ** 2 + 0.1 * draw.standard_normal(len(rows))
    found = average_in_blocks(rows, target, 500)
    assert not found.in_time
    assert found.per_row == pytest.approx(len(rows) / len(found.target))
    assert np.ptp(found.inputs) > 1.95
    # Blocks, not rows, are what is near: of each no more than the curvature within is lost.
    np.testing.assert_allclose(found.target.mean(), target.mean(), atol=2e-3)
    np.testing.assert_allclose(found.target, found.inputs[:, 0] ** 2, atol=0.05)


@pytest.mark.parametrize("name", ["groups", "time"])
def test_labels_of_another_length_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=name):
        average_in_blocks(np.zeros((5, 1)), np.zeros(5), 10, **{name: np.zeros(4)})


def test_kmeans_gives_the_distinct_rows_where_there_are_few_and_repeats_itself() -> None:
    rows = np.repeat(np.arange(4.0), 25)[:, None]
    np.testing.assert_array_equal(kmeans_centres(rows, 8, 0), [[0.0], [1.0], [2.0], [3.0]])
    cloud = np.random.default_rng(2).normal(size=(3000, 3))
    np.testing.assert_array_equal(kmeans_centres(cloud, 16, 5), kmeans_centres(cloud, 16, 5))


def greedy(columns: np.ndarray, target: np.ndarray, count: int) -> list[int]:
    """The greedy choice by trying every column with a fit of its own."""
    chosen: list[int] = []
    for _ in range(count):
        left = {}
        for i in set(range(columns.shape[1])) - set(chosen):
            part = columns[:, [*chosen, i]]
            fit = part @ np.linalg.lstsq(part, target, rcond=None)[0]
            left[i] = float(np.sum((target - fit) ** 2))
        chosen.append(min(left, key=lambda i: left[i]))
    return chosen


def test_orthogonal_least_squares_is_the_greedy_choice() -> None:
    draw = np.random.default_rng(3)
    columns, target = draw.normal(size=(80, 15)), draw.normal(size=80)
    gram = columns.T @ columns
    found = orthogonal_least_squares(lambda i: gram[i].copy(), np.diag(gram), columns.T @ target, 6)
    assert found.tolist() == greedy(columns, target, 6)


def test_orthogonal_least_squares_leaves_out_what_depends_on_the_chosen() -> None:
    draw = np.random.default_rng(4)
    three = draw.normal(size=(50, 3))
    columns = np.hstack([three, three @ draw.normal(size=(3, 4)), np.zeros((50, 1))])
    gram = columns.T @ columns
    target = draw.normal(size=50)
    found = orthogonal_least_squares(lambda i: gram[i].copy(), np.diag(gram), columns.T @ target, 6, forced=1)
    assert found[0] == 0 and len(found) == 3


def test_ols_centres_lie_where_the_target_bends() -> None:
    rows = np.linspace(-3.0, 3.0, 400)[:, None]
    target = 0.5 * rows[:, 0] + np.exp(-(((rows[:, 0] - 1.0) / 0.3) ** 2))
    linear = np.column_stack([rows, np.ones(len(rows))])
    (first,) = ols_centres(rows, linear, target, np.array([0.3]), 1)
    assert first[0] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_share_of_independent_rows_is_that_of_the_process(memory: float) -> None:
    steps = np.random.default_rng(5).normal(size=40_000)
    noise = np.zeros_like(steps)
    for i in range(1, len(steps)):
        noise[i] = memory * noise[i - 1] + steps[i]
    for level in (0.0, 3.0):
        found = independent_share(noise + level)
        assert found == pytest.approx((1.0 - memory) / (1.0 + memory), rel=0.15)


def test_share_of_nothing_is_one() -> None:
    assert independent_share(np.zeros(10)) == 1.0
