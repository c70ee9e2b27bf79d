"""Weights are asked of runs left out, and intervals from them cover another run."""

import numpy as np
import pytest

from fogml.models.combination import LeftOut
from fogml.models.table import TrainingTable
from fogml.models.weights import intervals_of, weights_of


def part(predicted, told, kind="runs"):
    return LeftOut(kind, predicted, told, np.zeros(len(told)))


def test_of_several_runs_what_is_told_within_a_run_has_no_say():
    rng = np.random.default_rng(0)
    z = rng.normal(size=(3, 50))
    runs = [part(np.column_stack([0.99 * told, -told]), told) for told in z]
    blocks = [part(np.column_stack([-told, 0.99 * told]), told, "blocks") for told in z]
    np.testing.assert_allclose(weights_of([*runs, *blocks], 2, True), [1.0, 0.0], atol=0.03)
    np.testing.assert_allclose(weights_of(blocks, 2, True), [0.0, 1.0], atol=0.03)


@pytest.mark.parametrize(
    ("count", "about"), [(1, 0.0), (2, 0.0), (3, 0.0), (9, 0.0), (30, 0.0), (2, 1.0), (2, 5.0), (3, 2.0)]
)
def test_intervals_of_runs_left_out_cover_another_run(count, about):
    # What is left is a shift of each run, and scatter about it: of K runs left out and one more, 9 of 10 are
    # covered.
    rng = np.random.default_rng(count)
    rows = 20
    table = TrainingTable(np.zeros((rows, 1)), rng.normal(size=rows), *[np.zeros(rows, dtype=int)] * 3, 100.0)
    covered = []
    for _ in range(800):
        shifts = rng.normal(size=count + 1)
        told = shifts[:, None] + about * rng.normal(size=(count + 1, rows))
        lefts = [part(np.zeros((rows, 1)), left) for left in told[1:]]
        half = intervals_of(lefts, np.ones(1), table, True).half_width(0.9)
        covered.append(np.mean(np.abs(told[0]) <= half))
    # Three standard errors of 800 trials; ranks of few runs are coarse, to the safe side.
    assert 0.9 - 0.032 <= np.mean(covered) <= 0.9 + 0.032 + 1.0 / (count + 1) * (count >= 9)
