"""One run of a unit as it truly was: chamber, machines, plant, table, field; no gyro yet."""

from __future__ import annotations

import numpy as np

from fogml.blind.frame.nominal import WINDOW_S, delta_of_record
from fogml.blind.frame.record import FloatArray, SetUp, World
from fogml.blind.second.chamber import air_of, humidity_of
from fogml.blind.second.plant import NAMES, Plant
from fogml.blind.second.programme import Programme

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
