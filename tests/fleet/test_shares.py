"""Shares of a line: against closed forms, other arithmetic and simulated lines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import beta

from fogml.fleet.shares import (
    apart,
    bayes_factor,
    discoveries,
    prevalence,
    probability_of_difference,
    share_interval,
)


def test_sure_units_are_counted_with_jeffreys_prior():
    told = prevalence([1e12] * 18 + [0.0] * 2)
    assert told.ci90 == pytest.approx(beta(18.5, 2.5).interval(0.9), abs=2e-3)
    assert told.mean == pytest.approx(beta(18.5, 2.5).mean(), abs=1e-3)
    assert told.over_half == pytest.approx(beta(18.5, 2.5).sf(0.5), abs=1e-3)
    # What is not sure makes the interval wider; what says nothing leaves the prior.
    assert np.ptp(prevalence([4.0] * 8 + [0.25] * 2).ci90) > np.ptp(prevalence([1e12] * 8 + [0.0] * 2).ci90)
    assert prevalence([1.0] * 9).ci90 == pytest.approx(beta(0.5, 0.5).interval(0.9), abs=2e-3)


def test_what_is_rare_among_all_is_common_on_a_line_that_shows_it_again_and_again():
    """A probability of 0.3 by a prior of 1 in 60 is evidence, if not of one unit alone."""
    assert prevalence([bayes_factor(0.3, 1.0 / 60.0)] * 40).ci90[0] > 0.9
    assert bayes_factor(0.3, 0.3) == pytest.approx(1.0)
    assert bayes_factor(0.0, 0.1) == 0.0 and bayes_factor(1.0, 0.1) > 1e12


def test_intervals_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(200):
        share = rng.beta(0.5, 0.5)
        has = rng.random(30) < share
        # Evidence of three deviations.
        low, high = prevalence(np.exp(3.0 * (rng.normal(size=30) + 3.0 * has) - 4.5)).ci90
        held += low <= share <= high
    assert 0.84 < held / 200 < 0.98


def test_lots_that_differ_are_told_and_equal_ones_are_not():
    few, many = [0.02] * 20, [40.0] * 20
    assert probability_of_difference([few, many]) > 0.999
    assert probability_of_difference([few, few]) < 0.3
    # What says nothing of units says nothing of lots.
    assert probability_of_difference([[1.0] * 20, [1.0] * 20]) == pytest.approx(0.5)


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


@pytest.mark.parametrize("units", [5, 12])
def test_the_share_of_a_gap_that_a_cause_makes_lies_within_its_interval(units: int):
    """Gaps that differ by e from unit to unit; resampling units held 73 and 81 %."""
    rng = np.random.default_rng(units)
    held = []
    for _ in range(500):
        gap = np.exp(rng.normal(size=units))
        low, high = share_interval(rng.beta(2, 3, size=units) * gap, gap)
        held.append(low <= 0.4 <= high)
    # Three standard errors are 0.04; it holds 86 to 88 %.
    assert np.mean(held) == pytest.approx(0.88, abs=0.05)


def test_what_one_unit_alone_has_may_be_nothing_of_the_line():
    low, high = share_interval([0.0, 0.9, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0])
    assert low == 0.0 and 0.25 < high < 1.0
    assert share_interval([0.5], [1.0]) == (0.0, 1.0)
    assert share_interval([0.0, 0.0], [1.0, 2.0]) == (0.0, 0.0)
    assert share_interval([0.3, 0.6], [1.0, 2.0]) == pytest.approx((0.3, 0.3))
