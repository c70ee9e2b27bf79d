"""Effects on the scale factor against closed forms and worked figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.twin.inputs import Inputs
from fogml.twin.registry import effect

N = 3600
TIME = np.arange(float(N))
SWEEP = np.linspace(-40.0, 60.0, N)


def inputs(rate: FloatArray | float = 10.0, **changes: object) -> Inputs:
    given = Inputs(time=TIME, temperatures={"T": SWEEP}, table_rate=np.full(N, rate, dtype=np.float64))
    return replace(given, **changes)  # type: ignore[arg-type]


def signature(id: str, given: Inputs, **shape: float) -> FloatArray:
    declared = effect(id)
    return declared.signature(given, **{**declared.default_shape(), **shape})


def test_wavelength_follows_the_source_and_expansion_the_coil() -> None:
    apart = inputs(temperatures={"T": SWEEP, "T_electronics": np.full(N, 35.0)})
    assert np.array_equal(signature("source_wavelength", apart), np.full(N, -10.0))
    assert np.array_equal(signature("coil_expansion", apart), SWEEP - 25.0)


def test_a_ppm_of_ten_deg_s_is_36_thousandths_deg_h() -> None:
    declared = effect("coil_expansion")
    response = declared.response(inputs(10.0, temperatures={"T": np.full(N, 26.0)}))
    assert response == pytest.approx(0.036, rel=1e-12)


def test_expansion_is_one_with_the_nominal_slope() -> None:
    from fogml.twin.nominal import nominal_columns

    given = inputs(-3.0, earth_deg_h=7.5)
    response = effect("coil_expansion").response(given)
    assert np.array_equal(response, nominal_columns(given)["k1"])


def test_halfwave_error_is_whole_at_power_on_and_the_residual_later() -> None:
    """a_v itself at power-on: the amplitude over the residual."""
    given = inputs(powered_on_s=0.0, temperatures={"T": np.full(N, 45.0)})
    found = signature("halfwave_voltage", given, residual=0.01, time_constant=20.0)
    assert found[0] == pytest.approx(20.0 / 0.01)
    assert found[-1] == pytest.approx(20.0, rel=1e-9)
    assert found[20] - 20.0 == pytest.approx((found[0] - 20.0) / np.e)
    settled = signature("halfwave_voltage", inputs(temperatures={"T": np.full(N, 45.0)}))
    assert np.array_equal(settled, np.full(N, 20.0))


def test_nonlinearity_is_even_and_its_amplitude_holds_at_100_deg_s() -> None:
    rates = np.linspace(-150.0, 150.0, N)
    for quadratic in (0.0, 0.3, 1.0):
        found = signature("sf_nonlinearity", inputs(rates), quadratic_share=quadratic)
        assert found == pytest.approx(found[::-1], abs=1e-12)
        assert np.interp(100.0, rates, found) == pytest.approx(1.0, abs=1e-3)
    halfway = np.interp(50.0, rates, signature("sf_nonlinearity", inputs(rates), quadratic_share=1.0))
    assert halfway == pytest.approx(0.25, abs=1e-3)


def test_nonlinearity_ripple_has_its_period_in_rate() -> None:
    rates = np.linspace(1.0, 61.0, N)
    smooth = signature("sf_nonlinearity", inputs(rates), ripple_share=0.0)
    found = signature("sf_nonlinearity", inputs(rates), ripple_share=0.2, ripple_period=15.0) - smooth
    spectrum = np.abs(np.fft.rfft(found[:-1]))
    assert np.argmax(spectrum) == 4
    assert np.abs(found).max() == pytest.approx(0.2, rel=1e-4)


def test_asymmetry_is_half_of_the_difference_of_the_two_scale_factors() -> None:
    declared, amplitude = effect("sf_asymmetry"), 40.0
    up = 36000.0 + amplitude * declared.response(inputs(10.0))
    down = -36000.0 + amplitude * declared.response(inputs(-10.0))
    plus, minus = up / 36000.0, down / -36000.0
    assert plus - minus == pytest.approx(80e-6, rel=1e-9)
    # A bias that grows with the rate.
    assert (up + down) / 2.0 == pytest.approx(36000.0 * 40e-6, rel=1e-9)


def test_scale_factor_loop_opens_by_twice_the_amplitude() -> None:
    there_and_back = np.concatenate([SWEEP, SWEEP[::-1], SWEEP])
    time = np.arange(float(3 * N))
    given = Inputs(time, {"T": there_and_back}, np.ones(3 * N))
    found = signature("sf_hysteresis", given, half_width=8.0)
    down, up = found[N : 2 * N][::-1], found[2 * N :]
    middle = (SWEEP > -20.0) & (SWEEP < 40.0)
    assert (down - up)[middle] == pytest.approx(2.0)


def test_a_tuning_fork_runs_slow_on_both_sides_of_its_turnover() -> None:
    found = signature("time_base", inputs(), turnover_temperature=10.0, parabolic_share=1.0)
    u = inputs().temperature("T_electronics") - 10.0
    assert 85.0 * found == pytest.approx(0.034 * u**2)


def test_an_at_cut_is_a_cubic_with_two_turnovers() -> None:
    """Frequency a_1 u + a_3 u**3 with a_3 = 1.05e-4 ppm/degC3: counts per second are off the other way."""
    found = signature("time_base", inputs(), turnover_temperature=10.0, linear_share=0.75)
    u = inputs().temperature("T_electronics") - 10.0
    a_3 = 1.05e-4
    frequency = a_3 * u**3 - 3.0 * a_3 * 25.0**2 * u
    assert a_3 * 50.0**3 * found == pytest.approx(-frequency, abs=1e-9)
    assert abs(u[np.argmax(np.where(np.abs(u) < 40.0, found, -9.0))]) == pytest.approx(25.0, abs=0.2)
