from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fogml.errors import InputError
from fogml.signals.whiteness import whiteness


def test_white_noise_passes_as_often_as_stated():
    rng = np.random.default_rng(3)
    alarms = sum(not whiteness(rng.standard_normal(3000), level=0.05).white for _ in range(300))
    # Bonferroni: at most 5 %, and not next to never.
    assert 2 <= alarms <= 25


def test_single_tests_have_uniform_p_values():
    rng = np.random.default_rng(4)
    checks = [whiteness(rng.standard_normal(2000)) for _ in range(300)]
    for p in (np.array([c.lag_p_values for c in checks]), np.array([c.scale_p_values for c in checks])):
        assert np.all(np.abs(p.mean(axis=0) - 0.5) < 4 * 0.29 / np.sqrt(300))


def test_neighbours_that_know_of_each_other_are_found():
    e = np.random.default_rng(5).standard_normal(5000)
    found = whiteness(lfilter([1.0], [1.0, -0.1], e) * np.sqrt(1 - 0.01), sample_s=10.0)
    assert not found.white
    assert found.autocorrelation[0] == pytest.approx(0.1, abs=0.04)
    assert any("correlated: +0.1" in words and "at 10 s" in words for words in found.failed)


def test_a_variance_off_is_found_at_every_scale():
    found = whiteness(1.2 * np.random.default_rng(6).standard_normal(5000))
    assert found.p_value < 1e-6
    assert found.variance_ratio[:4] == pytest.approx(1.44, rel=0.15)
    assert "over 1 s is 1.4" in found.failed[0]


def test_slow_power_is_found_where_short_lags_are_blind():
    rng = np.random.default_rng(7)
    slow = 0.1 * np.sin(2 * np.pi * np.arange(20_000) / 5000)
    found = whiteness(rng.standard_normal(20_000) + slow, longest_lag=4)
    assert found.lag_p_values.min() > 1e-3
    assert found.scale_p_values[found.scales >= 512].min() < 1e-6


def test_series_are_not_joined():
    rng = np.random.default_rng(8)
    parts = [rng.standard_normal(n) for n in (40, 500, 7)]
    found = whiteness(parts)
    e = np.concatenate(parts)
    within = sum(float(p[1:] @ p[:-1]) for p in parts)
    assert found.autocorrelation[0] == pytest.approx(within / (e @ e))


def test_too_little_or_broken_input_is_refused():
    with pytest.raises(InputError, match="at least"):
        whiteness(np.zeros(10))
    with pytest.raises(InputError, match="finite"):
        whiteness(np.full(100, np.nan))
