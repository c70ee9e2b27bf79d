"""The first reality: its units with their runs, drawn to show given effects, and all of its forms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import FloatArray, IntArray
from fogml.blind.first.effects import coil, electrical, invented, sensing, turning
from fogml.blind.first.noise import NoiseConstants, draw_instruments, draw_noise, draw_series, finer, sense
from fogml.blind.first.plant import (
    CASE,
    ELECTRONICS,
    FIRST_SHELL,
    HUB,
    PLATE,
    PLATE_DEEP,
    Plant,
    draw_plant,
)
from fogml.blind.first.programme import Programme, draw_programme, static_programme
from fogml.blind.frame import nominal
from fogml.blind.frame.form import Demands, Form, draw_demands, draw_set_up, forms_in
from fogml.blind.frame.record import SetUp, World
from fogml.blind.frame.unit import Reality, Unit, UnitRun

_FINE_S = 2.0
_DELTA_S = 64.0


def happen(
    rng: np.random.Generator,
    plant: Plant,
    programme: Programme,
    set_up: SetUp,
    sample_s: float,
    place: int,
) -> World:
    """Run a programme: the air, the machines, the plant, the table."""
    fine = min(_FINE_S, sample_s)
    per = round(sample_s / fine)
    fine = sample_s / per
    before = int(np.ceil(min(max(-programme.powered_on, 0.0), 10800.0) / sample_s)) * per
    # Two windows of 64 s more, so that the first samples have their past.
    before = max(before, int(np.ceil(2.0 * _DELTA_S / fine / per)) * per)
    count = round(programme.duration_s / sample_s)
    t: FloatArray = fine * np.arange(-before, count * per, dtype=np.float64)
    air, machines = _chamber(rng, t, programme, fine)
    power, supply = _electrical(rng, t, programme, plant)
    fan = np.ones(len(t))
    for start, stop in programme.fan_stops:
        fan[(t >= start) & (t < stop)] = 0.0
    first_power = 0.0 if t[0] < programme.powered_on - 1e-9 or programme.powered_on >= t[0] else power[0]
    states = plant.temperatures(fine, air, power, fan, plant.rest(float(air[0]), float(first_power)))
    at = before + per * np.arange(count, dtype=np.int64)
    shells = states[:, FIRST_SHELL:]
    volumes = plant.capacities[FIRST_SHELL:] / plant.capacities[FIRST_SHELL:].sum()
    full = {
        "T_in": shells[:, 0],
        "T_out": shells[:, -1],
        "T_case": states[:, CASE],
        "T_electronics": states[:, ELECTRONICS],
        "T_chamber": air,
        "T_hub": states[:, HUB],
        "T_plate": states[:, PLATE],
        "T_plate_deep": states[:, PLATE_DEEP],
        "T_coil": shells @ volumes,
    }
    per_min = 60.0 / fine
    deltas = {name: _delta(full[name], fine, at) for name in ("T_in", "T_out")}
    table_rate = _table(programme, t[at], sample_s)
    angle = np.cumsum(table_rate * sample_s)
    b_field = _field(rng, angle, machines["heater"][at], t[at], np.sign(set_up.latitude) or 1.0)
    drives = {name: values[at] for name, values in machines.items()}
    drives |= {"supply": supply[at], "power": power[at], "fan": fan[at], **b_field}
    drives["humidity"] = _humidity(rng, air, fine)[at]
    drives["vibration"] = _vibration(rng, drives["compressor"])
    return World(
        time=t[at],
        sample_s=sample_s,
        nodes={name: values[at] for name, values in full.items()},
        rates={name: np.gradient(values)[at] * per_min for name, values in full.items()},
        shell_rates=np.gradient(shells, axis=0)[at] * per_min,
        deltas=deltas,
        table_rate=table_rate,
        angle=angle,
        drives=drives,
        time_on=t[at] - programme.powered_on,
        set_up=set_up,
        programme=programme,
        place=place,
    )


def _delta(x: FloatArray, step_s: float, at: IntArray) -> FloatArray:
    """Mean of the last 64 s less that of the 64 s before, from the integral of x, straight between."""
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * step_s)])
    t = step_s * np.arange(len(x))
    end = t[at]
    now, mid, past = (np.interp(end - k * _DELTA_S, t, integral) for k in range(3))
    return np.asarray((now - 2.0 * mid + past) / _DELTA_S)


def _chamber(
    rng: np.random.Generator, t: FloatArray, programme: Programme, step_s: float
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Air behind the set point by a second-order controller, its ripple, and the machines' duties."""
    wanted = np.interp(t, programme.corner_s, programme.set_point)
    frequency, damping = 1.0 / rng.uniform(40.0, 120.0), rng.uniform(0.6, 0.95)
    # Bilinear second-order low-pass.
    k = 2.0 / step_s
    a = np.array([k * k + 2 * damping * frequency * k + frequency**2, 2 * (frequency**2 - k * k), 0.0])
    a[2] = k * k - 2 * damping * frequency * k + frequency**2
    b = frequency**2 * np.array([1.0, 2.0, 1.0])
    offset = wanted[0]
    air = offset + lfilter(b / a[0], a / a[0], wanted - offset)
    period, size = rng.uniform(120.0, 600.0), rng.uniform(0.02, 0.25)
    cycle = 2.0 * np.pi * t / period + rng.uniform(0.0, 2.0 * np.pi)
    air = air + size * np.sin(cycle)
    change = 60.0 * np.gradient(air, step_s)
    # Cold takes the compressor, in cycles; heat the heater, by its duty.
    load = np.clip(0.35 - 0.012 * (air - 25.0) - 0.35 * change, 0.0, 1.0)
    phase = (t / rng.uniform(400.0, 1100.0) + rng.random()) % 1.0
    compressor = (phase < load).astype(np.float64)
    heater = np.clip(0.1 + 0.012 * (air - 25.0) + 0.4 * change + 0.1 * np.sin(cycle), 0.0, 1.0)
    return air, {"compressor": compressor, "heater": heater}


