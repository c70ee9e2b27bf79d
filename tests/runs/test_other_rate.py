"""Columns of another rate, and what is said of a clock's ends."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.runs.other_rate import clock_ends


@pytest.mark.parametrize("times", [[1.0, 2.0, 4.0], [np.nan, 4.0, 1.0, 2.0, np.nan], [4.0, np.inf, 1.0]])
def test_a_clock_ends_where_its_sound_times_do(times):
    assert clock_ends(np.array(times)) == (1.0, 4.0)


def test_of_no_sound_time_there_is_no_end():
    assert np.isnan(clock_ends(np.full(3, np.nan))).all() and np.isnan(clock_ends(np.empty(0))).all()
