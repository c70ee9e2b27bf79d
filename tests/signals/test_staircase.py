"""The course behind a record in whole steps, against the one that was rounded."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.signals.smoothing import course_through_steps

ROUNDED = 1.0 / np.sqrt(12.0)
"""Rms of what rounding hides of a moving quantity, in steps."""


def cycle(time: np.ndarray) -> np.ndarray:
    """A thermal cycle [degC]: ramps of 1 degC/min at most, turning points, and a slow end."""
    return 20.0 + 30.0 * np.sin(2.0 * np.pi * time / 11_000.0) * np.exp(-time / 20_000.0)


def missed(time: np.ndarray, true: np.ndarray, step: float) -> float:
    """Rms error of the course, in steps."""
    rounded = step * np.rint(true / step)
    return float(np.sqrt(np.mean((course_through_steps(time, rounded, step) - true) ** 2))) / step


@pytest.mark.parametrize(("step", "share"), [(0.02, 0.45), (0.0625, 0.3), (0.5, 0.15)])
def test_most_of_what_steps_hide_is_found(step: float, share: float) -> None:
    """Several steps a sample, about one, and many samples a step."""
    time = np.arange(0.0, 30_000.0, 10.0)
    assert missed(time, cycle(time), step) < share * ROUNDED


def test_turning_points_are_no_flat_stairs() -> None:
    """Straight lines from edge to edge cut a turning point off at its last edge."""
    time = np.arange(0.0, 8000.0, 10.0)
    top = np.abs(time - 2000.0) < 700.0
    left, cut = [], []
    for height in np.linspace(2.0, 2.5, 11):
        true = 20.0 + height * np.sin(np.pi * time / 4000.0)
        rounded = 0.5 * np.rint(true / 0.5)
        edges = np.flatnonzero(np.diff(rounded))
        straight = np.interp(time, time[edges] + 5.0, 0.5 * (rounded[edges] + rounded[edges + 1]))
        left.append((course_through_steps(time, rounded, 0.5) - true)[top])
        cut.append((straight - true)[top])
    assert np.std(left) < 0.6 * np.std(cut)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.integers(-3, 3), min_size=1, max_size=120),
    st.floats(1e-3, 10.0),
    st.floats(0.1, 100.0),
    st.floats(-50.0, 50.0),
)
def test_no_reading_is_left_by_more_than_half_a_step(
    moves: list[int], step: float, interval: float, level: float
) -> None:
    values = level + step * np.cumsum(moves)
    time = interval * np.arange(len(values))
    found = course_through_steps(time, values, step)
    assert np.abs(found - values).max() <= 0.5 * step * (1.0 + 1e-6) + 1e-9


def test_a_record_that_stands_still_is_its_own_course() -> None:
    assert course_through_steps(np.arange(500.0), np.full(500, 21.5), 0.5) == pytest.approx(21.5)


def test_parts_between_gaps_know_nothing_of_each_other() -> None:
    time = np.arange(0.0, 6000.0, 10.0)
    rounded = 0.25 * np.rint(cycle(time) / 0.25)
    apart = np.concatenate([time, time + 50_000.0])
    whole = course_through_steps(apart, np.concatenate([rounded, -rounded]), 0.25)
    alone = course_through_steps(time, rounded, 0.25)
    assert whole == pytest.approx(np.concatenate([alone, -alone]), abs=1e-9)


def test_quick_samples_say_what_slow_ones_do() -> None:
    quick, slow = np.arange(0.0, 12_000.0), np.arange(5.0, 12_000.0, 10.0)
    found = [course_through_steps(t, 0.5 * np.rint(cycle(t) / 0.5), 0.5) for t in (quick, slow)]
    late = slow < 11_900.0
    assert np.interp(slow[late], quick, found[0]) == pytest.approx(found[1][late], abs=0.1)
    assert np.std(found[0] - cycle(quick)) < 0.2 * 0.5 * ROUNDED


def test_a_record_read_backwards_has_the_same_course() -> None:
    time = np.append(0.0, 25.0 + 10.0 * np.arange(11.0))
    values = 0.5 * np.array([0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    backwards = course_through_steps(time[-1] - time[::-1], values[::-1], 0.5)
    # Whose rounding libraries for linear algebra do differently.
    assert backwards[::-1] == pytest.approx(course_through_steps(time, values, 0.5), abs=1e-7)
