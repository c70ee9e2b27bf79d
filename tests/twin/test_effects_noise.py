"""Noise terms of the catalogue: units against the toolkit's own reading of an Allan deviation."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.signals.allan import allan_deviation
from fogml.signals.noise_terms import noise_terms_of
from fogml.twin.effect import NoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.optics import Coil
from fogml.twin.registry import effect
from tests.twin.allan import allan_variance

COUNT, SAMPLE_S = 1 << 16, 2.0
TERMS = {
    "quantisation": ("Q", "urad", 3.0),
    "angle_random_walk": ("N", "deg/sqrt(h)", 0.02),
    "bias_instability": ("B", "deg/h", 0.3),
    "rate_random_walk": ("K", "deg/h/sqrt(h)", 0.4),
    "rate_ramp": ("R", "deg/h/h", 0.05),
}


def noise(id: str) -> NoiseEffect:
    found = effect(id)
    assert isinstance(found, NoiseEffect)
    return found


def draw(id: str, amplitude: float, seed: int = 3, sample_s: float = SAMPLE_S, **shape: float) -> FloatArray:
    declared = noise(id)
    full = {**declared.default_shape(), **shape}
    return declared.draw(np.random.default_rng(seed), COUNT, sample_s, amplitude, **full)


@pytest.mark.parametrize("id", TERMS)
def test_term_is_read_back_in_its_unit(id: str) -> None:
    name, unit, amplitude = TERMS[id]
    assert effect(id).amplitude.unit == unit
    found = noise_terms_of(draw(id, amplitude), SAMPLE_S, 0.99).terms[name]  # type: ignore[index]
    assert found.unit == unit
    assert found.fitted == pytest.approx(amplitude, rel=0.15)
    assert found.lower <= amplitude <= found.upper or id == "rate_ramp"


def test_terms_agree_with_the_twins_noise_source() -> None:

    taus = np.array([2.0, 16.0, 128.0])
    for id, (name, _, amplitude) in TERMS.items():
        expected = np.sqrt(allan_variance(taus, **{name: amplitude}))
        found = allan_deviation(draw(id, amplitude), SAMPLE_S, taus)
        assert found.adev == pytest.approx(expected, rel=0.12), id


@pytest.mark.parametrize("depth", [np.pi / 2, 3 * np.pi / 4, 7 * np.pi / 8])
@pytest.mark.parametrize("coil", [Coil(), Coil(length=500.0, diameter=0.06)])
def test_photon_noise_of_the_units_coil(depth: float, coil: Coil) -> None:
    """Written out for 20 uW; polarised Gaussian light has 2 sqrt(2 ln 2 / pi) over its line width."""
    given = Inputs(np.arange(1.0), {"T_electronics": np.full(1, 25.0)}, np.zeros(1), coil=coil)
    found = effect("arw_physics").strength(given, power=20.0, modulation_depth=depth, power_loss=0.03)[0]
    current = 0.9 * 20e-6 * (1.0 + np.cos(depth)) / 2.0
    excess = 2.0 * np.sqrt(2.0 * np.log(2.0) / np.pi) * 1550e-9**2 / (299_792_458.0 * 10e-9)
    density = 2 * 1.602176634e-19 * current + 4 * 1.380649e-23 * 300.0 / 100e3 + current**2 * excess
    density /= (0.9 * 20e-6 * np.sin(depth) / 2.0) ** 2
    sagnac = 2.0 * np.pi * coil.length * coil.diameter / (1550e-9 * 299_792_458.0)
    assert found == pytest.approx(np.degrees(np.sqrt(density / 2.0) / sagnac) * 60.0, rel=1e-6)


def test_vibration_makes_noise_in_proportion() -> None:
    vibration = np.array([0.0, 0.02, 0.04])
    given = Inputs(np.arange(3.0), {"T": np.zeros(3)}, np.zeros(3), drives={"vibration": vibration})
    assert effect("vibration_noise").strength(given) == pytest.approx(vibration)
    series = draw("vibration_noise", 0.02)
    assert float(np.std(series) * np.sqrt(SAMPLE_S / 3600.0)) == pytest.approx(0.02, rel=0.015)


def test_hump_of_a_line_lies_at_0_371_of_its_period() -> None:
    """Allan variance of a sine: (sin(x)**2 / x)**2 with x = pi f tau."""
    period = 200.0
    taus = np.arange(40.0, 120.0, 2.0)
    wave = np.sin(2.0 * np.pi * np.arange(400_000) / (period / SAMPLE_S))
    found = allan_deviation(wave, SAMPLE_S, taus)
    assert found.taus_s[np.argmax(found.adev)] / period == pytest.approx(0.371, abs=0.006)
    x = np.pi * found.taus_s / period
    assert found.adev == pytest.approx(np.sin(x) ** 2 / x, rel=0.01)


def test_hump_of_a_gauss_markov_process() -> None:
    """IEEE Std 952: 0.437 q_c sqrt(T_c) at 1.89 T_c, with A = q_c sqrt(T_c / 2)."""
    series = draw("gauss_markov", 0.5, sample_s=10.0, time_constant=60.0)
    found = allan_deviation(series, 10.0, np.arange(20.0, 400.0, 10.0))
    q = 0.5 * np.sqrt(2.0 / 60.0)
    assert found.adev.max() == pytest.approx(0.437 * q * np.sqrt(60.0), rel=0.05)
    assert found.taus_s[np.argmax(found.adev)] == pytest.approx(1.89 * 60.0, rel=0.3)


def test_line_has_another_phase_in_each_draw_and_its_own_frequency() -> None:
    first, second = (draw("sinusoidal", 0.2, seed, frequency=0.01) for seed in (1, 2))
    for series in (first, second):
        peak = np.fft.rfftfreq(COUNT, SAMPLE_S)[np.argmax(np.abs(np.fft.rfft(series)))]
        assert peak == pytest.approx(0.01, abs=1e-5)
        assert np.sqrt(2.0) * np.std(series) == pytest.approx(0.2, rel=0.01)
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.999


def test_outliers_are_rare_and_large() -> None:
    series = draw("outliers_dropouts", 50.0, probability=1e-3, mean_length=1.0)
    hit = np.count_nonzero(series)
    assert hit == pytest.approx(COUNT * 1e-3, rel=0.35)
    assert np.std(series[series != 0.0]) == pytest.approx(50.0, rel=0.3)


def test_candidates_are_those_of_the_standard() -> None:
    assert all(effect(id).candidate for id in (*TERMS, "gauss_markov", "sinusoidal"))
    assert not effect("arw_physics").candidate and not effect("outliers_dropouts").candidate
