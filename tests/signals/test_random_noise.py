"""Random series against the Allan deviation that they state, spectra and closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import zeta

from fogml.arrays import FloatArray
from fogml.signals import random_noise
from fogml.signals.allan import allan_deviation

N, SAMPLE_S = 1 << 17, 0.5


def rng(seed: int = 4) -> np.random.Generator:
    return np.random.default_rng(seed)


def markov_variance(tau: FloatArray, deviation: float, time_constant: float) -> FloatArray:
    """IEEE Std 952, C.1.5: Allan variance of a Gauss-Markov process, with q_c**2 = 2 A**2 / T_c."""
    x = tau / time_constant
    return 2.0 * deviation**2 / x * (1.0 - (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)) / (2.0 * x))


SERIES: dict[str, tuple[Callable[[], FloatArray], Callable[[FloatArray], FloatArray]]] = {
    "white": (
        lambda: random_noise.white_noise(rng(), N, SAMPLE_S, 3.0),
        lambda tau: 3.0 / np.sqrt(tau),
    ),
    "flicker": (
        lambda: random_noise.flicker_noise(rng(), N, 0.4),
        lambda tau: np.full(len(tau), 0.4 * np.sqrt(2.0 * np.log(2.0) / np.pi)),
    ),
    "random walk": (
        lambda: random_noise.random_walk(rng(), N, SAMPLE_S, 0.02),
        lambda tau: 0.02 * np.sqrt(tau / 3.0),
    ),
    "quantisation": (
        lambda: random_noise.quantisation_noise(rng(), N, SAMPLE_S, 0.7),
        lambda tau: np.sqrt(3.0) * 0.7 / tau,
    ),
    "Gauss-Markov": (
        lambda: random_noise.gauss_markov(rng(), N, SAMPLE_S, 0.3, 20.0),
        lambda tau: np.sqrt(markov_variance(tau, 0.3, 20.0)),
    ),
    "fast Gauss-Markov": (
        lambda: random_noise.gauss_markov(rng(), N, SAMPLE_S, 0.3, 0.2),
        lambda tau: np.sqrt(markov_variance(tau, 0.3, 0.2)),
    ),
}


@pytest.mark.parametrize("name", SERIES)
def test_allan_deviation_is_the_stated_one(name: str) -> None:
    series, expected = SERIES[name]
    found = allan_deviation(series(), SAMPLE_S, level=0.999)
    wanted = expected(found.taus_s)
    assert len(found.taus_s) > 12
    if "Gauss-Markov" in name:
        # No power law, whose degrees of freedom the intervals would need.
        sure = found.n * SAMPLE_S / found.taus_s > 300
        np.testing.assert_allclose(found.adev[sure], wanted[sure], rtol=0.1)
        return
    assert np.all((found.lower <= wanted) & (wanted <= found.upper)), found.adev / wanted


@pytest.mark.parametrize("name", ["white", "flicker", "random walk", "quantisation"])
def test_the_first_averaging_times_are_exact(name: str) -> None:
    """With the samples that there are, two percent is four standard deviations at one sample."""
    series, expected = SERIES[name]
    found = allan_deviation(series(), SAMPLE_S)
    assert found.adev[:2] == pytest.approx(expected(found.taus_s[:2]), rel=0.02)


def test_folded_density_is_that_of_means_over_a_sample() -> None:
    """Against the sum over all aliases of 1/f times sinc**2, term by term with its tail as an integral."""
    x = np.linspace(0.01, 0.5, 23)
    k = np.arange(1, 20_001)[:, None]
    terms = np.sin(np.pi * x) ** 2 / np.pi**2
    summed = terms * (1 / x**3 + np.sum(1 / (k + x) ** 3 + 1 / (k - x) ** 3, axis=0)) * x
    assert summed == pytest.approx(np.sinc(x) ** 2 * (1 + x**3 * (zeta(3, 1 + x) + zeta(3, 1 - x))), rel=1e-7)
    root = np.polynomial.polynomial.polyval(x, random_noise._folded_root())
    assert root**2 == pytest.approx(summed, rel=1e-6)


def test_flicker_keeps_its_density_down_to_one_over_the_record() -> None:
    """Mean periodogram of many short records at their lowest frequencies, tapered against leakage."""
    count, records = 512, 600
    source = rng(2)
    taper = np.hanning(count)
    power = np.zeros(count // 2 + 1)
    for _ in range(records):
        tapered = taper * random_noise.flicker_noise(source, count, 1.0)
        power += np.abs(np.fft.rfft(tapered)) ** 2
    density = 2.0 * power / records / np.sum(taper**2)
    frequency = np.arange(len(density)) / count
    ratio = density * np.pi * np.where(frequency > 0, frequency, np.nan)
    # Hanning's own leakage lifts the lowest lines a little.
    assert np.all(np.abs(ratio[2:12] - 1.0) < 0.2), ratio[:12]
    # Means over samples lose sin(x)**2 / x**2 and get x**3 * 2 zeta(3) back.
    held = np.sinc(frequency) ** 2 * (1.0 + 2.0 * zeta(3.0) * frequency**3)
    assert np.mean((ratio / held)[12:60]) == pytest.approx(1.0, abs=0.02)


def test_ends_of_a_flicker_record_know_nothing_of_each_other() -> None:
    """The last sample is as far from the first one as samples that far apart are in a long record."""
    source, count = rng(3), 256
    ends = [np.ptp(random_noise.flicker_noise(source, count, 1.0)[[0, -1]]) for _ in range(3000)]
    long = random_noise.flicker_noise(source, 1 << 18, 1.0)
    apart = long[count - 1 :] - long[: 1 - count]
    assert np.mean(np.square(ends)) == pytest.approx(np.mean(apart**2), rel=0.1)


def test_gauss_markov_samples_have_the_correlation_of_means() -> None:
    """Against means of a finely sampled process, whose correlation is summed directly."""
    fine, time_constant, sample = 400, 3.0, 1.0
    lags = (np.arange(fine)[:, None] - np.arange(fine)[None, :]) / fine * sample
    expected = [float(np.mean(np.exp(-np.abs(lags + k * sample) / time_constant))) for k in range(4)]
    series = random_noise.gauss_markov(rng(5), 400_000, sample, 1.0, time_constant)
    found = [float(np.mean(series[k:] * series[: len(series) - k])) for k in range(4)]
    assert found == pytest.approx(expected, abs=0.012)
    starts = [random_noise.gauss_markov(rng(seed), 2, sample, 1.0, 50.0) for seed in range(4000)]
    assert np.var([s[0] for s in starts]) == pytest.approx(np.var([s[1] for s in starts]), rel=0.05)
    assert np.var([s[0] for s in starts]) == pytest.approx(1.0, rel=0.08)


def test_gauss_markov_of_a_very_long_correlation_is_a_random_walk() -> None:
    """Near times far below its correlation, with K = A sqrt(2 / T_c)."""
    series = random_noise.gauss_markov(rng(6), 100_000, 1.0, 1.0, 1e8)
    found = allan_deviation(series, 1.0, [1.0, 4.0, 64.0])
    assert found.adev == pytest.approx(np.sqrt(2e-8 * found.taus_s / 3.0), rel=0.1)


def test_random_walk_starts_at_zero() -> None:
    first = [random_noise.random_walk(rng(seed), 1, 4.0, 1.0)[0] for seed in range(4000)]
    # The mean of a walk over its first interval has variance K**2 dt / 3 about 0; one tap of it here.
    assert np.mean(first) == pytest.approx(0.0, abs=0.1)
    assert np.var(first) == pytest.approx(4.0 * (0.5 + 0.5 / np.sqrt(3.0)) ** 2, rel=0.08)


@pytest.mark.parametrize("frequency", [0.01, 0.3, 2.3])
def test_lines_are_means_over_the_samples(frequency: float) -> None:
    fine = 2000
    time = (np.arange(40 * fine) + 0.5) / fine * 0.7
    wanted = np.sin(2.0 * np.pi * frequency * time + 0.4).reshape(40, fine).mean(axis=1)
    assert random_noise.sinusoid(40, 0.7, 2.0, frequency, 0.4) == pytest.approx(2.0 * wanted, abs=2e-6)


def test_bursts_that_outlast_the_series_take_no_more_than_it_is_long():
    """A thousand frames that stick for good, of 8 GB of samples if all were held."""
    series = random_noise.bursts(rng(8), 1000, 1.0, 1.0, 1e6)
    assert np.isfinite(series).all()
    assert 0.0 < np.mean(np.diff(series) != 0.0) < 0.9


def test_bursts_have_their_rate_length_and_size() -> None:
    series = random_noise.bursts(rng(8), 1_000_000, 5.0, 1e-3, 4.0)
    held = np.flatnonzero(series)
    begins = np.count_nonzero(np.diff(series[held]) != 0.0)
    assert begins == pytest.approx(1000, rel=0.12)
    assert len(held) / begins == pytest.approx(4.0, rel=0.12)
    assert np.std(series[held]) == pytest.approx(5.0, rel=0.15)
    assert not random_noise.bursts(rng(8), 1000, 5.0, 0.0, 4.0).any()


def test_no_samples_give_none() -> None:
    assert len(random_noise.flicker_noise(rng(), 0, 1.0)) == 0
    assert len(random_noise.gauss_markov(rng(), 0, 1.0, 1.0, 10.0)) == 0
    assert len(random_noise.bursts(rng(), 0, 1.0, 0.1, 2.0)) == 0
