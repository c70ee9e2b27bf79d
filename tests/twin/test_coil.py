"""Windings and layers of the coil against worked numbers, plain integrals and symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from fogml.errors import InputError
from fogml.twin.coil import (
    WINDINGS,
    LayeredCoil,
    Winding,
    layer_weights,
    lead_sensitivity,
    midpoint_sensitivity,
    radial_sensitivity,
    winding_order,
)
from fogml.twin.optics import DEG_H, REFERENCE_COIL, Coil

TIME = np.arange(0.0, 4000.0, 1.0)


def shupe_integral(position: ArrayLike, rate: ArrayLike, coil: Coil = REFERENCE_COIL) -> float:
    """The rate error [deg/h] of a distribution of temperature rates along the fibre.

    Linear between positions [m] and rates [degC/min] there.
    """
    z = np.asarray(position, dtype=np.float64)
    slope = np.asarray(rate, dtype=np.float64) / 60.0
    length = float(z[-1] - z[0])
    lever = 2.0 * (z - z[0]) - length
    # Exact for rates and levers linear between the positions (Simpson's rule on each piece).
    middle = 0.25 * (lever[1:] + lever[:-1]) * (slope[1:] + slope[:-1])
    pieces = (lever[1:] * slope[1:] + lever[:-1] * slope[:-1] + 4.0 * middle) / 6.0
    factor = coil.index * coil.phase_slope / (length * coil.diameter)
    return float(factor * np.sum(pieces * np.diff(z)) / DEG_H)


def face(lag_s: float) -> np.ndarray:
    """A face that is lag_s behind a ramp of 1 degC/min from time 0."""
    return 25.0 + (TIME - lag_s * (1.0 - np.exp(-TIME / lag_s))) / 60.0


@pytest.mark.parametrize(
    ("winding", "peak", "slack"),
    [("cylinder", 22.0, 0.6), ("dipole", 1.7, 0.1), ("quadrupole", 0.22, 0.015), ("octupole", 0.05, 0.005)],
)
def test_onset_of_a_ramp_and_its_plateau(winding: Winding, peak: float, slack: float) -> None:
    travelled = LayeredCoil(Coil(winding=winding)).travelled(TIME, face(240.0), face(120.0))
    drift = 60.0 * np.diff(travelled)
    assert np.abs(drift).max() == pytest.approx(peak, abs=slack)
    assert np.abs(drift[-1]) < 1e-4 * np.abs(drift).max()


def test_midpoint_error() -> None:
    assert midpoint_sensitivity() == pytest.approx(1.05, abs=5e-3)
    assert midpoint_sensitivity(Coil(diameter=0.05)) == pytest.approx(2.0 * midpoint_sensitivity())
    assert lead_sensitivity() == 0.5 * midpoint_sensitivity()


@pytest.mark.parametrize("delta", [0.01, 0.5, 2.0])
def test_midpoint_error_is_a_lead_at_rest_in_the_integral(delta: float) -> None:
    # The coil warms at 1 degC/min, one lead of 2 delta at its end does not.
    coil_m = 1000.0
    position = [0.0, coil_m, coil_m + 1e-9, coil_m + 2.0 * delta]
    found = shupe_integral(position, [1.0, 1.0, 0.0, 0.0])
    assert found == pytest.approx(-midpoint_sensitivity() * delta, rel=2.0 * delta / coil_m + 1e-6)


def test_integral_is_that_of_the_half_coil_form() -> None:
    # Omega = n c_T / (L D) Int_0^{L/2} (L - 2z) [Tdot(L - z) - Tdot(z)] dz, by a fine sum.
    coil = Coil(length=800.0)
    z = np.linspace(0.0, 800.0, 4001)

    def rate(at: np.ndarray) -> np.ndarray:
        return 0.3 + np.sin(at / 90.0) + 1e-6 * at**2

    h = 0.5 * 800.0 / 400000
    half = (np.arange(400000) + 0.5) * h
    total = np.sum((800.0 - 2.0 * half) * (rate(800.0 - half) - rate(half))) * h / 60.0
    factor = coil.index * (0.97e-5 + coil.index * 0.55e-6) / (800.0 * 0.1)
    wanted = np.degrees(factor * total) * 3600.0
    assert shupe_integral(z, rate(z), coil) == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize("winding", WINDINGS)
def test_layer_weights_are_the_integral_of_one_warming_layer(winding: Winding) -> None:
    layers, weights = 16, layer_weights(Coil(winding=winding, layers=16))
    order = winding_order(winding, layers)
    edges = np.linspace(0.0, 1000.0, layers + 1)
    position = np.stack([edges[:-1] + 1e-9, edges[1:] - 1e-9], axis=1).ravel()
    for layer in range(layers):
        rate = np.repeat((order == layer).astype(float), 2)
        assert weights[layer] == pytest.approx(shupe_integral(position, rate), abs=1e-6)


@given(st.sampled_from(WINDINGS), st.integers(1, 12))
def test_weights_add_to_nothing_and_each_layer_occurs_once(winding: Winding, eighths: int) -> None:
    weights = layer_weights(Coil(winding=winding, layers=8 * eighths))
    assert abs(weights.sum()) < 1e-12 * np.abs(weights).sum()
    assert sorted(winding_order(winding, 8 * eighths)) == list(range(8 * eighths))


def test_each_winding_lets_less_through() -> None:
    passed = [abs(radial_sensitivity(Coil(winding=winding))) for winding in WINDINGS]
    assert passed[0] > 10.0 * passed[1] > 100.0 * passed[2]
    assert passed[3] < 1e-9  # an octupole cancels a linear profile


def test_windings_alternate_as_their_names_say() -> None:
    assert winding_order("dipole", 4).tolist() == [2, 0, 1, 3]
    assert winding_order("quadrupole", 8).tolist() == [7, 4, 3, 0, 1, 2, 5, 6]


def test_layers_settle_on_the_straight_line_between_the_faces() -> None:
    coil = LayeredCoil(Coil(layers=8))
    time = np.linspace(0.0, 1000.0, 50)
    end = coil.temperatures(time, np.full(50, 20.0), np.where(time > 0.0, 30.0, 20.0))[-1]
    assert end == pytest.approx(np.linspace(20.0, 30.0, 8), abs=1e-6)


def test_slowest_change_of_the_profile() -> None:
    coil = LayeredCoil(Coil(layers=64, pitch=0.1e-3))
    time = np.arange(0.0, 10.0 * coil.settling_s, coil.settling_s / 50.0)
    outer = np.where(time > 0.0, 30.0, 20.0)
    middle = coil.temperatures(time, np.full(len(time), 20.0), outer)[:, 32]
    left = np.abs(middle - middle[-1])
    late = slice(100, 250)
    rate = -np.polyfit(time[late], np.log(left[late]), 1)[0]
    assert 1.0 / rate == pytest.approx(coil.settling_s, rel=5e-3)


def test_faults_are_refused() -> None:
    with pytest.raises(InputError, match="windings are cylinder, dipole"):
        winding_order("sextupole")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="multiple of 4 layers, not 30"):
        winding_order("quadrupole", 30)
    with pytest.raises(InputError, match="lies between 3 and 1000 layers"):
        LayeredCoil(Coil(winding="dipole", layers=2))
