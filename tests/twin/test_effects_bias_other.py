"""Bias effects that are static in temperature or driven otherwise, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import bisect

from fogml.runs.facts import Facts, Heading
from fogml.runs.run import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.optics import Coil
from fogml.twin.registry import effect

N = 3600
TIME = np.arange(float(N))


def inputs(temperature: FloatArray | None = None, **changes: object) -> Inputs:
    held = np.full(N, 25.0) if temperature is None else temperature
    given = Inputs(time=TIME, temperatures={"T": held}, table_rate=np.zeros(N))
    return replace(given, **changes)  # type: ignore[arg-type]


def response(id: str, given: Inputs, **shape: float) -> FloatArray:
    declared = effect(id)
    return declared.response(given, **{**declared.default_shape(), **shape})


SWEEP = np.linspace(-40.0, 60.0, N)


def test_polynomial_has_the_orders_above_the_nominal() -> None:
    found = response("bias_polynomial", inputs(SWEEP), quartic_ratio=0.5, quintic_ratio=-2.0)
    fitted = np.polynomial.Polynomial.fit(SWEEP, found, 5).convert(domain=[-25.0, 75.0], window=[-1.0, 1.0])
    assert fitted.coef == pytest.approx([0.0, 0.0, 0.0, 1.0, 0.5, -2.0], abs=1e-9)


def test_polarisation_ripple_is_periodic_in_the_electronics_temperature() -> None:
    given = inputs(np.full(N, 40.0))
    given = replace(given, temperatures={**given.temperatures, "T_electronics": SWEEP})
    found = response("polarization_nonreciprocity", given, period=3.1, phase=90.0)
    assert found == pytest.approx(np.cos(2.0 * np.pi * (SWEEP - 25.0) / 3.1))
    crossings = SWEEP[1:][np.diff(np.sign(found)) != 0]
    assert np.diff(crossings) == pytest.approx(1.55, abs=0.06)


def test_recorded_field_acts_by_its_direction() -> None:
    drives = {"B_x": np.full(N, 30.0), "B_y": np.full(N, 40.0), "B_z": np.full(N, -20.0)}
    along = np.degrees(np.arctan2(40.0, 30.0))
    given = inputs(drives=drives)
    assert response("magnetic", given, phase=along, axial_ratio=0.0) == pytest.approx(0.5)  # 50 uT
    assert response("magnetic", given, phase=along + 90.0, axial_ratio=0.25) == pytest.approx(-0.05)


def test_a_turn_in_earths_field_is_one_sinusoid() -> None:
    given = inputs(table_rate=np.full(N, 1.0))  # ten turns in an hour
    found = response("magnetic", given, phase=30.0, axial_ratio=0.0)
    line = np.abs(np.fft.rfft(found)) / (N / 2)
    assert line[10] == pytest.approx(0.2, rel=1e-3)
    assert np.delete(line, 10).max() < 1e-3


def test_crosstalk_follows_electronics_and_supply() -> None:
    supply = np.where(TIME < 1000.0, 28.0, 28.5)
    given = inputs(SWEEP, drives={"supply": supply})
    found = response("electronic_crosstalk", given, supply_ratio=4.0)
    assert found == pytest.approx(SWEEP - 25.0 + np.where(TIME < 1000.0, 0.0, 2.0))
    assert response("electronic_crosstalk", inputs(SWEEP), supply_ratio=4.0) == pytest.approx(SWEEP - 25.0)


def test_intensity_modulation_in_microradian() -> None:
    flat = response("intensity_modulation", inputs(), modulation_depth=90.0)
    assert flat == pytest.approx(1.0 / 6.5554, rel=1e-4)
    hot = inputs(np.full(N, 75.0))
    found = response("intensity_modulation", hot, modulation_depth=135.0, halfwave_coefficient=1000.0)
    assert found == pytest.approx(1.0 / np.tan(np.radians(67.5 / 1.05)) / 6.5554, rel=1e-4)


@pytest.mark.parametrize("depth", [60.0, 90.0, 157.5])
def test_intensity_modulation_is_where_two_state_detection_comes_to_rest(depth: float) -> None:
    """Root of the difference of the two states' powers, found by bisection."""
    m, phi = 1e-6, np.radians(depth)

    def difference(error: float) -> float:
        plus, minus = (1.0 + m) * (1.0 + np.cos(phi + error)), (1.0 - m) * (1.0 + np.cos(phi - error))
        return float(plus - minus)

    wanted = bisect(difference, -1e-3, 1e-3, xtol=1e-18, rtol=1e-12)
    found = response("intensity_modulation", inputs(), modulation_depth=depth)[0] * 6.5554
    assert found == pytest.approx(1e6 * wanted, rel=1e-4)


