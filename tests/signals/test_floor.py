from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fogml.errors import InputError
from fogml.signals.floor import noise_floor, realised_noise_floor

HOURS_10 = np.arange(36_000.0)


def chamber_drift() -> np.ndarray:
    """Drift of a ramp and soak programme with a thermal lag of 300 s, 5 deg/h from end to end."""
    temperature = np.interp(HOURS_10 % 7200, [0, 600, 3600, 4200, 7200], [0, 10, 10, 0, 0])
    lagged = lfilter([1 / 300], [1, 1 / 300 - 1], temperature)
    return 0.5 * lagged + 10.0 * np.gradient(lagged)


def floors(seed: int, repeats: int, drift: np.ndarray | float = 0.0, spread: float = 0.3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.array(
        [noise_floor(spread * rng.normal(size=36_000) + drift, 1.0, 100.0) for _ in range(repeats)]
    )


def test_white_noise_is_divided_by_the_root_of_its_samples():
    got = floors(1, 20)
    assert np.mean(np.abs(got / 0.03 - 1) < 0.02) >= 0.9
    assert np.all(np.abs(got / 0.03 - 1) < 0.12)
    assert got.mean() == pytest.approx(0.3 / 10, rel=0.01)


def test_slow_drift_hardly_changes_it():
    drift = chamber_drift()
    assert np.ptp(drift) > 100 * 0.03
    got = floors(2, 20, drift)
    assert got.mean() == pytest.approx(0.3 / 10, rel=0.04)
    assert np.all(got < 1.25 * 0.3 / 10)
    # A drift that is all there is leaves next to nothing.
    assert noise_floor(drift, 1.0, 100.0) < 0.01 * np.std(drift)


def test_spikes_bursts_and_steps_do_not_count():
    rng = np.random.default_rng(3)
    y = rng.normal(size=36_000)
    y[rng.integers(0, 36_000, 20)] += 50.0
    y[5000:5300] += 30.0 * rng.normal(size=300)
    y[20_000:] += 40.0
    assert noise_floor(y, 1.0, 100.0) == pytest.approx(0.1, rel=0.15)


def test_quantised_data_count_with_their_step():
    rng = np.random.default_rng(4)
    y = np.round(0.5 * rng.normal(size=36_000) + chamber_drift())
    assert noise_floor(y, 1.0, 100.0) == pytest.approx(np.sqrt(0.25 + 1 / 12) / 10, rel=0.06)


def test_quantised_angles_fall_faster_than_white_noise():
    rng = np.random.default_rng(5)
    y = np.diff(rng.uniform(-0.5, 0.5, size=40_001)) + 0.002 * rng.normal(size=40_000)
    want = np.sqrt(2 / 12 / 100**2 + 0.002**2 / 100)
    assert noise_floor(y, 1.0, 100.0) == pytest.approx(want, rel=0.1)


def test_flicker_is_extrapolated():
    rng = np.random.default_rng(6)
    n = 40_000
    frequency = np.fft.rfftfreq(2 * n)
    frequency[0] = np.inf
    found = []
    for _ in range(10):
        lines = rng.normal(size=n + 1) + 1j * rng.normal(size=n + 1)
        # One-sided density B^2/(pi f) with B = 1, a line every 1/(2n).
        flicker = np.fft.irfft(lines / np.sqrt(np.pi * frequency * 4 * n), 2 * n)[:n] * n * np.sqrt(2)
        found.append(noise_floor(flicker + 0.5 * rng.normal(size=n), 1.0, 100.0))
    assert np.mean(found) == pytest.approx(np.sqrt(2 * np.log(2) / np.pi + 0.05**2), rel=0.1)


def test_a_dither_line_does_not_lift_it():
    rng = np.random.default_rng(7)
    time = np.arange(200_000) * 0.01
    y = 60.0 * np.sin(2 * np.pi * time / 0.3) + rng.normal(size=200_000)
    averages = y.reshape(-1, 1000).mean(axis=1)
    assert noise_floor(y, 0.01, 10.0) < 2.0 * averages.std()


def test_segments_are_not_joined():
    rng = np.random.default_rng(8)
    bursts = 0.3 * rng.normal(size=(300, 170)) + 100.0 * rng.normal(size=(300, 1))
    segments = [slice(170 * i, 170 * (i + 1)) for i in range(300)]
    got = noise_floor(bursts.ravel(), 0.017, 100.0, segments=segments)
    assert got == pytest.approx(0.3 / np.sqrt(100.0 / 0.017), rel=0.03)


def test_unit_and_short_series():
    rng = np.random.default_rng(9)
    y = rng.normal(size=5000)
    assert noise_floor(1000 * y + 1e6, 0.1, 10.0) == pytest.approx(1000 * noise_floor(y, 0.1, 10.0), rel=1e-6)
    assert 0.3 < noise_floor(y[:20], 1.0, 1.0) < 3.0
    assert noise_floor(np.ones(50), 1.0, 10.0) == 0.0


@pytest.mark.parametrize(
    ("y", "sample_s", "averaging_s", "message"),
    [
        ([1.0, 2.0], 1.0, 10.0, "three samples"),
        ([1.0, np.nan, 2.0, 3.0], 1.0, 10.0, "not finite"),
        ([1.0, 2.0, 3.0], 0.0, 10.0, "positive"),
        ([1.0, 2.0, 3.0], 1.0, -1.0, "positive"),
    ],
)
def test_bad_input(y: list[float], sample_s: float, averaging_s: float, message: str):
    with pytest.raises(InputError, match=message):
        noise_floor(y, sample_s, averaging_s)


def test_realised_floor_is_that_of_the_very_run():
    rng = np.random.default_rng(10)
    noise = rng.normal(size=1000)
    got = realised_noise_floor(np.arange(1000.0), noise, 100.0)
    assert got == pytest.approx(noise.reshape(10, 100).mean(axis=1).std(), rel=1e-12)
    with pytest.raises(InputError, match="two are needed"):
        realised_noise_floor(np.arange(100.0), noise[:100], 100.0)
