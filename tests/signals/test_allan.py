from __future__ import annotations

from itertools import pairwise

import allantools
import numpy as np
import pytest

from fogml.errors import InputError
from fogml.signals.allan import allan_deviation, degrees_of_freedom, noise_exponents


def flicker(rng: np.random.Generator, n: int) -> np.ndarray:
    """Noise of spectral density 1/f, by its spectrum."""
    spectrum = rng.normal(size=n) + 1j * rng.normal(size=n)
    frequency = np.arange(n, dtype=float)
    frequency[0] = np.inf
    return np.fft.irfft(spectrum / np.sqrt(frequency), 2 * n - 2)[: n - 1] * n**0.5


@pytest.mark.parametrize("overlapping", [True, False])
@pytest.mark.parametrize("taus", ["octave", np.geomspace(0.01, 60.0, 57)])
def test_agrees_with_allantools(overlapping: bool, taus):
    rng = np.random.default_rng(1)
    x = 14.85 + 3.0 * rng.normal(size=20_011) + np.cumsum(rng.normal(size=20_011)) * 0.01
    got = allan_deviation(x, 0.01, taus, overlapping)
    theirs = allantools.oadev if overlapping else allantools.adev
    want_taus, want, _, want_n = theirs(x, rate=100.0, data_type="freq", taus=taus)
    np.testing.assert_allclose(got.taus_s, want_taus, rtol=1e-12)
    np.testing.assert_allclose(got.adev, want, rtol=1e-9)
    np.testing.assert_array_equal(got.n, want_n)


def test_agrees_with_allantools_where_work_is_spread_over_threads():
    rng = np.random.default_rng(2)
    x = rng.normal(size=700_001) + 1e-5 * np.arange(700_001)
    taus = np.geomspace(1, 2e5, 40)
    got = allan_deviation(x, 1.0, taus)
    want_taus, want, _, _ = allantools.oadev(x, rate=1.0, data_type="freq", taus=taus)
    np.testing.assert_allclose(got.taus_s, want_taus)
    np.testing.assert_allclose(got.adev, want, rtol=1e-9)


def test_the_same_numbers_every_time_and_read_only_input():
    rng = np.random.default_rng(3)
    x = rng.normal(size=300_000)
    x.flags.writeable = False
    np.testing.assert_array_equal(allan_deviation(x, 1.0).adev, allan_deviation(x, 1.0).adev)


def test_an_offset_costs_no_digits():
    rng = np.random.default_rng(4)
    x = np.round(rng.normal(size=50_000) * 2**16) / 2**16
    np.testing.assert_allclose(
        allan_deviation(x + 2.0**30, 1.0).adev, allan_deviation(x, 1.0).adev, rtol=1e-9
    )


def test_long_averaging_of_many_samples_does_not_overflow():
    # 2 m^2 n is 2.7e19 here, past the largest 64-bit integer; a ramp has sigma = slope * tau / sqrt 2.
    n = 3_000_000
    got = allan_deviation(1e-6 * np.arange(n), 1.0, [900_000.0, 1_000_000.0])
    np.testing.assert_allclose(got.adev, 1e-6 * got.taus_s / np.sqrt(2), rtol=1e-7)


@pytest.mark.parametrize("overlapping", [True, False])
def test_segments_are_pooled_by_their_counts_and_never_joined(overlapping: bool):
    rng = np.random.default_rng(5)
    parts = [rng.normal(size=k) + offset for k, offset in ((4000, 0.0), (1, 50.0), (900, -70.0), (57, 1e3))]
    x = np.concatenate(parts)
    edges = np.cumsum([0, *map(len, parts)])
    got = allan_deviation(x, 1.0, overlapping=overlapping, segments=[slice(a, b) for a, b in pairwise(edges)])
    for tau, adev, n in zip(got.taus_s.astype(int), got.adev, got.n):
        squares: list[float] = []
        for part in parts:
            theta = np.concatenate(([0.0], np.cumsum(part)))
            starts = range(0, len(theta) - 2 * tau, 1 if overlapping else tau)
            squares += [(theta[i + 2 * tau] - 2 * theta[i + tau] + theta[i]) ** 2 for i in starts]
        assert n == len(squares)
        assert adev == pytest.approx(np.sqrt(np.mean(squares) / 2) / tau, rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "exponent"), [("quantisation", 2), ("white", 0), ("flicker", -1), ("random walk", -2)]
)
def test_kind_of_noise_is_told(kind: str, exponent: int):
    rng = np.random.default_rng(6)
    n = 40_000
    x = {
        "quantisation": np.diff(rng.normal(size=n + 1)),
        "white": rng.normal(size=n),
        "flicker": flicker(rng, n),
        "random walk": np.cumsum(rng.normal(size=n)),
    }[kind]
    got = allan_deviation(x, 1.0)
    told = got.exponent[got.factors <= 128]
    assert np.mean(told == exponent) > 0.8


