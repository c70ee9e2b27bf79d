"""How well windows see the rate of temperature: the known figures for coarse sensors."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.features.parse import parse_features
from fogml.runs.run import Run


def steps_of_ten_degrees() -> tuple[np.ndarray, np.ndarray]:
    """-40 to 70 degC at 1 Hz: 10 min ramps of 1 degC/min and 30 min soaks: rate and temperature."""
    rate = np.concatenate([np.zeros(1800), *[np.r_[np.ones(600), np.zeros(1800)]] * 11])
    return rate, -40.0 + np.cumsum(rate) / 60.0


def measured(temperature: np.ndarray, step: float, noise: float) -> Run:
    rng = np.random.default_rng(11)
    read = np.round((temperature + noise * rng.normal(size=len(temperature))) / step) * step
    time = np.arange(float(len(read)))
    return Run.from_columns(time=time, gyro=np.zeros(len(read)), T=read)


@pytest.mark.parametrize(
    ("text", "noise", "wanted", "within"),
    [
        ("dT", 0.02, 0.894, 0.005),
        ("dT[first]", 0.02, 0.215, 0.008),
        ("dT[first]", 0.0, 0.46, 0.01),
    ],
)
def test_correlation_with_the_true_rate(text: str, noise: float, wanted: float, within: float) -> None:
    rate, temperature = steps_of_ten_degrees()
    values, full, _ = parse_features(text).atom_values(measured(temperature, 1.0 / 16.0, noise))
    assert np.corrcoef(values[full, 0], rate[full])[0, 1] == pytest.approx(wanted, abs=within)


def test_a_first_difference_is_lost_in_noise_where_windows_are_not() -> None:
    """10 degC/h at 1 Hz is 0.0028 degC a sample; the sensor steps by 0.01 degC with 0.005 degC noise."""
    change = 10.0 / 3600.0
    run = measured(change * np.arange(20 * 3600.0), 0.01, 0.005)
    values, full, _ = parse_features("diff(T)[first], diff(T)").atom_values(run)
    signal, spread = values[full].mean(axis=0), values[full].std(axis=0)
    assert signal[0] == pytest.approx(change, rel=1e-3)
    assert signal[0] / spread[0] == pytest.approx(0.34, abs=0.01)
    assert signal[1] / spread[1] > 100.0
