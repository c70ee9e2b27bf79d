"""One run of a unit as it truly was; no gyro yet."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from fogml.blind.frame.nominal import WINDOW_S, delta_of_record
from fogml.blind.frame.operators import late
from fogml.blind.frame.record import FloatArray, SetUp, World
from fogml.blind.third.plant import NAMES, Plant
from fogml.blind.third.programme import Programme

_FINE_S = 10.0


def happen(
    rng: np.random.Generator,
    plant: Plant,
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
    wanted_s = max(min(-programme.powered_on, 6000.0), 2.0 * WINDOW_S + sample_s)
    before = int(np.ceil(wanted_s / sample_s)) * per
    count = round(programme.duration_s / sample_s)
    t: FloatArray = fine * np.arange(-before, count * per, dtype=np.float64)
    # The air is first order behind the set point, its wall slower; a valve pulses to cool, by its duty.
    wanted = late(programme.set_point(t), rng.uniform(60.0, 250.0), fine)
    period = rng.uniform(60.0, 400.0)
    need = np.clip(0.3 - 0.006 * (wanted - 20.0) - 2.0 * np.gradient(wanted, fine), 0.0, 1.0)
    valve = ((t / period + 0.1 * np.sin(t / 3000.0)) % 1.0 < need).astype(np.float64)
    ripple = late(need - valve, 0.3 * period, fine)
    air = wanted + rng.uniform(0.1, 1.5) * ripple
    wall = late(wanted, rng.uniform(400.0, 1500.0), fine)
    heater = np.clip(0.15 + 0.008 * (wanted - 20.0) + 2.0 * np.gradient(wanted, fine), 0.0, 1.0)
    c, on = plant.constants, t - programme.powered_on
    fading = 1.0 + (c.start - 1.0) * np.exp(-np.maximum(on, 0.0) / c.fade_s)
    power = np.where(on >= 0.0, plant.power_w * fading, 0.0)
    supply = rng.choice([9.0, 12.0, 24.0]) + 0.01 * late(rng.standard_normal(len(t)), 200.0, fine)
    if programme.loaded:
        switched = (t // rng.uniform(1500.0, 3000.0)) % 2.0 > 0.5
        power = np.where(switched, power * rng.uniform(1.2, 1.7), power)
        supply = supply + np.where(switched, rng.normal(0.0, 0.4), 0.0)
    states = plant.temperatures(fine, air, wall, power)
    at = before + per * np.arange(count, dtype=np.int64)
    full = {f"T_{name}": states[:, k] for k, name in enumerate(NAMES)}
    full |= {
        "T_in": full["T_inner"],
        "T_out": full["T_outer"],
        "T_coil": states[:, 2:5].mean(axis=1),
        "T_case": full["T_cover"],
        "T_electronics": full["T_board"],
        "T_chamber": air,
    }
    table_rate = np.zeros(count)
    for start, stop, rate in programme.turns:
        table_rate[(t[at] > start + 1e-6) & (t[at] < stop + 1e-6)] = rate
    angle = np.cumsum(table_rate * sample_s)
    turn, level = np.radians(angle), rng.uniform(16.0, 26.0)
    stray = rng.normal(0.0, 2.0, 3)[:, None] * heater[at]
    shaking = rng.uniform(0.01, 0.05) * np.exp(0.3 * late(rng.standard_normal(count), 60.0, sample_s))
    wet = lfilter([fine / 4000.0], [1.0, fine / 4000.0 - 1.0], 45.0 - 0.4 * (air - 25.0))
    drives = {
        "compressor": valve[at],
        "heater": heater[at],
        "supply": supply[at],
        "power": power[at],
        "humidity": np.clip(wet[at] + 30.0 * np.exp(-t[at] / 4000.0), 3.0, 97.0),
        "vibration": shaking * (1.0 + 2.0 * valve[at]),
        "B_x": level * np.cos(turn) + stray[0],
        "B_y": -level * np.sin(turn) + stray[1],
        "B_z": -rng.uniform(30.0, 45.0) + stray[2],
    }
    per_minute = 60.0 / fine
    return World(
        time=t[at],
        sample_s=sample_s,
        nodes={name: values[at] for name, values in full.items()},
        rates={name: per_minute * np.gradient(values)[at] for name, values in full.items()},
        shell_rates=per_minute * np.gradient(states[:, 2:5], axis=0)[at],
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
