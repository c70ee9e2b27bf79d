"""Sinusoids in a spectrum: which periods are looked for, and how well a median tells the noise about them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from fogml.signals.noise_spectrum import Resolution, spectrum_of
from fogml.signals.spectral_lines import median_freedom


def test_the_freedom_of_a_median_of_squares_is_that_of_its_scatter() -> None:
    squares = np.random.default_rng(0).standard_normal((20000, 401)) ** 2
    medians = np.median(squares, axis=1)
    scatter = 2.0 * medians.mean() ** 2 / medians.var()
    assert 401 * median_freedom() == pytest.approx(scatter, rel=0.03)
    middle = chi2.median(1)
    assert median_freedom() == pytest.approx(8.0 * (middle * chi2.pdf(middle, 1)) ** 2, rel=1e-9)


@pytest.mark.parametrize("resolution", [Resolution(), Resolution(line_fewest=16), Resolution(per_octave=8)])
def test_sinusoids_are_looked_for_up_to_the_period_that_is_told(resolution: Resolution) -> None:
    count = 1 << 15
    time = np.arange(count, dtype=float)
    noise = np.random.default_rng(1).standard_normal(count)
    slowest = resolution.slowest_line_s(float(count))
    for times_slowest, seen in ((0.9, True), (1.1, False)):
        # One coefficient of the cosine transform, so that nothing leaks into its neighbours.
        number = round(2.0 * count / (times_slowest * slowest))
        wave = 0.3 * np.cos(np.pi * number * (time + 0.5) / count)
        found = spectrum_of([noise + wave], 1.0, None, resolution).lines
        assert bool(found) is seen
        if seen:
            assert found[0].frequency_hz == pytest.approx(0.5 * number / count, rel=1e-3)
            assert found[0].amplitude == pytest.approx(0.3, rel=0.1)