def _electrical(
    rng: np.random.Generator, t: FloatArray, programme: Programme, plant: Plant
) -> tuple[FloatArray, FloatArray]:
    c = plant.constants
    on = t - programme.powered_on
    power = np.where(on >= 0.0, c.power_w + (c.inrush_w - c.power_w) * np.exp(-on / c.inrush_s), 0.0)
    supply = rng.choice([5.0, 12.0, 28.0]) + 0.01 * np.sin(2 * np.pi * t / rng.uniform(5e3, 2e4))
    for start, stop, factor, step in programme.power_steps:
        inside = (t >= start) & (t < stop)
        power[inside] *= factor
        supply[inside] += step
    return power, supply


def _humidity(rng: np.random.Generator, air: FloatArray, step_s: float) -> FloatArray:
    """Relative humidity of air whose water is what the coldest wall left in it, refilled slowly [%]."""
    wet = rng.uniform(30.0, 60.0)
    saturated = np.exp(0.062 * (air - 25.0))
    slow = lfilter([step_s / 1500.0], [1.0, step_s / 1500.0 - 1.0], saturated - saturated[0]) + saturated[0]
    return np.clip(wet * np.minimum(slow / saturated, 1.6), 3.0, 98.0)


def _vibration(rng: np.random.Generator, compressor: FloatArray) -> FloatArray:
    quiet, running = rng.uniform(0.005, 0.02), rng.uniform(0.03, 0.12)
    return np.sqrt(quiet**2 + running**2 * compressor) * np.exp(0.05 * rng.standard_normal(len(compressor)))


def _field(
    rng: np.random.Generator, angle: FloatArray, heater: FloatArray, t: FloatArray, hemisphere: float
) -> dict[str, FloatArray]:
    """Earth's field in an upright gyro, down in the north (`hemisphere` 1), and a stray one."""
    turn = np.radians(angle)
    stray = rng.uniform(0.5, 4.0) * heater + 2.0 * (np.sin(2 * np.pi * t / rng.uniform(3e3, 9e3)) > 0.6)
    level = rng.uniform(17.0, 24.0)
    return {
        "B_x": level * np.cos(turn) + stray,
        "B_y": -level * np.sin(turn) + 0.4 * stray,
        "B_z": -hemisphere * rng.uniform(35.0, 48.0) + 0.6 * stray,
    }


