"""Sizes by run: whether they agree, and whether they grow."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.gap.causes import _step, agree, growth
from fogml.gap.result import RunAmplitude
from fogml.gap.settings import STANDARD
from fogml.runs.steps import to_steps


def _sizes(*values, se=0.1):
    return tuple(RunAmplitude(f"r{i}", value, se) for i, value in enumerate(values))


def _scene(days):
    runs = [SimpleNamespace(run=SimpleNamespace(name=f"r{i}")) for i in range(len(days))]
    return SimpleNamespace(runs=runs, begun_s=tuple(86400.0 * d for d in days), order_known=True)


def test_sizes_disagree_from_the_chance_that_is_stated_on():
    apart = np.sqrt(2.0 * chi2.isf(STANDARD.reported.disagree, 1)) * 0.1
    assert agree(_sizes(1.0, 1.0 + 0.99 * apart))
    assert not agree(_sizes(1.0, 1.0 + 1.01 * apart))
    assert agree(_sizes(1.0))


def test_growth_is_the_slope_of_least_squares():
    days, values = [0.0, 10.0, 20.0, 40.0], [1.0, 1.5, 2.1, 2.9]
    expected = np.polyfit(days, values, 1)[0]
    assert growth(_scene(days), _sizes(*values)) == pytest.approx(expected)


def test_a_slope_within_its_error_is_no_growth():
    error = 0.1 / np.sqrt(2.0) / 5.0  # of the slope of two sizes ten days apart
    least = STANDARD.reported.grows * 10.0 * error
    assert growth(_scene([0.0, 10.0]), _sizes(1.0, 1.0 + 0.99 * least)) is None
    assert growth(_scene([0.0, 10.0]), _sizes(1.0, 1.0 + 1.01 * least)) is not None


def test_a_step_of_the_sensors_is_read_off_their_records():
    run = SimpleNamespace(temperature_columns=("T_in", "T_out"), columns={})
    course = 20.0 + 5.0 * np.sin(np.linspace(0.0, 6.0, 500))
    run.columns = {"T_in": to_steps(course, 0.0361), "T_out": to_steps(course, 0.01)}
    step, se = _step([SimpleNamespace(run=run)], 0.001, 0.002)
    assert step == pytest.approx(0.0361, abs=3.0 * se) and se < 0.01 * step
    # A record that shows none leaves what was fitted.
    run.columns = {"T_in": course, "T_out": course}
    assert _step([SimpleNamespace(run=run)], 0.001, 0.002) == (0.001, 0.002)
