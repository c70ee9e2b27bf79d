"""The sine of many angles against the one of the mathematical library."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fogml.signals.bases import sine


@given(st.lists(st.floats(-1e6, 1e6), max_size=40))
def test_sine_is_that_of_the_mathematical_library(turns):
    expected = [math.sin(2.0 * math.pi * math.remainder(t, 1.0)) for t in turns]
    np.testing.assert_allclose(sine(turns), expected, rtol=0.0, atol=5e-16)


def test_sine_of_eighths_of_a_turn_and_of_what_is_no_number():
    root = math.sqrt(0.5)
    wanted = np.tile([0.0, root, 1.0, root, 0.0, -root, -1.0, -root], 3)
    got = sine(np.arange(-8, 16).reshape(4, 6) / 8.0)
    np.testing.assert_allclose(got.ravel(), wanted, atol=3e-16)
    assert np.isnan(sine([math.nan, math.inf, -math.inf])).all()
    assert sine(0.25) == pytest.approx(1.0, abs=3e-16)
