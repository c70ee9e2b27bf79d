"""The second reality: its units with their runs, days apart, drawn to show given effects; all of its forms.

A unit's noise is white, a slope of its own between flat and steep, at times a bump, and a walk. The slope is
a sum of Ornstein-Uhlenbeck processes, one in each half decade of time constants, whose variances follow a
power of the time constant and scatter about it: no unit's is 1/f.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Form, draw_demands, draw_set_up, forms_in
from fogml.blind.frame.noise import StateNoise
from fogml.blind.frame.record import Course, SetUp, World
from fogml.blind.frame.thermometers import draw_instruments, drawn_run, quick_enough
from fogml.blind.frame.unit import Reality, Unit, UnitRun
from fogml.blind.second.effects import driven, lasting, turning, unknown, winding
from fogml.blind.second.plant import NAMES, Plant, draw_plant
from fogml.blind.second.programme import Programme, draw_programme, static_programme


def draw_chamber(rng: np.random.Generator) -> dict[str, float]:
    """One chamber: its powers [degC/min], loss [1/min], band [degC], times [s], gain [1/degC]."""
    return {
        "heat": float(rng.uniform(8.0, 30.0)),
        "cool": float(rng.uniform(8.0, 25.0)),
        "evaporator": float(rng.uniform(100.0, 400.0)),
        "loss": float(rng.uniform(0.02, 0.06)),
        "band": float(rng.uniform(0.05, 0.5)),
        "shortest": float(rng.uniform(20.0, 120.0)),
        "gain": float(rng.uniform(0.1, 0.5)),
        "reset": float(rng.uniform(200.0, 900.0)),
        "room": float(rng.uniform(19.0, 26.0)),
    }


def air_of(
    set_point: FloatArray, step_s: float, c: dict[str, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Air [degC], compressor (0 or 1) and heater (0 to 1) under a set point at each step, shape (m,) each.

    The compressor is on or off, and stays so for a shortest time; its evaporator answers slowly, and gives
    less in the cold.
    """
    count = len(set_point)
    air, compressor, heater = np.empty(count), np.zeros(count), np.zeros(count)
    per_step = step_s / 60.0
    temperature, held, cold, running, since = float(set_point[0]), 0.0, 0.0, False, 1e9
    wanted = set_point.tolist()
    for k in range(count):
        error = wanted[k] - temperature
        if since >= c["shortest"]:
            # Behind a falling set point, or too warm by the band; and off again at the other side of it.
            if not running and error < -c["band"]:
                running, since = True, 0.0
            elif running and error > c["band"]:
                running, since = False, 0.0
        since += step_s
        duty = min(max(c["gain"] * error + held, 0.0), 1.0)
        if 0.0 < duty < 1.0:
            held = min(max(held + c["gain"] * error * step_s / c["reset"], 0.0), 1.0)
        air[k], compressor[k], heater[k] = temperature, float(running), duty
        cold += (float(running) - cold) * step_s / c["evaporator"]
        cooling = cold * c["cool"] * max((temperature + 80.0) / 100.0, 0.1)
        change = c["heat"] * duty - cooling - c["loss"] * (temperature - c["room"])
        temperature += per_step * change
    return air, compressor, heater


def humidity_of(
    rng: np.random.Generator, air: FloatArray, compressor: FloatArray, step_s: float
) -> FloatArray:
    """Relative humidity [%]: water leaks in from the room and freezes out on the running evaporator."""
    leak, dry = step_s / rng.uniform(3000.0, 15000.0), step_s / rng.uniform(600.0, 3000.0)
    room = rng.uniform(5.0, 12.0)
    saturated = 6.1 * np.exp(17.3 * air / (air + 238.0))
    water, found = room, np.empty(len(air))
    for k, (most, running) in enumerate(zip(saturated.tolist(), compressor.tolist())):
        water += leak * (room - water) + dry * running * (0.5 * min(most, room) - water)
        water = min(max(water, 0.05), most)
        found[k] = 100.0 * water / most
    return np.clip(found, 2.0, 98.0)


_FINE_S = 5.0
_LONGEST_BEFORE_S = 9000.0


