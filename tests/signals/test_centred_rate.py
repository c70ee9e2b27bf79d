"""Rates about each sample: exact on lines and parabolas, without delay, on any clock."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.signals.smoothing import centred_rate


@pytest.mark.parametrize("window_s", [0.0, 1.0, 64.0, 63.3])
def test_a_parabola_has_its_own_slope_at_each_sample(window_s: float) -> None:
    # Windows that are alike on both sides see a parabola's slope at the sample itself.
    time = np.arange(1000.0)
    found = centred_rate(time, 0.5 * 0.01 * (time - 300.0) ** 2, window_s)
    inner = slice(70, -70)
    np.testing.assert_allclose(found[inner], 0.01 * (time - 300.0)[inner], atol=1e-9)


def test_a_line_has_its_slope_at_ends_and_beside_gaps_on_uneven_times() -> None:
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.2, 1.8, 2000))
    time[900:] += 5000.0
    np.testing.assert_allclose(centred_rate(time, 25.0 - 0.02 * time, 64.0), -0.02, rtol=1e-9)


def test_means_are_those_of_the_samples_within_the_windows() -> None:
    rng = np.random.default_rng(1)
    time, x = np.cumsum(rng.uniform(0.5, 3.0, 400)), rng.standard_normal(400)
    found = centred_rate(time, x, 20.0)
    for i in (0, 1, 57, 200, 399):
        after = (time >= time[i]) & (time < time[i] + 20.0)
        before = (time <= time[i]) & (time > time[i] - 20.0)
        wanted = (x[after].mean() - x[before].mean()) / (time[after].mean() - time[before].mean())
        assert found[i] == pytest.approx(wanted, rel=1e-9)


def test_rows_longer_than_the_window_take_their_neighbours() -> None:
    time = 100.0 * np.arange(50)
    x = np.sin(time / 700.0)
    np.testing.assert_allclose(centred_rate(time, x, 64.0)[1:-1], np.gradient(x, time)[1:-1], atol=1e-15)


def test_one_sample_has_no_rate() -> None:
    assert centred_rate(np.array([3.0]), np.array([25.0]), 64.0).tolist() == [0.0]
