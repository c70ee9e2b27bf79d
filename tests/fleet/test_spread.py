"""How far a fleet's units are spread: against closed forms, and where the noise of runs hides it."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.fleet.constants import UnitConstants, fleet_constants
from fogml.fleet.shares import discoveries, widening
from fogml.fleet.summary import fleet_json


def seen(constants: np.ndarray, error: float, rng: np.random.Generator) -> UnitConstants:
    """A unit whose constants its rows tell each with such an error."""
    width = len(constants)
    columns = np.eye(width) / error
    triangle = np.column_stack([columns, columns @ constants + rng.normal(size=width)])[None]
    told = (triangle, {"N": 1.0, "B": 0.0, "K": 0.0}, 0.0, 100, np.zeros(width - 1), np.ones(width - 1))
    return UnitConstants(f"T^1..{width - 1}", *told, {"T": [0.0, 1.0]})


@pytest.mark.parametrize("units", [6, 24])
def test_units_seen_exactly_tell_the_mean_of_the_variance(units: int) -> None:
    """All deviations alike beforehand: the variance's mean is the sum of squares over n - 3."""
    values = np.random.default_rng(units).normal(size=(units, 1))
    told = [(np.array([[1e8]]), 1e8 * value) for value in values]
    likeliest = np.array([[np.mean(values**2)]])
    (found,) = widening(told, np.zeros((units, 1)), likeliest, np.ones(units))
    # Deviations beyond ten times the one found, which six units all but rule out, are left out.
    assert found == pytest.approx(np.sqrt(units / (units - 3.0)), rel=0.02)


def test_a_spread_that_noise_hides_is_not_taken_for_none() -> None:
    """Intervals of a next unit's constant, drawn to a fleet whose own units are seen through noise."""
    rng = np.random.default_rng(4)
    held, plain = [], []
    for _ in range(40):
        units = [seen(constants, 1.0, rng) for constants in rng.normal(size=(10, 2))]
        prior = fleet_constants(units).prior
        truth = rng.normal(size=(40, 2))
        for covariance, shares in ((prior.of_a_next, held), (prior.covariance, plain)):
            half = 1.645 * np.sqrt(np.diag(covariance))
            shares.append(np.mean(np.abs(truth - prior.mean) < half))
    # Of 40 fleets whose shares differ by 0.13, three standard errors are 0.06.
    assert np.mean(held) == pytest.approx(0.9, abs=0.06)
    assert np.mean(plain) < np.mean(held) - 0.05


def test_few_fleets_name_an_odd_unit_where_there_is_none():
    """A fixed distance named one in two thirds of such fleets."""
    rng = np.random.default_rng(6)
    falsely, found = 0, 0
    for _ in range(30):
        constants = rng.normal(size=(24, 2))
        falsely += discoveries(
            fleet_constants([seen(one, 0.1, rng) for one in constants]).probabilities, 0.05
        ).any()
        constants[3, 1] = 6.0
        found += discoveries(fleet_constants([seen(one, 0.1, rng) for one in constants]).probabilities, 0.05)[
            3
        ]
    # Five per cent of 30 are 1.5, three standard deviations more are 5.
    assert falsely <= 5
    assert found >= 28


def test_a_trend_over_serial_numbers_is_as_steep_as_it_is():
    """A constant that grows by 0.1 a unit, told worse than units differ: drawn values grew by half of it."""
    rng = np.random.default_rng(8)
    slopes = []
    for _ in range(24):
        constants = rng.normal(size=(24, 2)) + np.outer(0.1 * np.arange(24), [1.0, 0.0])
        outcomes = [
            {
                "unit": f"F{place}",
                "axis": "x",
                "job": "train",
                "folder": f"F{place}",
                "status": "done",
                "found": {"constants": seen(one, 1.5, rng).as_dict()},
            }
            for place, one in enumerate(constants)
        ]
        slopes.append(fleet_json(outcomes, {})["constants"]["trends"][0]["per_unit"])
    # 24 slopes of a standard deviation of 0.053 each: 0.033 is three standard errors.
    assert np.mean(slopes) == pytest.approx(0.1, abs=0.033)
