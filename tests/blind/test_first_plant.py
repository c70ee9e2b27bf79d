"""The plant against closed forms: heat that is neither lost nor made, the cylinder wall, Bessel modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0, j1, y0, y1

from fogml.blind.first.plant import (
    CASE,
    ELECTRONICS,
    FIRST_SHELL,
    HUB,
    Plant,
    PlantConstants,
    draw_plant,
)


@pytest.fixture
def plant() -> Plant:
    return Plant(draw_plant(np.random.default_rng(3)))


def test_heat_taken_up_is_what_air_and_power_gave(plant: Plant) -> None:
    step, count = 2.0, 5000
    t = step * np.arange(count)
    air = 25.0 + 30.0 * np.sin(t / 2000.0)
    power = 2.0 + 1.0 * np.cos(t / 700.0)
    fan = (t % 3000.0 < 2200.0).astype(float)
    states = plant.temperatures(step, air, power, fan, plant.rest(25.0, 2.0))
    held = states @ plant.capacities
    # The trapezoidal rule keeps this balance in every step.
    still = np.where(fan[:-1] > 0.5, 1.0, plant.constants.still_air)
    middle_air, middle = 0.5 * (air[1:] + air[:-1]), 0.5 * (states[1:] + states[:-1])
    flow = still * (plant.to_air[None, :] * (middle_air[:, None] - middle)).sum(axis=1)
    given = step * np.cumsum(flow + 0.5 * (power[1:] + power[:-1]))
    assert held[1:] - held[0] == pytest.approx(given, abs=1e-6 * np.ptp(held))


def test_it_comes_to_rest_where_the_equations_say(plant: Plant) -> None:
    air, power, fan = np.full(60000, -20.0), np.full(60000, 3.0), np.ones(60000)
    states = plant.temperatures(4.0, air, power, fan, np.full(len(plant.capacities), 40.0))
    assert states[-1] == pytest.approx(plant.rest(-20.0, 3.0), abs=1e-5)
    assert plant.rest(12.0, 0.0) == pytest.approx(np.full(len(plant.capacities), 12.0))


def test_a_steady_flow_through_the_winding_has_the_logarithmic_profile(plant: Plant) -> None:
    c = plant.constants
    shells = len(plant.capacities) - FIRST_SHELL
    edges = np.linspace(c.inner_radius_m, c.inner_radius_m + c.thickness_m, shells + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    profile = plant.rest(0.0, 5.0)[FIRST_SHELL:]
    share = (profile - profile[0]) / (profile[-1] - profile[0])
    assert share == pytest.approx(np.log(middle / middle[0]) / np.log(middle[-1] / middle[0]), abs=1e-9)


def test_the_winding_alone_relaxes_by_the_mode_of_a_cylinder_wall() -> None:
    """Slowest mode with both faces insulated: J1(ka) Y1(kb) = J1(kb) Y1(ka)."""
    c = PlantConstants(coil_s=1e12, hub_s=1e12)
    a, b = c.inner_radius_m, c.inner_radius_m + c.thickness_m
    root = brentq(
        lambda k: j1(k * a) * y1(k * b) - j1(k * b) * y1(k * a), 0.7 * np.pi / (b - a), 1.3 * np.pi / (b - a)
    )
    plant = Plant(c, shells=40)
    edges = np.linspace(a, b, 41)
    middle = 0.5 * (edges[1:] + edges[:-1])
    shape = j0(root * middle) * y1(root * a) - y0(root * middle) * j1(root * a)
    start = np.zeros(len(plant.capacities))
    start[FIRST_SHELL:] = shape
    states = plant.temperatures(0.5, np.zeros(200), np.zeros(200), np.ones(200), start)
    left = float(states[-1, FIRST_SHELL:] @ shape / (shape @ shape))
    assert np.log(left) == pytest.approx(-c.diffusivity * root**2 * 0.5 * 199, rel=2e-3)


def test_a_node_behind_the_case_follows_exponentially() -> None:
    """Electronics alone behind a case that is held: the closed form of one capacity."""
    plant = Plant(PlantConstants(coil_s=1e15, hub_s=1e15))
    plant.conductances[HUB, :] = plant.conductances[:, HUB] = 0.0
    plant.capacities[CASE] = 1e15
    start = np.zeros(len(plant.capacities))
    start[ELECTRONICS] = 10.0
    t = 1.0 * np.arange(1000)
    states = plant.temperatures(1.0, np.zeros(1000), np.zeros(1000), np.ones(1000), start)
    assert states[:, ELECTRONICS] == pytest.approx(10.0 * np.exp(-t / plant.constants.board_s), abs=1e-4)
