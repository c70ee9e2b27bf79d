"""The trend of a unit's level, against lines and noise written by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import linregress
from scipy.stats import t as student

from fogml.monitor.trend import trend_interval

AGE = 30.0 * np.arange(14.0)


@pytest.mark.parametrize(("white", "walk"), [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
def test_a_walk_between_runs_is_no_trend(white: float, walk: float) -> None:
    held, wide = [], []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        noise = white * rng.standard_normal(14) + walk * np.cumsum(rng.standard_normal(14))
        middle, (low, high) = trend_interval(AGE, 0.002 * AGE + noise)
        assert low < middle < high
        held.append(low <= 0.002 <= high)
        wide.append(high - low)
    # A line for white noise holds four in ten of a walk's, an average over noises 77 and 72 %, a likelihood
    # that is judged as under noise that is known 82 % of a walk alone.
    assert np.mean(held) > 0.83
    # Least squares for white noise has a width of 3.56 * 0.066 / 14 runs = 0.008: it is told with some loss.
    assert 0.008 * white <= np.median(wide) < (0.03 if not walk else 0.06)


def test_of_a_bias_known_not_to_wander_it_is_the_line_of_least_squares() -> None:
    level = np.random.default_rng(3).standard_normal(14)
    slope, (low, high) = trend_interval(AGE, level, wanders=False)
    line = linregress(AGE, level)
    reach = student.ppf(0.95, 12) * line.stderr
    np.testing.assert_allclose([slope, low, high], line.slope + reach * np.array([0, -1, 1]), rtol=1e-9)


def test_a_plain_trend_is_found_whatever_the_unit() -> None:
    rng = np.random.default_rng(1)
    level = 5.0 + 0.02 * AGE + 0.1 * rng.standard_normal(14)
    slope, (low, high) = trend_interval(AGE, level)
    assert low < 0.02 < high and slope == pytest.approx(0.02, rel=0.1)
    other, ends = trend_interval(AGE / 365.0, 1e3 * level)
    np.testing.assert_allclose([other, *ends], [365e3 * slope, 365e3 * low, 365e3 * high], rtol=1e-6)


def test_levels_without_noise() -> None:
    assert trend_interval(AGE, np.full(14, 3.0))[0] == pytest.approx(0.0)
