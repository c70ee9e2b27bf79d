"""Shares of a line: against closed forms, other arithmetic and simulated lines."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import beta, binom

from fogml.fleet.shares import (
    apart,
    count_distribution,
    discoveries,
    prevalence,
    probability_of_difference,
)

PROBABILITIES = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6)


@given(PROBABILITIES)
def test_counts_are_those_of_all_arrangements(p):
    expected = np.zeros(len(p) + 1)
    for held in product((0, 1), repeat=len(p)):
        expected[sum(held)] += np.prod([a if h else 1.0 - a for a, h in zip(p, held, strict=True)])
    np.testing.assert_allclose(count_distribution(p), expected, atol=1e-12)


def test_equal_probabilities_are_binomial_and_sure_ones_jeffreys():
    np.testing.assert_allclose(count_distribution([0.3] * 40), binom.pmf(np.arange(41), 40, 0.3), atol=1e-12)
    told = prevalence([1.0] * 18 + [0.0] * 2)
    assert told.ci90 == pytest.approx(beta(18.5, 2.5).interval(0.9), abs=1e-9)
    assert told.over_half == pytest.approx(beta(18.5, 2.5).sf(0.5))
    # What is not sure makes the interval wider.
    unsure = prevalence([0.8] * 10)
    assert np.ptp(unsure.ci90) > np.ptp(prevalence([1.0] * 8 + [0.0] * 2).ci90)


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(200):
        share = rng.beta(0.5, 0.5)
        has = rng.random(30) < share
        # Evidence of three deviations, turned to a probability with the line's share as prior odds.
        ratio = np.exp(3.0 * (rng.normal(size=30) + 3.0 * has) - 4.5)
        p = share * ratio / (share * ratio + 1.0 - share)
        low, high = prevalence(p).ci90
        held += low <= share <= high
    assert 0.84 < held / 200 < 0.98


def test_lots_that_differ_are_told_and_equal_ones_are_not():
    few, many = [0.02] * 20, [0.97] * 20
    assert probability_of_difference([few, many]) > 0.999
    assert probability_of_difference([few, few]) < 0.3
    # What says nothing of units says nothing of lots.
    assert probability_of_difference([[0.5] * 20, [0.5] * 20]) == pytest.approx(0.5)


def test_units_that_stand_apart_are_told_and_few_others():
    rng = np.random.default_rng(2)
    false, true = [], 0
    for _ in range(12):
        se = np.full(30, 0.5)
        x = 5.0 + rng.normal(size=30) + se * rng.normal(size=30)
        x[7] += 9.0
        told = np.flatnonzero(discoveries(apart(x, se), 0.05))
        true += 7 in told
        false.append(np.mean(told != 7) if len(told) else 0.0)
    assert true == 12
    assert np.mean(false) <= 0.1
    assert np.all(apart([1.0, 2.0, 90.0], [0.1] * 3) == 1.0)
    assert not discoveries([], 0.05).size