def happen(
    rng: np.random.Generator,
    plant: Plant,
    chamber: dict[str, float],
    programme: Programme,
    set_up: SetUp,
    sample_s: float,
    place: int,
    since_first: float,
    past: tuple[float, ...],
) -> World:
    """Run a programme."""
    course = Course.of(programme, sample_s, _FINE_S, _LONGEST_BEFORE_S)
    fine, t, at = course.step_s, course.t, course.at
    set_point = np.interp(t, programme.corner_s, programme.set_point)
    air, compressor, heater = air_of(set_point, fine, chamber)
    c = plant.constants
    on = t - programme.powered_on
    surge = c.surge * np.exp(-np.maximum(on, 0.0) / c.surge_s)
    power = np.where(on >= 0.0, plant.power_w * (1.0 + surge), 0.0)
    supply = rng.choice([5.0, 15.0, 27.0]) - 0.02 * np.exp(-np.maximum(on, 0.0) / 1500.0)
    for start, stop, factor, step in programme.loads:
        inside = (t >= start) & (t < stop)
        power[inside] *= factor
        supply[inside] += step
    states = plant.temperatures(fine, air, power)
    cells = plant.cells.ravel()
    winding = states[:, cells]
    shares = plant.capacities[cells] / plant.capacities[cells].sum()
    full = {f"T_{name}": states[:, k] for k, name in enumerate(NAMES)}
    full |= {
        "T_in": states[:, plant.cells[0]].mean(axis=1),
        "T_out": states[:, plant.cells[-1]].mean(axis=1),
        "T_coil": winding @ shares,
        "T_case": full["T_can"],
        "T_electronics": full["T_board"],
        "T_chamber": air,
    }
    drives = {"compressor": compressor[at], "heater": heater[at], "supply": supply[at], "power": power[at]}
    drives |= _field(rng, course.angle, drives["heater"], drives["compressor"], set_up.latitude)
    drives["humidity"] = humidity_of(rng, air, compressor, fine)[at]
    quiet, loud, turning = rng.uniform(0.003, 0.02), rng.uniform(0.02, 0.15), rng.uniform(0.0, 0.02)
    shaking = quiet**2 + loud**2 * drives["compressor"] + turning**2 * np.abs(course.table_rate) / 10.0
    drives["vibration"] = np.sqrt(shaking) * (1.0 + 0.08 * rng.standard_normal(len(at)))
    return course.world(
        full, winding, drives=drives, set_up=set_up, place=place, since_first=since_first, past=past
    )


def _field(
    rng: np.random.Generator, angle: FloatArray, heater: FloatArray, compressor: FloatArray, latitude: float
) -> dict[str, FloatArray]:
    """The field in the gyro [uT]: Earth's, bent by the chamber's steel; currents of the machines."""
    level, dip = rng.uniform(15.0, 28.0), rng.uniform(30.0, 50.0) * (np.sign(latitude) or 1.0)
    own, turn = rng.uniform(0.0, 2.0 * np.pi), np.radians(angle)
    along = rng.normal(0.0, 1.5, 3)
    stray = np.outer(heater, along) + np.outer(compressor, rng.normal(0.0, 0.8, 3))
    bent = 1.0 + 0.05 * np.cos(2.0 * turn + own)
    return {
        "B_x": level * bent * np.cos(turn + own) + stray[:, 0],
        "B_y": -level * bent * np.sin(turn + own) + stray[:, 1],
        "B_z": -dip + stray[:, 2],
    }


_MIDDLE = {"N": 0.004, "B": 0.008, "K": 0.004}
_TAUS_S = np.geomspace(10.0, 1e5, 9)


