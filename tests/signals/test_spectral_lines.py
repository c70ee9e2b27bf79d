"""Sinusoids in a spectrum: at which frequencies they are told, and how a median tells the noise beside."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.signals.noise_search import NoiseSearch, search_noise
from fogml.signals.noise_spectrum import spectrum_of
from fogml.signals.spectral_lines import median_freedom
from fogml.signals.term_intervals import term_interval


def test_the_freedom_of_a_median_of_squares_is_that_of_its_scatter() -> None:
    squares = np.random.default_rng(0).standard_normal((20000, 401)) ** 2
    medians = np.median(squares, axis=1)
    scatter = 2.0 * medians.mean() ** 2 / medians.var()
    assert 401 * median_freedom() == pytest.approx(scatter, rel=0.03)
    middle = chi2.median(1)
    assert median_freedom() == pytest.approx(8.0 * (middle * chi2.pdf(middle, 1)) ** 2, rel=1e-9)


@pytest.mark.parametrize("number", [66, 100, 300, 900, 20000])
def test_a_sinusoid_is_told_at_any_frequency_above_the_single_coefficients(number: int) -> None:
    count = 1 << 15
    time = np.arange(count, dtype=float)
    noise = np.random.default_rng(1).standard_normal(count)
    assert not spectrum_of([noise], 1.0).lines
    # One coefficient of the cosine transform, so that nothing leaks into its neighbours.
    wave = 0.1 * np.cos(np.pi * number * (time + 0.5) / count)
    (found,) = spectrum_of([noise + wave], 1.0).lines
    assert found.frequency_hz == pytest.approx(0.5 * number / count, rel=1e-3)
    assert found.amplitude == pytest.approx(0.1, rel=0.15)


@pytest.mark.parametrize(("cycles", "gap"), [(7.3, False), (12.0, False), (12.4, True)])
def test_a_sinusoid_of_a_few_cycles_is_no_random_walk(cycles: float, gap: bool) -> None:
    """As of a room whose temperature is not recorded: the terms are those of the noise without it."""
    n = 6000
    time = np.arange(n, dtype=float)
    noise = np.random.default_rng(3).standard_normal(n)
    parts = [slice(0, 2000), slice(2400, n)] if gap else [slice(0, n)]

    def found(series: np.ndarray) -> NoiseSearch:
        return search_noise(spectrum_of([series[part] for part in parts], 1.0))

    quiet, swung = found(noise), found(noise + 0.4 * np.sin(2.0 * np.pi * cycles / n * time + 0.7))
    assert not quiet.spectrum.lines
    (line,) = swung.spectrum.lines
    assert line.amplitude == pytest.approx(0.4, rel=0.2)
    assert line.frequency_hz * n == pytest.approx(cycles, abs=0.2)
    assert swung.best["N"] == pytest.approx(quiet.best["N"], rel=0.02)
    low, high = term_interval(swung, "K", 0.9)
    assert low == 0.0 and high == pytest.approx(term_interval(quiet, "K", 0.9)[1], rel=0.3)


def test_a_drift_of_less_than_two_cycles_is_no_sinusoid() -> None:
    n = 6000
    time = np.arange(n) / n
    noise = np.random.default_rng(3).standard_normal(n)
    for drift in (np.exp(-time / 0.1), np.cos(2.0 * np.pi * 1.5 * time)):
        assert not search_noise(spectrum_of([noise + drift], 1.0)).spectrum.lines
