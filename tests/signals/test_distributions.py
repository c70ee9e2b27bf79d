"""Quantiles and tails are to the bit those of `scipy.stats`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fogml import intervals
from fogml.signals import distributions as own

RANDOM = np.random.default_rng(0)
PROBABILITY = np.concatenate([RANDOM.uniform(size=2000), 10.0 ** RANDOM.uniform(-12.0, 0.0, 1000)])
FREEDOM = np.concatenate([RANDOM.integers(1, 400, 2000), 10.0 ** RANDOM.uniform(-1.0, 5.0, 1000)])
SQUARES = FREEDOM * RANDOM.lognormal(size=3000)
VALUES = 5.0 * RANDOM.normal(size=3000)


@pytest.mark.parametrize(
    ("function", "theirs", "at"),
    [
        (own.chi2_ppf, stats.chi2.ppf, PROBABILITY),
        (own.chi2_isf, stats.chi2.isf, PROBABILITY),
        (own.chi2_sf, stats.chi2.sf, SQUARES),
        (own.chi2_cdf, stats.chi2.cdf, SQUARES),
        (own.student_ppf, stats.t.ppf, PROBABILITY),
        (own.student_sf, stats.t.sf, VALUES),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_values_are_those_of_scipy(function: Callable[..., Any], theirs: Any, at: Any) -> None:
    np.testing.assert_array_equal(function(at, FREEDOM), theirs(at, FREEDOM))


def test_of_a_normal_value_and_of_two_mean_squares() -> None:
    np.testing.assert_array_equal(own.normal_ppf(PROBABILITY), stats.norm.ppf(PROBABILITY))
    assert own.variances_sf(2.5, 3, 20) == stats.f.sf(2.5, 3, 20)
    assert own.variances_sf(2.5, 3, np.inf) == pytest.approx(stats.f.sf(2.5, 3, 1e9))
    assert own.variances_isf(0.05, 3, 20) == stats.f.isf(0.05, 3, 20)


def test_a_mixture_of_students() -> None:
    centres, scales, weights = (
        np.array([-1.0, 0.5, 3.0]),
        np.array([0.5, 1.0, 2.0]),
        np.array([0.2, 0.5, 0.3]),
    )
    for probability in (0.05, 0.5, 0.95):
        value = own.students_ppf(probability, weights, centres, scales, 7.0)
        assert weights @ stats.t.cdf((value - centres) / scales, 7.0) == pytest.approx(probability, abs=1e-9)
        # About one place the quantile lies between those of the most and the fewest degrees of freedom.
        freedom = np.array([1.0, 30.0, 100.0])
        value = own.students_ppf(probability, weights, np.zeros(3), np.ones(3), freedom)
        assert weights @ stats.t.cdf(value, freedom) == pytest.approx(probability, abs=1e-9)
    assert own.students_ppf(0.95, np.ones(1), np.zeros(1), np.ones(1), 7.0) == pytest.approx(
        stats.t.ppf(0.95, 7)
    )


def test_widths_of_intervals_are_those_of_the_normal_distribution():
    for width, share in ((intervals.Z50, 0.5), (intervals.Z90, 0.9), (intervals.Z95, 0.95)):
        assert width == pytest.approx(stats.norm.ppf(0.5 + share / 2.0), rel=1e-14)
    assert intervals.LEVEL == 0.9 and pytest.approx((0.05, 0.95)) == intervals.TAILS
    assert pytest.approx(intervals.Z50, rel=1e-4) == intervals.MEDIAN_SIZE
    assert pytest.approx(1.0, rel=1e-4) == intervals.MEDIAN_SIZE * intervals.SIGMA_PER_MEDIAN


def test_draws_move_with_the_covariance_and_not_with_its_last_digits():
    rng = np.random.default_rng(8)
    turned = np.linalg.qr(rng.standard_normal((6, 6)))[0]
    # Equal variances leave eigenvectors free to turn.
    covariance = turned @ np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 0.0]) @ turned.T
    units = np.array([1e-9, 1.0, 1e6, 1.0, 1e3, 1.0])
    covariance *= np.outer(units, units)
    root = own.root_of(covariance)
    np.testing.assert_allclose(
        (root @ root.T) / np.outer(units, units), covariance / np.outer(units, units), atol=1e-12
    )
    rounding = 1e-15 * rng.standard_normal((6, 6))
    other = own.root_of(covariance * (1.0 + rounding + rounding.T))
    np.testing.assert_allclose(other / units[:, None], root / units[:, None], atol=1e-6)
