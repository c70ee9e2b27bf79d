"""Noise and whitening of the first reality, against spectra and dense covariances."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import toeplitz

from fogml.blind.first.noise import NoiseConstants, draw_noise, draw_series, flicker, record_length
from fogml.blind.frame.noise import Projected, Whitening

SAMPLE_S = 10.0


def covariance(c: NoiseConstants, count: int) -> NDArray[np.float64]:
    """Dense covariance of a run's noise, from the definition of each term."""
    length = record_length(count)
    k = np.arange(1, length // 2 + 1)
    lags = np.arange(count)
    weight = np.where(k == length // 2, 0.5, 1.0) / k
    fourier = np.zeros(length // 2 + 1)
    fourier[1:] = weight
    stationary = c.B**2 / np.pi * 0.5 * length * np.fft.irfft(fourier, length)[lags]
    hours = SAMPLE_S / 3600.0
    i = np.arange(1, count + 1)
    return toeplitz(stationary) + c.N**2 / hours * np.eye(count) + c.K**2 * hours * np.minimum.outer(i, i)


def test_flicker_has_slope_minus_one_and_its_level() -> None:
    rng = np.random.default_rng(2)
    count = 4096
    power = np.mean(
        [np.abs(np.fft.rfft(flicker(rng, count, 0.3) * np.hanning(count))) ** 2 for _ in range(200)], 0
    )
    # One-sided density over f in cycles per sample.
    density = 2.0 * power / np.sum(np.hanning(count) ** 2)
    f = np.fft.rfftfreq(count)
    inside = slice(10, 1500)
    slope, _ = np.polyfit(np.log(f[inside]), np.log(density[inside]), 1)
    assert slope == pytest.approx(-1.0, abs=0.03)
    assert np.mean(density[inside] * f[inside]) == pytest.approx(0.3**2 / np.pi, rel=0.03)


def test_allan_deviation_of_flicker_is_flat_at_its_value() -> None:
    rng = np.random.default_rng(5)
    found = {width: [] for width in (4, 16, 64)}
    for _ in range(60):
        x = flicker(rng, 4096, 1.0)
        for width in found:
            means = x.reshape(-1, width).mean(axis=1)
            found[width].append(0.5 * np.mean(np.diff(means) ** 2))
    for values in found.values():
        assert np.sqrt(np.mean(values)) == pytest.approx(np.sqrt(2.0 * np.log(2.0) / np.pi), rel=0.05)


def test_realised_noise_has_the_covariance_that_the_whitening_assumes() -> None:
    rng = np.random.default_rng(8)
    c = NoiseConstants(0.002, 0.03, 0.02)
    whitening = Whitening(c, 600, SAMPLE_S)
    squares = []
    for _ in range(60):
        x = draw_series(rng, 600, SAMPLE_S, c)[:, None]
        squares.append(float(x[:, 0] @ whitening.solve(x)[:, 0]) / 600.0)
    assert np.mean(squares) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("constants", [(0.005, 0.01, 0.005), (0.001, 0.05, 0.001), (0.0006, 0.01, 0.03)])
def test_d_prime_is_within_two_percent_of_the_dense_one(constants: tuple[float, float, float]) -> None:
    c, count = NoiseConstants(*constants), 700
    t = np.linspace(0.0, 1.0, count)
    columns = np.stack([np.ones(count), t, t**2, np.sin(9.0 * t)], axis=1)
    factor = np.linalg.cholesky(covariance(c, count))
    basis = np.linalg.qr(np.linalg.solve(factor, columns))[0]
    projected = Projected([Whitening(c, count, SAMPLE_S)], [columns])
    rng = np.random.default_rng(1)
    waves = [np.sin(2.0 * np.pi * count * t / period) for period in (3.0, 30.0, 200.0)]
    for series in (*waves, np.exp(-12.0 * t), (t > 0.4).astype(float), rng.standard_normal(count)):
        white = np.linalg.solve(factor, series)
        dense = np.linalg.norm(white - basis @ (basis.T @ white))
        assert projected.length([series]) == pytest.approx(dense, rel=0.02)


def test_constants_are_shared_by_runs_and_projected_out_exactly() -> None:
    rng = np.random.default_rng(4)
    c = draw_noise(rng)
    columns = [rng.standard_normal((300, 3)), rng.standard_normal((400, 3))]
    projected = Projected([Whitening(c, len(x), SAMPLE_S) for x in columns], columns)
    theta = np.array([2.0, -30.0, 0.01])
    shared = [x @ theta for x in columns]
    assert projected.constants(shared) == pytest.approx(theta, rel=1e-6)
    assert projected.length(shared) < 1e-5 * projected.length(
        [x[:, 0] * [1, -1][k] for k, x in enumerate(columns)]
    )


def test_expected_mean_square_of_averages_is_that_of_the_dense_covariance() -> None:
    c, count, width = NoiseConstants(0.002, 0.03, 0.02), 500, 10
    means = np.kron(np.eye(count // width), np.full((1, width), 1.0 / width))
    dense = np.trace(means @ covariance(c, count) @ means.T) / (count // width)
    assert Whitening(c, count, SAMPLE_S).mean_square_of_means(width) == pytest.approx(dense, rel=1e-6)
