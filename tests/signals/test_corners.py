"""Corners of a course: lines through them stay near it, and of straight pieces they are the ends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.signals.bases import corners

ENDS = np.array([0, 40, 90, 150, 200, 260])
VALUES = np.array([20.0, 20.0, -30.0, -30.0, 60.0, 20.0])
TIME = 10.0 * np.arange(261)


def test_straight_pieces_end_at_their_corners():
    course = np.interp(TIME, TIME[ENDS], VALUES)
    assert corners(TIME, course, 1e-9) == ENDS.tolist()


@given(within=st.floats(0.05, 20.0), seed=st.integers(0, 20))
@settings(max_examples=40, deadline=None)
def test_no_sample_is_farther_off_than_asked(within, seed):
    course = np.interp(TIME, TIME[ENDS], VALUES) + 0.3 * np.random.default_rng(seed).standard_normal(261)
    found = corners(TIME, course, within)
    assert np.abs(course - np.interp(TIME, TIME[found], course[found])).max() <= within
    assert found[0] == 0 and found[-1] == 260


@pytest.mark.parametrize("count", [1, 2])
def test_two_samples_are_corners(count):
    assert corners(TIME[:count], TIME[:count], 1.0) == list(range(count))