def test_kerr_follows_the_power() -> None:
    found = response("kerr", inputs(np.full(N, 75.0)), power_coefficient=-0.02)
    assert found == pytest.approx(10.0**-0.1)  # 1 dB less


def test_mismatch_is_the_drift_of_the_proper_frequency() -> None:
    found = response("proper_frequency_mismatch", inputs(SWEEP))
    coil = Coil()
    for temperature, value in ((SWEEP[0], found[0]), (SWEEP[-1], found[-1])):
        u = temperature - 25.0
        warm = Coil(length=1000.0 * (1.0 + 0.55e-6 * u), index=1.4525 + 0.97e-5 * u)
        assert value == pytest.approx(coil.proper_frequency_hz / warm.proper_frequency_hz - 1.0, abs=2e-8)
    assert 1e6 * np.ptp(found) == pytest.approx(700.0, abs=30.0)


def test_supply_steps_and_ripple_line() -> None:
    supply = np.where(TIME < 1800.0, 12.0, 12.3)
    given = inputs(drives={"supply": supply})
    assert response("supply_ripple", given, ripple=0.0) == pytest.approx(supply - 12.0)
    found = response("supply_ripple", inputs(), ripple=0.2, alias_frequency=36.0 / N, phase=60.0)
    spectrum = np.fft.rfft(found) / (N / 2)
    assert np.abs(spectrum).argmax() == 36
    assert spectrum[36] == pytest.approx(0.2 * np.exp(1j * np.radians(60.0 - 90.0)))


def test_turn_on_bias_steps_at_power_cycles_only() -> None:
    assert response("turn_on_bias", inputs(powered_on_s=0.0)) == pytest.approx(1.0)
    found = response("turn_on_bias", inputs(powered_on_s=0.0, power_ons_s=(1000.0, 2000.0)))
    assert np.flatnonzero(np.diff(found)).tolist() == [999, 1999]
    assert found[0] == 1.0


def test_turn_on_biases_of_many_cycles_are_standard_normal() -> None:
    found = response("turn_on_bias", inputs(power_ons_s=tuple(range(1, N))))[1:]
    assert abs(found.mean()) < 4.0 / np.sqrt(N)
    assert found.std() == pytest.approx(1.0, abs=0.05)


def test_ageing_slows_down() -> None:
    found = response("ageing", inputs(), time_constant=3600.0)
    assert found[0] == 0.0
    assert found[-1] == pytest.approx(np.log(1.0 + 3599.0 / 3600.0))
    assert np.diff(found)[0] == pytest.approx(1.0 / 3600.0, rel=1e-3)
    year = effect("ageing").amplitude.typical() * np.log1p(365.25 * 24.0 / 100.0)
    assert 0.1 < year < 1.0


def test_radiation_is_a_power_law_of_dose_and_rate() -> None:
    given = inputs(drives={"dose": 1.0 + TIME / 1800.0}, table_rate=np.full(N, 10.0))
    ppm = effect("radiation").signature(given, dose_exponent=0.7, rate_exponent=0.2)
    assert ppm[500:] == pytest.approx((1.0 + TIME[500:] / 1800.0) ** 0.7 * 2.0**0.2)
    assert not effect("radiation").signature(inputs(), dose_exponent=0.7, rate_exponent=0.2).any()
    shown = response("radiation", replace(given.afresh(), cache={}), dose_exponent=0.7, rate_exponent=0.2)
    assert shown == pytest.approx(0.036 * ppm)


def test_warm_up_fades_from_each_power_on() -> None:
    shape = {"fast_time_constant": 100.0, "slow_time_constant": 1000.0, "slow_ratio": 0.5}
    found = response("warmup_bias", inputs(powered_on_s=-50.0, power_ons_s=(2000.0,)), **shape)
    for second, on in ((0, 50.0), (700, 750.0), (2000, 0.0), (3000, 1000.0)):
        assert found[second] == pytest.approx(np.exp(-on / 100.0) + 0.5 * np.exp(-on / 1000.0))
    assert not response("warmup_bias", inputs(), **shape).any()  # on since long before


@pytest.mark.parametrize(
    ("axis", "wanted"),
    [("up", 1.0), ("down", -1.0), ("north", 0.3), (Heading(heading=77.0), 0.3), (None, 0.0)],
)
def test_weight_acts_by_attitude(axis: object, wanted: float) -> None:
    given = inputs(facts=Facts(input_axis=axis))  # type: ignore[arg-type]
    assert response("g_sensitivity", given, cross_ratio=0.3) == pytest.approx(wanted)
