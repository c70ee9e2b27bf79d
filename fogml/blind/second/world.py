"""One run of a unit as it truly was: chamber, machines, plant, table, field; no gyro yet."""

from __future__ import annotations

import numpy as np

from fogml.blind.frame.nominal import WINDOW_S, delta_of_record
from fogml.blind.frame.record import FloatArray, SetUp, World
from fogml.blind.second.plant import NAMES, Plant
from fogml.blind.second.programme import Programme


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
    per = max(int(np.ceil(sample_s / _FINE_S)), 1)
    fine = sample_s / per
    wanted_s = max(min(-programme.powered_on, _LONGEST_BEFORE_S), 2.0 * WINDOW_S + sample_s)
    before = int(np.ceil(wanted_s / sample_s)) * per
    count = round(programme.duration_s / sample_s)
    t: FloatArray = fine * np.arange(-before, count * per, dtype=np.float64)
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
    at = before + per * np.arange(count, dtype=np.int64)
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
    table_rate = np.zeros(count)
    for start, stop, rate in programme.turns:
        table_rate[(t[at] > start + 1e-6) & (t[at] < stop + 1e-6)] = rate
    angle = np.cumsum(table_rate * sample_s)
    drives = {"compressor": compressor[at], "heater": heater[at], "supply": supply[at], "power": power[at]}
    drives |= _field(rng, angle, drives["heater"], drives["compressor"], set_up.latitude)
    drives["humidity"] = humidity_of(rng, air, compressor, fine)[at]
    quiet, loud, turning = rng.uniform(0.003, 0.02), rng.uniform(0.02, 0.15), rng.uniform(0.0, 0.02)
    shaking = quiet**2 + loud**2 * drives["compressor"] + turning**2 * np.abs(table_rate) / 10.0
    drives["vibration"] = np.sqrt(shaking) * (1.0 + 0.08 * rng.standard_normal(count))
    per_minute = 60.0 / fine
    return World(
        time=t[at],
        sample_s=sample_s,
        nodes={name: values[at] for name, values in full.items()},
        rates={name: per_minute * np.gradient(values)[at] for name, values in full.items()},
        shell_rates=per_minute * np.gradient(winding, axis=0)[at],
        # By the samples, as a replay has it: what a coarse interval hides of DeltaT is no effect.
        deltas={name: delta_of_record(t[at], full[name][at]) for name in ("T_in", "T_out")},
        table_rate=table_rate,
        angle=angle,
        drives=drives,
        time_on=t[at] - programme.powered_on,
        set_up=set_up,
        programme=programme,
        place=place,
        since_first=since_first,
        past=past,
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
