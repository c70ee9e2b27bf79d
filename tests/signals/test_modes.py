"""Responses of a decaying mode against high precision and quadrature."""

from __future__ import annotations

import math
from decimal import Decimal, getcontext

import pytest
from scipy.integrate import quad

from fogml.signals.modes import faded, held, phi_functions, windowed

getcontext().prec = 60


@pytest.mark.parametrize("x", [0.0, 1e-12, 1e-6, 1e-3, 0.02, 0.0499, 0.0501, 0.3, 2.0, 30.0, 1e3])
def test_phi_functions_are_exact_to_rounding(x: float) -> None:
    decay, phi_1, phi_2 = phi_functions(x)
    if x == 0.0:
        assert (decay, phi_1, phi_2) == (1.0, 1.0, 0.5)
        return
    exact = Decimal(x)
    fall = (-exact).exp()
    first = (1 - fall) / exact
    assert decay == pytest.approx(float(fall), abs=3e-16)
    assert phi_1 == pytest.approx(float(first), rel=4e-16)
    # The worst place is where the series ends.
    assert phi_2 == pytest.approx(float((1 - first) / exact), rel=1e-14)


@pytest.mark.parametrize("rate", [1e-6, 2e-3, 2.0000001e-3, 0.5])
@pytest.mark.parametrize("step", [1e-3, 1.0, 700.0])
def test_a_fading_input_is_met_at_any_pair_of_rates(rate: float, step: float) -> None:
    expected, _ = quad(lambda t: math.exp(-rate * (step - t) - 2e-3 * t), 0.0, step, epsabs=0.0, epsrel=1e-12)
    assert faded(rate, 2e-3, step) == pytest.approx(expected, rel=1e-10)
    assert held(rate, step) == pytest.approx(-math.expm1(-rate * step) / rate, rel=1e-13)


@pytest.mark.parametrize(
    ("on", "off"),
    [(-50.0, 1000.0), (10.0, 1000.0), (20.0, 60.0), (-50.0, 30.0), (100.0, 200.0), (-9.0, -3.0)],
)
def test_a_window_acts_only_while_it_lasts(on: float, off: float) -> None:
    rate, source = 0.01, (2.0, 3.0, 0.02)

    def push(t: float) -> float:
        return (2.0 + 3.0 * math.exp(-0.02 * (t - on))) * math.exp(-rate * (90.0 - t))

    begin, end = max(0.0, on), min(90.0, off)
    expected = quad(push, begin, end)[0] if end > begin else 0.0
    assert windowed(rate, 0.0, 90.0, on, off, source) == pytest.approx(expected, rel=1e-10)


def test_a_window_open_since_ever_has_only_its_steady_part() -> None:
    assert windowed(0.01, -math.inf, 0.0, -math.inf, math.inf, (2.0, 3.0, 0.02)) == pytest.approx(200.0)
