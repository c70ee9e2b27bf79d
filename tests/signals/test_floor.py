from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from fogml.signals.allan import segment_bounds
from fogml.signals.averages import FastNoise, averages_variance
from fogml.signals.floor import Floor, floor_model, quiet_parts
from fogml.signals.noise_expectation import floor_square
from fogml.signals.noise_model import NoiseModel
from fogml.signals.random_noise import Flicker

HOURS_10 = np.arange(36_000.0)


def noise_floor(y, sample_s: float, averaging_s: float, segments=None, drifts: bool = True) -> Floor:
    values = np.asarray(y, dtype=np.float64)
    starts, stops = segment_bounds(len(values), segments)
    model = floor_model(values, sample_s, averaging_s, starts, stops, drifts=drifts)
    windows = max(int(np.sum(stops - starts) * sample_s / averaging_s), 2)
    return Floor(0.0, 0.0, 0.0) if model is None else model.floor(averaging_s, windows)


def chamber_drift() -> np.ndarray:
    """Drift of a ramp and soak programme with a thermal lag of 300 s, 5 deg/h from end to end."""
    temperature = np.interp(HOURS_10 % 7200, [0, 600, 3600, 4200, 7200], [0, 10, 10, 0, 0])
    lagged = lfilter([1 / 300], [1, 1 / 300 - 1], temperature)
    return 0.5 * lagged + 10.0 * np.gradient(lagged)


