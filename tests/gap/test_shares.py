"""Shares of the gap's energy against Shapley's value from all orders."""

from itertools import permutations

import numpy as np
import pytest

from fogml.gap.shares import shapley_values


def test_values_are_what_each_cause_adds_on_average_over_all_orders():
    rng = np.random.default_rng(3)
    gap, courses = rng.standard_normal(30), rng.standard_normal((30, 3))

    def taken(causes):
        return float(gap @ gap - np.sum((gap - courses[:, list(causes)].sum(axis=1)) ** 2))

    expected = np.zeros(3)
    for order in permutations(range(3)):
        for place, cause in enumerate(order):
            expected[cause] += (taken(order[: place + 1]) - taken(order[:place])) / 6.0
    values = shapley_values(gap, courses).sum(axis=0)
    assert values == pytest.approx(expected, rel=1e-12)
    assert values.sum() == pytest.approx(taken((0, 1, 2)))
