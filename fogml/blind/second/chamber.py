"""The chamber: a heater by degrees, a compressor that a thermostat switches, and what they do besides."""

from __future__ import annotations

import numpy as np

from fogml.blind.frame.record import FloatArray


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