def floors(seed: int, repeats: int, drift: np.ndarray | float = 0.0, spread: float = 0.3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.array(
        [noise_floor(spread * rng.normal(size=36_000) + drift, 1.0, 100.0).value for _ in range(repeats)]
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
    assert noise_floor(drift, 1.0, 100.0).value < 0.01 * np.std(drift)


def test_spikes_bursts_and_steps_do_not_count():
    rng = np.random.default_rng(3)
    y = rng.normal(size=36_000)
    y[rng.integers(0, 36_000, 20)] += 50.0
    y[5000:5300] += 30.0 * rng.normal(size=300)
    y[20_000:] += 40.0
    assert noise_floor(y, 1.0, 100.0).value == pytest.approx(0.1, rel=0.15)


def test_quantised_data_count_with_their_step():
    rng = np.random.default_rng(4)
    y = np.round(0.5 * rng.normal(size=36_000) + chamber_drift())
    assert noise_floor(y, 1.0, 100.0).value == pytest.approx(np.sqrt(0.25 + 1 / 12) / 10, rel=0.06)


def test_quantised_angles_fall_faster_than_white_noise():
    rng = np.random.default_rng(5)
    y = np.diff(rng.uniform(-0.5, 0.5, size=40_001)) + 0.002 * rng.normal(size=40_000)
    want = np.sqrt(2 / 12 / 100**2 + 0.002**2 / 100)
    assert noise_floor(y, 1.0, 100.0).value == pytest.approx(want, rel=0.1)


def test_fast_noise_counts_as_it_is_whatever_filter_or_resonance_makes_it():
    """Angle noise that ends far below half the sampling rate: no term says how much of it there is."""
    rng = np.random.default_rng(6)
    low_pass = butter(4, 0.3)
    squares, found = [], []
    for _ in range(4):
        y = lfilter(*low_pass, np.diff(5.0 * rng.normal(size=40_001))) + 0.01 * rng.normal(size=40_000)
        found.append(noise_floor(y, 1.0, 100.0).value)
        squares.append(np.var(y.reshape(-1, 100).mean(axis=1)))
    assert np.mean(found) == pytest.approx(np.sqrt(np.mean(squares)), rel=0.05)


def test_loud_parts_that_are_left_out_are_told():
    rng = np.random.default_rng(12)
    steady = rng.normal(size=20_000)
    loud = steady.copy()
    loud[5000:8000] *= 20.0
    told = noise_floor(loud, 1.0, 100.0)
    assert told.value == pytest.approx(0.1, rel=0.15)
    assert told.source.startswith("the run itself without the ") and told.source.endswith("that is loud")
    assert noise_floor(steady, 1.0, 100.0).source == "the run itself"


def test_stretches_too_short_to_tell_are_not_loud():
    noise = np.random.default_rng(3).normal(size=3200)
    short = [(first, first + 8) for first in range(2000, 3200, 8)]
    assert noise_floor(noise, 1.0, 100.0, segments=[(0, 2000), *short]).source == "the run itself"
    noise[700:1000] *= 20.0
    told = noise_floor(noise, 1.0, 100.0, segments=[(0, 2000), *short]).source
    assert told.startswith("the run itself without the 1") and told.endswith("that is loud")


def expected(windows: int, white: float, flicker: float, over_s: float = 100.0) -> float:
    """Floor of averages of white noise of a size per sample and flicker of B, from the covariance."""
    model = NoiseModel(white / 60.0, flicker)
    time = over_s * np.arange(1, windows + 1)
    covariance = model.covariance(time, over_s, model.ladder(over_s, over_s * windows))
    return float(np.sqrt(np.trace(covariance) / windows - covariance.mean()))


def flicker_noise(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 0.3 * rng.normal(size=36_000) + Flicker(0.2, 1.0, np.random.default_rng(seed + 100)).block(36_000)


def test_flicker_counts_and_drift_does_not():
    want = expected(360, 0.3, 0.2)
    found = [noise_floor(flicker_noise(seed), 1.0, 100.0) for seed in range(8)]
    assert np.mean([f.value for f in found]) == pytest.approx(want, rel=0.03)
    assert np.mean([f.lower <= want <= f.upper for f in found]) >= 0.6
    drifting = [noise_floor(flicker_noise(seed) + chamber_drift(), 1.0, 100.0) for seed in range(4)]
    assert np.mean([f.value for f in drifting]) == pytest.approx(want, rel=0.06)
    # As a model of the noise says, by its own way: the same definition.
    squares = (
        averages_variance("N", 1.0, 100.0, 360) * 0.3**2 + averages_variance("B", 1.0, 100.0, 360) * 0.04
    )
    assert np.sqrt(squares) == pytest.approx(want, rel=0.01)
    time = 100.0 * np.arange(1, 361)
    assert floor_square(NoiseModel(0.3 / 60.0, 0.2), time, 100.0) == pytest.approx(want**2, rel=1e-6)


@pytest.mark.parametrize("windows", [2, 60])
@pytest.mark.parametrize("name", ["N", "B", "K", "Q"])
def test_each_term_in_averages_is_that_of_their_covariance(name: str, windows: int):
    place, each = np.arange(windows), 100.0
    lag = np.abs(np.subtract.outer(place, place)).astype(float)

    def flicker(x):
        return np.where(x > 0.0, x**2 * np.log(np.maximum(x, 1.0)), 0.0)

    covariance = {
        "N": (lag == 0.0) / each,
        # Second differences of the angle's, but for what is constant over all windows.
        "B": (2.0 * flicker(lag) - flicker(lag + 1.0) - flicker(np.abs(lag - 1.0))) / (2.0 * np.pi),
        "K": each * (np.minimum.outer(place, place) + np.where(lag == 0.0, 1.0 / 3.0, 0.5)),
        "Q": (2.0 * (lag == 0.0) - (lag == 1.0)) / each**2,
    }[name]
    want = np.trace(covariance) / windows - covariance.mean()
    assert averages_variance(name, 1.0, each, windows) == pytest.approx(want, rel=6e-3)


def test_flicker_that_a_run_hardly_tells_is_in_the_interval():
    want, held = expected(24, 1.2, 0.05, 300.0), 0
    for seed in range(12):
        white = 1.2 * np.random.default_rng(seed).normal(size=7200)
        slow = Flicker(0.05, 1.0, np.random.default_rng(seed + 100)).block(7200)
        found = noise_floor(white + slow, 1.0, 300.0)
        assert found.lower <= found.value <= found.upper < 3.0 * found.value
        held += found.lower <= want <= found.upper
    assert held >= 9


def test_a_floor_is_continuous_in_its_data():
    for seed in (3, 4):
        series = flicker_noise(seed) + chamber_drift()
        found = [noise_floor(series[rows:], 1.0, 100.0) for rows in (0, 50, 120, 127, 130, 150)]
        error = (found[0].upper - found[0].lower) / (2 * 1.645)
        assert np.ptp([f.value for f in found]) < error


def test_random_walk_is_drift_but_in_a_static_run():
    rng = np.random.default_rng(11)
    walk = 0.3 * rng.normal(size=36_000) + np.cumsum(0.01 * rng.normal(size=36_000))
    as_drift, static = (noise_floor(walk, 1.0, 100.0, drifts=drifts).value for drifts in (True, False))
    assert as_drift < 0.1 < 0.3 < static
    want = np.sqrt(0.01**2 * 36_000 / 6.0)
    assert static == pytest.approx(want, rel=0.3)


def test_a_dither_line_does_not_lift_it():
    rng = np.random.default_rng(7)
    time = np.arange(200_000) * 0.01
    y = 60.0 * np.sin(2 * np.pi * time / 0.3) + rng.normal(size=200_000)
    averages = y.reshape(-1, 1000).mean(axis=1)
    assert noise_floor(y, 0.01, 10.0).value < 2.0 * averages.std()


def test_segments_are_not_joined():
    rng = np.random.default_rng(8)
    bursts = 0.3 * rng.normal(size=(300, 170)) + 100.0 * rng.normal(size=(300, 1))
    segments = [slice(170 * i, 170 * (i + 1)) for i in range(300)]
    got = noise_floor(bursts.ravel(), 0.017, 100.0, segments=segments)
    want = 0.3 / np.sqrt(100.0 / 0.017)
    # Three seconds in a row say little of flicker at a hundred: the interval says so.
    assert got.lower <= want <= got.upper and got.value < 2.0 * want


def test_unit_and_short_series():
    rng = np.random.default_rng(9)
    y = rng.normal(size=5000)
    large, small = noise_floor(1000 * y + 1e6, 0.1, 10.0), noise_floor(y, 0.1, 10.0)
    assert large.value == pytest.approx(1000 * small.value, rel=1e-4)
    assert 0.3 < noise_floor(y[:20], 1.0, 1.0).value < 3.0
    assert noise_floor(np.ones(50), 1.0, 10.0).value == 0.0


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_what_is_loud_is_so_in_any_unit(unit):
    """A block thrice as loud is noise still, one ten times as loud is left out."""
    for times, parts in ((1.5, [(0, 3200)]), (10.0, [(0, 1000), (1200, 3200)])):
        values = np.random.default_rng(5).standard_normal(3200)
        values[1000:1200] *= times
        found = quiet_parts(unit * values, np.array([0]), np.array([3200]), 1)
        assert len(found) == len(parts)
        assert np.abs(np.array(found) - np.array(parts)).max() <= 2 * 3199 // 32


def test_stretches_of_three_rows_are_kept():
    assert quiet_parts(np.zeros(9), np.array([0, 4, 6]), np.array([3, 6, 9]), 1) == [(0, 3), (6, 9)]


def test_variance_of_fast_noise_is_known_as_well_as_its_coefficients():
    """Of squares of normal coefficients, many times over."""
    rng, frequency = np.random.default_rng(6), np.linspace(0.05, 0.5, 5)[:, None]
    count, power = np.full(5, 20.0), np.array([4.0, 3.0, 2.0, 1.0, 0.5])

    def of(power):
        return FastNoise(0.05, frequency, power, count, 200.0, 1.0).averages_variance(10.0, 50)

    drawn = [of(power * rng.chisquare(count) / count)[0] for _ in range(4000)]
    value, variance = of(power)
    assert np.mean(drawn) == pytest.approx(value, rel=0.02)
    assert np.var(drawn) == pytest.approx(variance, rel=0.1)
