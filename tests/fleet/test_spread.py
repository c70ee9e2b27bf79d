"""How far a fleet's units are spread: against closed forms, and where the noise of runs hides it."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.fleet.constants import UnitConstants, fleet_constants
from fogml.fleet.spread import widening


@pytest.mark.parametrize("units", [6, 24])
def test_units_seen_exactly_tell_the_mean_of_the_variance(units: int) -> None:
    """All deviations alike beforehand: the variance's mean is the sum of squares over n - 3."""
    values = np.random.default_rng(units).normal(size=(units, 1))
    seen = [(np.array([[1e8]]), 1e8 * value) for value in values]
    likeliest = np.array([[np.mean(values**2)]])
    (found,) = widening(seen, np.zeros((units, 1)), likeliest, np.ones(units))
    # Deviations beyond ten times the one found, which six units all but rule out, are left out.
    assert found == pytest.approx(np.sqrt(units / (units - 3.0)), rel=0.02)


def test_a_spread_that_noise_hides_is_not_taken_for_none() -> None:
    """Intervals of a next unit's constant, drawn to a fleet whose own units are seen through noise."""
    rng = np.random.default_rng(4)
    held, plain = [], []
    for _ in range(60):
        units = []
        for constants in rng.normal(size=(10, 2)):
            triangle = np.column_stack([np.eye(2), constants + rng.normal(size=2)])[None]
            told = (triangle, {"N": 1.0, "B": 0.0, "K": 0.0}, 0.0, 100, np.zeros(1), np.ones(1))
            units.append(UnitConstants("T", *told, {"T": [0.0, 1.0]}))
        prior = fleet_constants(units).prior
        truth = rng.normal(size=(40, 2))
        for covariance, shares in ((prior.of_a_next, held), (prior.covariance, plain)):
            half = 1.645 * np.sqrt(np.diag(covariance))
            shares.append(np.mean(np.abs(truth - prior.mean) < half))
    # Of 60 fleets whose shares differ by 0.15, three standard errors are 0.06.
    assert np.mean(held) == pytest.approx(0.9, abs=0.06)
    assert np.mean(plain) < np.mean(held) - 0.05