@pytest.mark.parametrize("overlapping", [True, False])
@pytest.mark.parametrize("factor", [1, 2, 7, 40])
@pytest.mark.parametrize("exponent", [2, 0, -2])
def test_degrees_of_freedom_follow_from_the_covariance(exponent: int, factor: int, overlapping: bool):
    # Quadratic forms of normal variables: edf = trace(C)^2 / trace(C^2).
    phases = 400
    second = np.zeros((phases - 2 * factor, phases))
    rows = np.arange(len(second))
    for shift, weight in ((0, 1.0), (factor, -2.0), (2 * factor, 1.0)):
        second[rows, rows + shift] = weight
    if not overlapping:
        second = second[::factor]
    angle = np.eye(phases)
    if exponent == 0:
        angle = np.tril(np.ones((phases, phases)), -1)
    if exponent == -2:
        # The rate walks within the sample too: a push at u moves the angle at t by t - u.
        angle = np.maximum(np.arange(phases)[:, None] - np.arange(0.05, phases, 0.1), 0)
    covariance = second @ angle @ angle.T @ second.T
    want = np.trace(covariance) ** 2 / np.sum(covariance**2)
    got = degrees_of_freedom(exponent, factor, np.array([phases]), overlapping=overlapping)
    assert got == pytest.approx(want, rel=0.03)


def test_intervals_hold_their_level():
    rng = np.random.default_rng(7)
    inside = []
    for _ in range(400):
        got = allan_deviation(rng.normal(size=1000), 1.0, [1.0, 8.0, 64.0, 200.0])
        truth = 1 / np.sqrt(got.taus_s)
        inside.append((got.lower < truth) & (truth < got.upper))
    share = np.mean(inside, axis=0)
    # Binomial: 0.90 +- 0.045 at three standard errors; the longest time rests on few windows.
    assert np.all(np.abs(share[:3] - 0.9) < 0.045), share
    assert abs(share[3] - 0.9) < 0.08, share


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sample_s": 0.0}, "must be positive"),
        ({"sample_s": 1.0, "taus": [-1.0]}, "must be positive"),
        ({"sample_s": 1.0, "taus": "decade"}, "octave"),
        ({"sample_s": 1.0, "taus": [1e6]}, "no averaging time fits"),
        ({"sample_s": 1.0, "segments": [(0, 99)]}, "beyond the 10 samples"),
        ({"sample_s": 1.0, "segments": []}, "no averaging time fits"),
        ({"sample_s": 1.0, "level": 90.0}, "between 0 and 1"),
    ],
)
def test_bad_input(arguments: dict, message: str):
    with pytest.raises(InputError, match=message):
        allan_deviation(np.arange(10.0), **arguments)


def test_values_that_are_not_finite():
    with pytest.raises(InputError, match="not finite"):
        allan_deviation([0.0, 1.0, np.nan, 2.0, 3.0], 1.0)
    with pytest.raises(InputError, match="one series"):
        allan_deviation(np.zeros((5, 2)), 1.0)


def test_one_averaging_time_alone_tells_its_noise():
    """Steps of a rounded angle undo each other: correlations of -1/2, and of -2/3 of their differences."""
    alone = np.array([[1.0, -0.5, 3.0, -2.0]])
    assert noise_exponents(alone, np.array([100])).tolist() == [2]
    assert noise_exponents(alone, np.array([29])).tolist() == [0]
    assert noise_exponents(alone[:0], np.array([], dtype=np.intp)).tolist() == []
