"""Mean and deviation between units: against simulated lines and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from fogml.signals.restricted import next_value, random_effects


def test_they_are_the_line_s():
    rng = np.random.default_rng(1)
    found = []
    for _ in range(60):
        se = rng.uniform(0.5, 2.0, size=25)
        found.append(random_effects(5.0 + 1.0 * rng.normal(size=25) + se * rng.normal(size=25), se))
    means, errors = np.array([f.mean for f in found]), np.array([f.se for f in found])
    assert np.mean(means) == pytest.approx(5.0, abs=0.15)
    assert np.std(means) == pytest.approx(np.mean(errors), rel=0.3)
    assert np.sqrt(np.mean([f.between**2 for f in found])) == pytest.approx(1.0, abs=0.15)
    # With no error of their own: mean and deviation.
    x = rng.normal(size=9)
    plain = random_effects(x, np.zeros(9))
    assert (plain.mean, plain.between) == pytest.approx((x.mean(), x.std(ddof=1)))
    assert random_effects([2.0, 2.0], [0.0, 0.0]).mean == 2.0


def test_with_equal_errors_it_is_the_plain_mean_and_what_the_variance_has_above_them():
    values, errors = np.array([1.0, 1.6, 2.2, 1.2]), np.full(4, 0.2)
    held = random_effects(values, errors)
    assert held.mean == pytest.approx(values.mean())
    assert held.between**2 == pytest.approx(values.var(ddof=1) - 0.04, rel=1e-4)
    assert held.se == pytest.approx(np.sqrt(values.var(ddof=1) / 4.0), rel=1e-4)
    # Units that agree better than their errors have no spread of their own.
    assert random_effects([1.0, 1.01], [0.2, 0.2]).between == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("between", [0.2, 0.4, 1.0])
@pytest.mark.parametrize("count", [2, 6])
def test_the_next_unit_lies_where_it_is_said_to(count: int, between: float):
    """Of six units that differ as their errors do 80 % did where the likeliest deviation alone counts."""
    rng = np.random.default_rng(4)
    inside = 0
    for _ in range(400):
        units = 3.0 + between * rng.normal(size=count + 1)
        errors = rng.uniform(0.1, 0.4, count)
        low, high = next_value(units[:-1] + errors * rng.normal(size=count), errors)
        inside += low <= units[-1] <= high
    assert 0.85 < inside / 400 < 0.985


def test_the_next_unit_of_values_without_errors_is_as_one_of_a_normal_distribution():
    x = np.array([1.0, 2.0, 4.0])
    reach = stats.t.ppf(0.95, 2) * x.std(ddof=1) * np.sqrt(1.0 + 1.0 / 3.0)
    assert next_value(x, np.zeros(3)) == pytest.approx((x.mean() - reach, x.mean() + reach))
    # Nearly so of small errors and many values.
    x = np.random.default_rng(1).normal(size=400)
    reach = stats.t.ppf(0.95, 399) * x.std(ddof=1) * np.sqrt(1.0 + 1.0 / 400.0)
    assert next_value(x, np.full(400, 1e-3)) == pytest.approx((x.mean() - reach, x.mean() + reach), rel=0.02)


@pytest.mark.parametrize("count", [3, 10])
def test_the_mean_of_few_units_lies_within_its_interval(count: int):
    """As units differ: by 1.645 standard errors 74 % of three units' means did."""
    rng = np.random.default_rng(count)
    held = []
    for _ in range(400):
        errors = rng.uniform(0.3, 1.0, size=count)
        low, high = random_effects(
            rng.normal(size=count) + errors * rng.normal(size=count), errors
        ).interval()
        held.append(low <= 0.0 <= high)
    # Three standard errors of 400 are 0.045.
    assert np.mean(held) == pytest.approx(0.92, abs=0.05)


def test_one_unit_s_interval_is_that_of_its_error():
    assert random_effects([1.0], [0.2]).interval() == pytest.approx((1.0 - 0.32897, 1.0 + 0.32897), abs=1e-5)