def draw_noise(rng: np.random.Generator) -> StateNoise:
    """A unit's noise, each strength log-normal about a middle by a factor of 2.5."""
    white, flicker, walk = (
        middle * float(np.exp(np.log(2.5) * np.clip(rng.standard_normal(), -2.0, 2.0)))
        for middle in _MIDDLE.values()
    )
    # Equal variances in each half decade are 1/f; a power of the time constant tilts that.
    tilt = rng.uniform(-0.35, 0.35)
    shares = (_TAUS_S / 1000.0) ** tilt * np.exp(0.4 * rng.standard_normal(len(_TAUS_S)))
    variances, taus = flicker**2 / np.pi * np.log(np.sqrt(10.0)) * shares, _TAUS_S
    if rng.random() < 0.35:
        bump = flicker**2 * rng.uniform(0.3, 1.5)
        variances = np.append(variances, bump)
        taus = np.append(taus, np.exp(rng.uniform(np.log(30.0), np.log(900.0))))
    return StateNoise(white, variances, taus, walk)


_ANOTHER_DAY, _FALSE, _FALSE_SHARE = 1.2, 2.0, 0.12
"""Noise of the static run relative to the others': usually, and where that run is not of this set-up."""


def draw_unit(
    rng: np.random.Generator, forms: Sequence[type[Form]], runs: int, static: bool, sample_s: float
) -> Unit:
    """A unit whose programmes and instruments show the given forms; `runs` to fit on, one held out."""
    plant = Plant(draw_plant(rng, any(f.quick_plant for f in forms)))
    noise = draw_noise(rng)
    demands = draw_demands(rng, forms, {"turns": 0.3, "power_steps": 0.3}, (5.0, 100.0))
    set_up = draw_set_up(rng, forms, (-55.0, 62.0), upright=0.6)
    constants, instruments = draw_instruments(rng, forms, demands, noise, sample_s)
    chamber = draw_chamber(rng)
    begin, past = 0.0, tuple(rng.uniform((-20.0, 20.0, 15.0), (15.0, 55.0, 30.0)).tolist())

    def run(name: str, programme: Programme, of: StateNoise, place: int) -> UnitRun:
        world = happen(rng, plant, chamber, programme, set_up, sample_s, place, begin, past)
        return drawn_run(rng, name, world, instruments, of)

    names = [*(f"fit-{k + 1}.csv" for k in range(runs)), "held-out-1.csv"]
    thermal = []
    for place, name in enumerate(names):
        one = run(name, draw_programme(rng, demands, sample_s), noise, place)
        thermal.append(one)
        past = _remembered(past, one.world)
        begin += float(one.world.time[-1]) + 86400.0 * float(np.exp(rng.uniform(np.log(0.3), np.log(20.0))))
    quiet = None
    if static:
        other = noise.of_another_day(rng, _FALSE if rng.random() < _FALSE_SHARE else _ANOTHER_DAY)
        quiet = run("static.csv", static_programme(rng, sample_s), other, len(names))
    stated = datetime(2026, 1, 5, 6, 0, tzinfo=UTC) + timedelta(hours=float(rng.uniform(0.0, 5000.0)))
    unit = Unit(
        plant,
        constants,
        noise,
        instruments,
        set_up,
        bool(rng.random() < 0.8),
        sample_s,
        tuple(thermal[:-1]),
        tuple(thermal[-1:]),
        quiet,
        shown=tuple(name for name in instruments.others if name in thermal[0].world.drives),
        first_day=stated.replace(microsecond=0) if rng.random() < 0.7 else None,
    )
    return quick_enough(unit)


def _remembered(past: tuple[float, ...], world: World) -> tuple[float, ...]:
    """Where the winding turned, with the run's own extremes and its end; then back to the room."""
    winding = world.nodes["T_coil"]
    low, high = int(winding.argmin()), int(winding.argmax())
    turned = [float(winding[k]) for k in sorted((low, high))]
    return (*past, *turned, float(winding[-1]), 22.0)


KNOWN = forms_in(winding, lasting, driven, turning)
"""Forms of effects that a gyro's physics knows by name; how near the catalogue's are is not asked.

``mount_tilt`` and ``coil_expansion`` have none: with Earth rate alone on a table that turns, and with sensors
on the coil, no run of a unit here shows them.
"""
INVENTED = forms_in(unknown, turning, known=False)
"""Effects that no library holds."""
REALITY = Reality("second", KNOWN, INVENTED, lasting.AnotherOrder, draw_unit)
