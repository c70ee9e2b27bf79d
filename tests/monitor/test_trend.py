"""The trend of a unit's level, against lines and noise written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.monitor.watch import trend_quantiles

AGE = 30.0 * np.arange(14.0)


@pytest.mark.parametrize("walk", [0.0, 1.0])
def test_a_walk_between_runs_is_no_trend(walk: float) -> None:
    held, wide = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        level = 0.002 * AGE + rng.standard_normal(14) + walk * np.cumsum(rng.standard_normal(14))
        low, middle, high = trend_quantiles(AGE, level, (0.05, 0.5, 0.95))
        assert low < middle < high
        held.append(low <= 0.002 <= high)
        wide.append(high - low)
    # A line for white noise holds four in ten of a walk's.
    assert np.mean(held) > 0.7
    # Least squares for white noise has a half-width of 1.78 * 0.066 / 14 runs = 0.004.
    assert np.median(wide) > 0.008


def test_a_plain_trend_is_found_whatever_the_unit() -> None:
    rng = np.random.default_rng(1)
    level = 5.0 + 0.02 * AGE + 0.1 * rng.standard_normal(14)
    told = trend_quantiles(AGE, level, (0.05, 0.5, 0.95))
    assert told[0] < 0.02 < told[2] and told[1] == pytest.approx(0.02, rel=0.1)
    np.testing.assert_allclose(
        trend_quantiles(AGE / 365.0, 1e3 * level, (0.5,)), [365e3 * told[1]], rtol=1e-6
    )


def test_levels_without_noise() -> None:
    assert trend_quantiles(AGE, np.full(14, 3.0), (0.5,)) == pytest.approx([0.0])
