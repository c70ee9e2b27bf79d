"""The third reality: its integrator's order, its rests, and the laws that its memories obey."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fogml.blind.frame.operators import play
from fogml.blind.third.effects.winding import dead_zone_plays, duhem, eyring
from fogml.blind.third.plant import NAMES, Plant, draw_plant, runge_kutta


@pytest.fixture(scope="module")
def plant() -> Plant:
    return Plant(draw_plant(np.random.default_rng(2)))


def test_the_rule_is_of_fourth_order() -> None:
    def slope(state: NDArray[np.float64], push: float) -> NDArray[np.float64]:
        return -(state**2) + push

    errors = []
    for steps in (8, 16):
        state, h = np.array([1.0]), 1.0 / steps
        for _ in range(steps):
            state = runge_kutta(slope, state, h, (0.0,), (0.0,))
        errors.append(abs(float(state[0]) - 0.5))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


def test_at_rest_what_power_gives_leaves_by_air_and_wall(plant: Plant) -> None:
    rest = plant.rest(30.0, 10.0, plant.power_w)
    assert np.abs(plant.slope(rest, 30.0, 10.0, plant.power_w)).max() < 1e-9
    over = 30.0 - rest
    given = plant.stirred * np.maximum(np.abs(over), 3.0) ** 0.25 * over
    given += plant.radiated * (283.15**4 - (rest + 273.15) ** 4)
    assert -given.sum() == pytest.approx(plant.power_w, rel=1e-6)
    still = plant.rest(20.0, 20.0, plant.power_w)
    tray, board = NAMES.index("tray"), NAMES.index("board")
    assert 0.5 * plant.constants.warm < still[board] - still[tray] < 1.5 * plant.constants.warm


def test_twice_as_many_steps_change_nothing_that_shows(plant: Plant) -> None:
    t = 10.0 * np.arange(200)
    air = 20.0 + 30.0 * np.sin(t / 600.0)
    fine = np.interp(5.0 * np.arange(399), t, air)
    coarse = plant.temperatures(10.0, air, air, np.ones(200))
    assert plant.temperatures(5.0, fine, fine, np.ones(399))[::2] == pytest.approx(coarse, abs=1e-4)


def test_loops_know_the_path_and_no_time() -> None:
    x = 20.0 + 30.0 * np.sin(np.linspace(0.0, 12.0, 400))
    weights, widths = np.array([0.4, 0.6]), np.array([5.0, 12.0])
    for loop in (
        lambda path: duhem(path, 0.1, 30.0),
        lambda path: dead_zone_plays(path, widths, weights, 4.0),
    ):
        assert loop(np.repeat(x, 2))[::2] == pytest.approx(loop(x), abs=1e-9)
    # Without a dead zone to exceed they are plain plays.
    assert dead_zone_plays(x, widths, weights, 1e9) + 20.0 == pytest.approx(weights @ play(x, widths))


def test_a_loop_in_a_long_ramp_comes_to_its_curve() -> None:
    up = duhem(np.linspace(-60.0, 100.0, 4000), 0.5, 1e6)
    # Behind a line of slope 1 / knee it is late by 1 / quickness.
    assert up[-1] == pytest.approx(np.tanh((100.0 - 20.0 - 2.0) / 1e6), rel=1e-3)


def test_creep_follows_its_differential_equation() -> None:
    time = 5.0 * np.arange(800)
    x = 15.0 * np.sin(time / 900.0)

    def slope(t: float, q: NDArray[np.float64]) -> NDArray[np.float64]:
        return 15.0 / 900.0 * np.cos(t / 900.0) - 6.0 / 3000.0 * np.sinh(q / 6.0)

    found = solve_ivp(slope, (0.0, time[-1]), [0.0], "LSODA", time, rtol=1e-8, atol=1e-8)
    assert eyring(time, x, 3000.0, 6.0) == pytest.approx(found.y[0], abs=0.03)
