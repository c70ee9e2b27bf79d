"""The second reality against closed forms, other integrators and what each memory must obey."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import toeplitz

from fogml.blind.frame.form import Additive, Demands, Distorting, Form
from fogml.blind.frame.noise import Whitening
from fogml.blind.frame.operators import (
    backlash,
    bouc_wen,
    bouc_wen_general,
    faded,
    lag,
    late,
    maxwell_slip,
    play,
    preisach,
    slab_lag,
)
from fogml.blind.frame.unit import Unit
from fogml.blind.plan import REALITIES, reality
from fogml.blind.second.effects.lasting import LoopOfSlips
from fogml.blind.second.plant import Plant, draw_plant
from fogml.blind.second.reality import air_of, draw_chamber, draw_noise

RNG_SEED = 4
LOOP = (np.linspace(-40.0, 60.0, 60), np.full(60, 7.0), np.linspace(0.5, 1.5, 60))


def zigzag(*corners: float, points: int = 200) -> NDArray[np.float64]:
    """Straight lines between corners."""
    return np.interp(np.linspace(0.0, len(corners) - 1.0, points), np.arange(len(corners)), corners)


def test_the_plant_agrees_with_an_integrator_of_its_equations() -> None:
    plant = Plant(draw_plant(np.random.default_rng(RNG_SEED)))
    t = 20.0 * np.arange(120)
    air, power = 20.0 + 30.0 * np.sin(t / 700.0), np.where(t > 400.0, 2.0, 1.0)

    def slope(now: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        flow = plant.conductances @ state - plant.conductances.sum(axis=1) * state
        flow += plant.to_air * (np.interp(now, t, air) - state) + plant.heated * np.interp(now, t, power)
        return flow / plant.capacities

    start = plant.rest(air[0], power[0])
    found = solve_ivp(slope, (0.0, t[-1]), start, "LSODA", t[::7], rtol=1e-8, atol=1e-8, max_step=20.0)
    assert plant.temperatures(20.0, air, power)[::7] == pytest.approx(found.y.T, abs=1e-4)


def test_in_a_long_ramp_the_plant_takes_up_its_heat_capacity_times_the_rate() -> None:
    plant = Plant(draw_plant(np.random.default_rng(RNG_SEED)))
    air = 0.01 * 60.0 * np.arange(4000.0)
    last = plant.temperatures(60.0, air, np.zeros(4000))[-1]
    assert plant.to_air @ (air[-1] - last) == pytest.approx(0.01 * plant.capacities.sum(), rel=1e-6)
    # And steps of any size give the same, as the answer to a straight input is exact.
    assert plant.temperatures(6000.0, air[::100], np.zeros(40))[-1] == pytest.approx(
        plant.temperatures(60.0, air[:3901], np.zeros(3901))[-1], abs=1e-8
    )


def test_parts_weigh_in_proportion_to_the_winding() -> None:
    plants = [Plant(draw_plant(np.random.default_rng(seed))) for seed in (1, 2)]
    windings = [plant.capacities[plant.cells].sum() for plant in plants]
    parts = [plant.capacities[: plant.cells.min()] for plant in plants]
    assert windings[0] != pytest.approx(windings[1], rel=0.05)
    assert parts[0] / windings[0] == pytest.approx(parts[1] / windings[1])


def test_relays_forget_what_a_larger_swing_wiped_out_and_know_no_time() -> None:
    plain = zigzag(0.0, 50.0, -30.0, points=81)
    minor = zigzag(0.0, 30.0, 10.0, 25.0, 12.0, 50.0, -30.0, points=241)
    assert preisach(minor, *LOOP)[-41:] == pytest.approx(preisach(plain, *LOOP)[-41:])
    slow = np.repeat(minor, 3)
    assert preisach(slow, *LOOP)[::3] == pytest.approx(preisach(minor, *LOOP))
    # Two runs with a memory between them are one.
    whole = preisach(minor, *LOOP)
    assert preisach(minor[120:], *LOOP, past=minor[:120].tolist()) == pytest.approx(whole[120:])


def test_minor_loops_between_the_same_ends_are_alike_wherever_they_come_from() -> None:
    up = preisach(zigzag(-40.0, 20.0, 40.0, 20.0, 40.0, points=401), *LOOP)[200:]
    down = preisach(zigzag(60.0, 20.0, 40.0, 20.0, 40.0, points=401), *LOOP)[200:]
    assert up - up[0] == pytest.approx(down - down[0]) and np.ptp(up) > 1.0


def test_bouc_wen_is_the_closed_form_where_there_is_one() -> None:
    x = zigzag(0.0, 40.0, -20.0, 30.0, -5.0, points=2000)
    assert bouc_wen_general(x, 9.0, 2.0, 0.5) == pytest.approx(bouc_wen(x, 9.0), abs=2e-3)


def test_springs_that_slip_are_plays_while_their_reach_is_constant() -> None:
    x = zigzag(0.0, 40.0, -20.0, 30.0, -5.0)
    reach, stiffness = np.array([4.0, 11.0]), np.array([0.3, 0.7])
    found = maxwell_slip(x, stiffness, lambda _: reach)
    assert found == pytest.approx(stiffness @ (x - play(x, reach)))
    assert backlash(x, 4.0) == pytest.approx(play(x, np.array([4.0]))[0])


@pytest.mark.parametrize("shape", [0.8, 3.0])
def test_loops_of_springs_that_soften_are_smaller_the_hotter_it_is(shape: float) -> None:
    settings = {"reach": 5.0, "shape": shape, "softening": 60.0}

    def midway_down(centre: float) -> float:
        swing = zigzag(centre, centre + 60.0, centre - 60.0, points=3001)
        world = SimpleNamespace(nodes={"T_coil": swing}, past=())
        found = LoopOfSlips().response(world, settings, np.random.default_rng(0))  # type: ignore[arg-type]
        return float(found[np.flatnonzero(np.isclose(swing, centre))[-1]])

    assert midway_down(50.0) == pytest.approx(np.exp(-1.0) * midway_down(-10.0), rel=0.02)


def test_fading_memories_against_a_lag_and_a_slab_in_a_ramp() -> None:
    time = 10.0 * np.arange(2000.0)
    x = zigzag(20.0, 60.0, 60.0, 0.0, points=2000)
    kept = faded(time, x, lambda t: np.exp(-t / 900.0))
    assert kept == pytest.approx(x - lag(10.0, x, 900.0), abs=0.15)
    assert late(x, 900.0, 10.0) == pytest.approx(lag(10.0, x, 900.0), abs=1e-9)
    # Behind a ramp for long, the far face of a slab is late by L^2 / 2 D.
    ramp = 0.01 * time
    assert slab_lag(time, ramp, 3000.0)[-1] == pytest.approx(ramp[-1] - 0.01 * 1500.0, abs=0.02)


def test_the_thermostat_keeps_its_shortest_times_and_follows() -> None:
    chamber = draw_chamber(np.random.default_rng(1))
    wanted = np.interp(np.arange(0.0, 20000.0, 5.0), [0.0, 3000.0, 9000.0], [25.0, 25.0, -25.0])
    air, compressor, heater = air_of(wanted, 5.0, chamber)
    switched = np.flatnonzero(np.diff(compressor)) * 5.0
    assert len(switched) > 4 and np.diff(switched).min() >= chamber["shortest"]
    assert air[-1000:].mean() == pytest.approx(-25.0, abs=2.0)
    assert set(compressor) == {0.0, 1.0} and heater.min() >= 0.0 and heater.max() <= 1.0


def test_noise_has_the_covariance_that_its_whitening_takes_out() -> None:
    noise = draw_noise(np.random.default_rng(RNG_SEED))
    count, before, step = 90, 12, 10.0
    hours = step / 3600.0
    lags = step * np.arange(count)
    first = toeplitz((noise.variances[:, None] * np.exp(-lags / noise.taus_s[:, None])).sum(axis=0))
    number = before + 1 + np.arange(count)
    dense = first + noise.N**2 / hours * np.eye(count) + noise.K**2 * hours * np.minimum.outer(number, number)
    whitening = Whitening(noise, count, step, before)
    x = np.random.default_rng(1).standard_normal((count, 2))
    assert whitening.solve(x) == pytest.approx(np.linalg.solve(dense, x), rel=1e-6)
    blocks = np.kron(np.eye(9), np.full((1, 10), 0.1))
    assert whitening.mean_square_of_means(10) == pytest.approx(np.trace(blocks @ dense @ blocks.T) / 9.0)
    drawn = np.array([noise.series(np.random.default_rng(k), count, step) for k in range(2000)])
    plain = dense - noise.K**2 * hours * before
    assert drawn.T @ drawn / 2000.0 == pytest.approx(plain, abs=0.15 * plain.max())


def unit_for(name: str, turning: bool) -> Unit:
    """A unit whose runs hold what forms ask for."""

    class Asking(Form):
        name, demands = "asking", Demands(turning, turning, power_steps=True, power_on=True)

    return reality(name).draw_unit(np.random.default_rng(RNG_SEED), [Asking], 1, False, 60.0)


@pytest.mark.parametrize("name", REALITIES)
def test_every_form_of_a_reality_acts(name: str) -> None:
    unit, rng = unit_for(name, True), np.random.default_rng(3)
    run = unit.fit[0]
    for form in (*reality(name).known, *reality(name).invented, reality(name).wrong_structure):
        made = form()
        shape = made.draw(rng)
        assert all(np.isfinite(value) for value in shape.values())
        if isinstance(made, Additive):
            values = made.response(run.world, shape, np.random.default_rng(run.seed))
        elif isinstance(made, Distorting):
            values = made.distorted(unit.output(run), run.world, 1.0, shape)
        else:
            read = made.read(made.felt("T_in", run.world.nodes["T_in"], run.world, 0.5, shape), 0.5, shape)
            assert np.ptp(read - run.world.nodes["T_in"]) > 0.0
            values = read
        assert values.shape == run.world.time.shape and np.all(np.isfinite(values)), form.__name__


def test_known_effects_of_all_realities_are_the_catalogues_and_have_two_classes_of_form() -> None:
    from fogml.twin.registry import effects

    catalogue, forms = effects(), dict[str, set[str]]()
    for name in REALITIES:
        for form in reality(name).known:
            assert catalogue[form.name].candidate and catalogue[form.name].stage == form.stage
            assert form.unit in ("", catalogue[form.name].amplitude.unit)
            forms.setdefault(form.name, set()).add(form.form)
        assert not set(reality(name).invented_names) & set(catalogue)
    assert len(forms) >= 30
    assert {name for name, held in forms.items() if len(held) < 2} == set()
