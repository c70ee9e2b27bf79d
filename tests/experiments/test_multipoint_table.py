"""The multi-point table has the stated shape with the twin as the world."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from experiments.multipoint_table.__main__ import RUNS, STATED, page, table


@pytest.fixture(scope="module")
def rows():
    return table()


def test_order_in_sample(rows):
    """The order of the stated table: none, M1, M2, M3, 4 points; M4 about as poor as M1."""
    std = {label: row["std"]["in sample"] for label, row in rows.items()}
    order = ("none", "M1", "M2", "M3", "4 points 2/1", "4 points 5/3")
    assert [std[label] for label in order] == sorted((std[label] for label in order), reverse=True)
    for label, stated in STATED.items():
        assert std[label] == pytest.approx(stated[0], rel=0.25), label
    # Down to the noise of 0.047 deg/h.
    assert std["4 points 5/3"] < 1.08 * 0.047


def test_high_orders_lose_elsewhere(rows):
    five, two = rows["4 points 5/3"]["std"], rows["4 points 2/1"]["std"]
    assert five["repeat"] < 1.12 * five["in sample"]
    assert five["2 degC/min"] > 3.0 * five["in sample"]
    assert five["reversed order"] > 1.1 * five["in sample"]
    for name in RUNS:
        assert two[name] < 1.25 * 0.047, name
    for label in ("M1", "M2", "M3"):
        std = rows[label]["std"]
        assert std["2 degC/min"] > 1.3 * std["in sample"], label


def test_coefficients_are_the_papers(rows):
    found = {label: row["coefficients"] for label, row in rows.items()}
    assert found == {
        "none": 0,
        "M1": 6,
        "M2": 9,
        "M3": 12,
        "M4": 9,
        "4 points 5/3": 33,
        "4 points 2/1": 13,
    }
    assert "| 4 points 5/3 | 33 |" in page(rows)
