"""The conduction line against closed forms of the heat equation in a cylinder."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0, y0

from fogml.errors import InputError
from fogml.twin.plant.coil import RadialLine, with_line
from fogml.twin.plant.network import PlantState
from fogml.twin.plant.standard import ThermalConstants, standard_network

INNER, OUTER, KAPPA = 0.04, 0.05, 2e-7


def line(layers: int) -> RadialLine:
    return RadialLine(INNER, OUTER, KAPPA, layers)


def ramp_profile(r: np.ndarray) -> np.ndarray:
    """T - T_face per unit of rate [s] in a steady ramp of both faces: r^2 / 4 kappa + A ln r + B."""
    slope = -(OUTER**2 - INNER**2) / (4 * KAPPA * np.log(OUTER / INNER))
    return (r**2 - INNER**2) / (4 * KAPPA) + slope * np.log(r / INNER)


def test_steady_ramp_of_both_faces_has_the_closed_profile() -> None:
    coil, rate = line(32), 1.0 / 60.0
    time = np.linspace(0.0, 20_000.0, 201)
    face = 20.0 + rate * time
    behind = (coil.temperatures(time, face, face)[:, -1] - face[-1]) / rate
    expected = ramp_profile(coil.radii)
    np.testing.assert_allclose(behind, expected, atol=2e-3 * np.abs(expected).max())


def test_error_falls_with_the_square_of_the_number_of_layers() -> None:
    time = np.linspace(0.0, 20_000.0, 201)
    errors = []
    for layers in (8, 16, 32):
        coil = line(layers)
        layer = coil.temperatures(time, time / 60.0, time / 60.0)[:, -1]
        errors.append(np.abs(60.0 * (layer - time[-1] / 60.0) - ramp_profile(coil.radii)).max())
    assert [a / b for a, b in pairwise(errors)] == pytest.approx([4.0, 4.0], rel=0.15)


def test_steady_state_between_two_faces_is_logarithmic() -> None:
    coil = line(20)
    time = np.array([0.0, 1e5])
    layer = coil.temperatures(time, np.full(2, 30.0), np.full(2, 10.0))[:, -1]
    expected = 10.0 + 20.0 * np.log(coil.radii / INNER) / np.log(OUTER / INNER)
    np.testing.assert_allclose(layer, expected, rtol=1e-12)


def test_slowest_decay_is_the_zero_of_the_bessel_cross_product() -> None:
    def cross(k: float) -> float:
        return float(j0(k * INNER) * y0(k * OUTER) - j0(k * OUTER) * y0(k * INNER))

    around = np.pi / (OUTER - INNER)
    k = brentq(cross, 0.9 * around, 1.1 * around)
    time = np.concatenate([[0.0, 1e-6], np.linspace(200.0, 210.0, 2)])
    face = np.array([1.0, 0.0, 0.0, 0.0])
    layer = line(64).temperatures(time, face, face)
    rate = np.log(layer[:, 2] / layer[:, 3]) / 10.0
    np.testing.assert_allclose(rate, KAPPA * k**2, rtol=1e-3)


def test_in_a_network_the_faces_are_apart_as_conduction_says() -> None:
    constants = ThermalConstants(hub_share=0.0)
    network = with_line(standard_network(constants), line(64))
    capacity, ring = constants.coil_capacity, np.pi * (OUTER**2 - INNER**2)
    conductivity, logarithm = KAPPA * capacity / ring, np.log(OUTER / INNER)
    hub = constants.hub_capacity * logarithm / (2 * np.pi * conductivity)
    own = (0.5 * (OUTER**2 - INNER**2) - INNER**2 * logarithm) / (2 * KAPPA)
    lags = network.ramp_lags_s()
    assert lags["T_in"] - lags["T_out"] == pytest.approx(hub + own, rel=2e-4)
    assert sum(network.capacities.values()) == pytest.approx(
        sum(standard_network(constants).capacities.values()), rel=1e-12
    )
    # The faces carry a thousandth of the layer beside them.
    layers = line(64).between_faces(constants.coil_capacity).capacities
    for face, layer in (("T_out", line(64).names[-1]), ("T_in", line(64).names[0])):
        assert network.capacities[face] == pytest.approx(1e-3 * layers[layer])
    # What is outside the coil notices nothing in a steady ramp.
    assert lags["T_case"] == pytest.approx(900.0)
    assert lags["T_out"] == pytest.approx(1260.0, rel=1e-9)
    assert next(iter(lags)) == "T_chamber" and "T_layer_64" in lags


def test_layers_lie_between_the_faces_of_the_network_that_drives_them() -> None:
    coil = line(16)
    network = with_line(standard_network(), coil)
    time = np.arange(0.0, 7200.0, 1.0)
    air = np.interp(time, [0, 600, 4200], [25.0, 25.0, -35.0])
    whole = network.temperatures(time, air)
    alone = coil.temperatures(time, whole["T_out"], whole["T_in"])
    for name, layer in zip(coil.names, alone):
        np.testing.assert_allclose(layer, whole[name], atol=2e-5)


def test_blocks_give_the_whole() -> None:
    coil, rng = line(12), np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.5, 2.0, 1000))
    outer, inner = np.cumsum(rng.normal(size=(2, 1000)), axis=1)
    whole = coil.temperatures(time, outer, inner)
    state = PlantState()
    parts = [
        coil.temperatures(time[a:b], outer[a:b], inner[a:b], state) for a, b in pairwise((0, 3, 400, 1000))
    ]
    np.testing.assert_allclose(np.hstack(parts), whole, rtol=1e-12, atol=1e-12)


def test_faults_are_named() -> None:
    with pytest.raises(InputError, match="the inner one is below the outer one"):
        RadialLine(0.05, 0.04)
    with pytest.raises(InputError, match="'diffusivity' is 1 m2/s"):
        RadialLine(diffusivity=1.0)
    with pytest.raises(InputError, match="'layers' is 0"):
        RadialLine(layers=0)
    with pytest.raises(InputError, match="needs a node 'T_hub'"):
        with_line(standard_network(order=4), line(8))
