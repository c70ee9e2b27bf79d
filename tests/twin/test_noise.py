"""Noise of the twin: Allan deviations against what was asked, blocks against the whole."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.signals.allan import allan_deviation
from fogml.signals.random_noise import Flicker
from fogml.twin.noise import NoiseConstants, NoiseSource
from tests.twin.allan import allan_variance

CASES = [
    {"Q": 2.0},
    {"N": 0.01},
    {"B": 0.3},
    {"K": 0.5},
    {"R": 0.2},
    {"Q": 1.0, "N": 0.01, "B": 0.1, "K": 0.1},
]


@pytest.mark.parametrize("sample_s", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("asked", CASES, ids=str)
def test_allan_deviation_is_what_was_asked(asked, sample_s):
    constants = NoiseConstants(**asked)
    series = NoiseSource(constants, 3, sample_s).block(400_000)
    found = allan_deviation(series, sample_s, level=0.99)
    wanted = np.sqrt(allan_variance(found.taus_s, **asked))
    if set(asked) == {"R"}:
        np.testing.assert_allclose(found.adev, wanted, rtol=1e-6)
        return
    # 99 % intervals at some fifteen averaging times that are not independent, and half a percent.
    inside = (wanted >= 0.995 * found.lower) & (wanted <= 1.005 * found.upper)
    assert inside.mean() >= 0.9, np.c_[found.taus_s, found.adev / wanted]
    short = found.taus_s <= 100.0 * sample_s
    np.testing.assert_allclose(found.adev[short], wanted[short], rtol=0.03)


def test_blocks_are_the_whole():
    constants = NoiseConstants(Q=1.0, N=0.01, B=0.1, K=0.1, R=0.3)
    whole = NoiseSource(constants, 7, 1.0).block(5000)
    source = NoiseSource(constants, 7, 1.0)
    parts = [source.block(count) for count in (1, 0, 999, 4000)]
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=0.0, atol=1e-12)
    assert not np.allclose(NoiseSource(constants, 8, 1.0).block(5000), whole)


def test_flicker_is_stationary():
    """The spread of the first sample over realisations is that of the thousandth."""
    drawn = np.array(
        [Flicker(1.0, 1.0, np.random.default_rng(seed)).block(1000)[[0, -1]] for seed in range(400)]
    )
    first, last = drawn.std(axis=0)
    assert first == pytest.approx(last, rel=0.2)
    assert first > 1.5


def test_negative_coefficients_are_refused():
    with pytest.raises(InputError, match="noise: 'N'"):
        NoiseConstants(N=-1.0)
