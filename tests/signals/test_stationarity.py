from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f_oneway

from fogml.signals.whiteness import _by_parts, stationarity


def test_steady_noise_of_any_colour_passes():
    rng = np.random.default_rng(1)
    chances = []
    for _ in range(40):
        white = rng.normal(size=12_000)
        coloured = lfilter([0.1], [1.0, -0.9], white)
        chances += [stationarity([y], 0.1).p_value for y in (white, coloured)]
    assert min(chances) > 1e-3
    assert np.mean(np.array(chances) < 0.1) < 0.15


def test_noise_that_grows_is_seen_with_its_size():
    rng = np.random.default_rng(2)
    growing = rng.normal(size=12_000) * np.repeat([1.0, 1.0, 1.5], 4000)
    found = stationarity([growing], 0.1)
    assert found.p_value < 1e-3
    assert found.thirds[2] / found.thirds[0] == pytest.approx(1.5, rel=0.15)


@pytest.mark.parametrize("unit", [2.0**-30, 2.0**30])
def test_the_unit_of_the_values_does_not_matter(unit):
    growing = np.random.default_rng(2).normal(size=3000) * np.linspace(1.0, 1.3, 3000)
    one, other = (stationarity([y], 0.1) for y in (growing, unit * growing))
    assert other.p_value == pytest.approx(one.p_value, rel=1e-9) and one.p_value < 1.0
    assert (other.tau_s, other.thirds) == (one.tau_s, one.thirds)


def test_too_short_to_tell():
    assert stationarity([np.arange(20.0)], 1.0).tau_s is None


@pytest.mark.parametrize("apart", [0.0, 0.5, 3.0])
def test_the_chance_is_that_of_the_analysis_of_variance(apart):
    groups = np.random.default_rng(5).normal(size=(4, 8)) + apart * np.arange(4.0)[:, None]
    assert _by_parts(groups) == pytest.approx(f_oneway(*groups).pvalue, rel=1e-9)


def test_parts_without_scatter_of_their_own_are_apart():
    assert _by_parts(np.repeat([[1.0], [2.0]], 8, axis=1)) == 0.0
