"""What is drawn: extremes stay, gaps stay open, and nothing grows beyond its bound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fogml.signals.drawn import drawn, gap_starts, min_max_indices

VALUES = arrays(np.float64, st.integers(1, 3000), elements=st.floats(-1e6, 1e6))


@given(VALUES, st.integers(4, 400))
@settings(max_examples=80, deadline=None)
def test_extremes_and_ends_stay_within_the_bound(values: np.ndarray, points: int) -> None:
    kept = min_max_indices(values, points)
    assert len(kept) <= max(points, 1) or len(values) <= points
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0 and kept[-1] == len(values) - 1
    assert values[kept].min() == values.min()
    assert values[kept].max() == values.max()


def test_a_single_spike_in_a_million_is_drawn() -> None:
    values = np.zeros(1_000_000)
    values[712_345] = 1.0
    assert values[min_max_indices(values)].max() == 1.0
    assert len(min_max_indices(values)) <= 4000


def test_missing_values_are_passed_over() -> None:
    values = np.linspace(0.0, 1.0, 10_000)
    values[::3] = np.nan
    values[5_000] = 7.0
    assert np.nanmax(values[min_max_indices(values, 100)]) == 7.0


def test_every_gap_lifts_the_pen_once() -> None:
    time = np.concatenate([np.arange(0.0, 100.0), np.arange(500.0, 600.0), np.arange(900.0, 950.0)])
    x, y = drawn(time, np.ones(len(time)))
    holes = np.flatnonzero(np.isnan(y))
    assert len(holes) == 2
    assert np.all((x[holes] > [99.0, 599.0]) & (x[holes] < [500.0, 900.0]))
    assert np.array_equal(x[~np.isnan(y)], time)


def test_gaps_are_found_after_reduction_too() -> None:
    time = np.arange(100_000.0)
    time[50_000:] += 5_000.0
    x, y = drawn(time, np.sin(time / 1e4))
    assert np.isnan(y).sum() == 1
    assert 49_999.0 < x[np.isnan(y)][0] < 55_000.0


def test_many_gaps_do_not_grow_the_drawing() -> None:
    time = np.cumsum(np.where(np.arange(200_000) % 5 == 0, 100.0, 1.0))
    x, y = drawn(time, np.ones(len(time)), points=1000)
    assert len(x) <= 2000 and len(x) == len(y)


@pytest.mark.parametrize("time", [[], [3.0], [1.0, 2.0]])
def test_short_series_have_no_gap(time: list[float]) -> None:
    assert gap_starts(time).size == 0