def _table(programme: Programme, time: FloatArray, sample_s: float) -> FloatArray:
    """Mean rate over the sample that ends at each time [deg/s]; edges lie on samples."""
    rate = np.zeros(len(time))
    for start, stop, value in programme.turns:
        rate[(time > start + 1e-6) & (time < stop + 1e-6)] += value
    return rate


_STATIC_FACTOR = 1.3
"""Noise constants of another day, relative to those of the runs."""


def draw_unit(
    rng: np.random.Generator, forms: Sequence[type[Form]], runs: int, static: bool, sample_s: float
) -> Unit:
    """A unit whose programmes and instruments show the given forms; `runs` to fit on, one held out."""
    quick = any(f.quick_plant for f in forms)
    needed = tuple(dict.fromkeys(column for f in forms for column in f.records))
    fine = any(f.fine_sensors for f in forms)
    instruments = draw_instruments(rng, any(f.faces for f in forms), fine, needed)
    plant = Plant(draw_plant(rng, quick))
    constants = nominal.draw_constants(rng, instruments.two_faces)
    noise = draw_noise(rng)
    set_up = draw_set_up(rng, forms, (20.0, 60.0), upright=0.75)
    earth_stated = bool(rng.random() < 0.85)
    demands = draw_demands(rng, forms, {"turns": 0.4, "power_steps": 0.3, "fan_stops": 0.15}, (10.0, 80.0))
    slope, turning_slope = nominal.temperature_slopes(constants, sample_s)
    turning_slope *= demands.top_rate * float(demands.turns and not demands.small_rates)
    instruments = finer(instruments, slope, turning_slope, noise.N / np.sqrt(sample_s / 3600.0))

    def run(name: str, programme: Programme, of: NoiseConstants, place: int) -> UnitRun:
        world = happen(rng, plant, programme, set_up, sample_s, place)
        series = draw_series(rng, len(world.time), sample_s, of)
        sensed = sense(rng, world, instruments)
        return UnitRun(name, world, sensed, series, int(rng.integers(2**62)))

    names = [*(f"fit-{k + 1}.csv" for k in range(runs)), "held-out-1.csv"]
    thermal = tuple(run(n, draw_programme(rng, demands, sample_s), noise, k) for k, n in enumerate(names))
    quiet = None
    if static:
        other = noise.scaled(rng, _STATIC_FACTOR)
        quiet = run("static.csv", static_programme(rng, sample_s), other, len(names))
    return Unit(
        plant,
        constants,
        noise,
        instruments,
        set_up,
        earth_stated,
        sample_s,
        thermal[:-1],
        thermal[-1:],
        quiet,
        shown=_shown(instruments.others, demands, thermal[0].world),
    )


def _shown(others: tuple[str, ...], demands: Demands, world: World) -> tuple[str, ...]:
    """Recorded columns beside the temperatures: what steps is recorded with what was chosen."""
    names = [name for name in others if name in world.drives]
    names += ["power"] * demands.power_steps + ["fan"] * demands.fan_stops
    return tuple(dict.fromkeys(names))


KNOWN = forms_in(coil, electrical, turning, sensing)
"""Forms of effects that the catalogue holds; some effects have two.

``mount_tilt`` has none: with Earth rate alone on a table that turns, a tilt that a fixture has stays
far under the noise of every unit here.
"""
INVENTED = forms_in(invented, sensing, turning, known=False)
"""Effects that no library holds."""
WRONG_STRUCTURE = coil.DeepPlate
"""Another thermal order than any twin's."""


REALITY = Reality("first", KNOWN, INVENTED, WRONG_STRUCTURE, draw_unit)
