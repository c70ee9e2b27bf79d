"""Thermometers: each with a gain and an offset of its own, a small lag, noise and steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame import nominal
from fogml.blind.frame.form import OUTER, Demands, Form
from fogml.blind.frame.noise import StateNoise
from fogml.blind.frame.operators import late
from fogml.blind.frame.record import World
from fogml.blind.frame.strength import Scales
from fogml.blind.frame.unit import Instruments, Sensed, Thermometer, Unit, UnitRun

_AT_REST, _IN_TURNS = 0.1, 0.4
"""What the thermometers' noise may add to the gyro's white noise in a sample, rms, in shares of it."""

_LAG_D_PRIME = 1.0
"""Largest d' of what the thermometers' own lags do to a replay: where nothing is missing, nothing shows."""


def places_of(layout: str, others: Sequence[str]) -> dict[str, str]:
    """Where each thermometer sits, by recorded name: on a face of the coil, or where its name says."""
    coil = {"one": ("T",), "two": ("T_in", "T_out"), "four": ("T1", "T2", "T3", "T4")}[layout]
    faces = {name: "T_out" if name in OUTER else "T_in" for name in coil}
    return faces | {name: name for name in others if name.startswith("T_")}


def draw_instruments(
    rng: np.random.Generator,
    forms: Sequence[type[Form]],
    demands: Demands,
    noise: StateNoise,
    sample_s: float,
) -> tuple[nominal.Constants, Instruments]:
    """A gyro's constants, and instruments as good as it takes them: a replay's error is lost in its noise."""
    constants = nominal.draw_constants(rng, True)
    rest, turning = nominal.temperature_slopes(constants, sample_s)
    turning *= demands.top_rate * float(demands.turns and not demands.small_rates)
    needed = tuple(dict.fromkeys(column for f in forms for column in f.records))
    fine, white = any(f.fine_sensors for f in forms), noise.N / np.sqrt(sample_s / 3600.0)
    faces = any(f.faces for f in forms)
    layout = str(rng.choice(["two", "two", "four"] if faces else ["one", "two", "four"]))
    chance = {"T_case": 0.4, "T_chamber": 0.6, "T_electronics": 0.3, "supply": 0.25, "humidity": 0.25}
    chance |= {"compressor": 0.3, "heater": 0.3, "vibration": 0.2, "power": 0.3}
    others = [name for name, p in chance.items() if (rng.random() < p) | (name in needed)]
    others += [name for name in needed if name not in chance]
    most = min(_AT_REST * white / (rest + 1e-30), _IN_TURNS * white / (turning + 1e-30))
    error = min(float(np.exp(rng.uniform(np.log(1e-3), np.log(8e-3)))) * (0.3 if fine else 1.0), most)
    steps = [q for q in (0.02, 0.01, 0.005, 0.002, 0.001, 1e-4) if q < 2.0 * error]

    def thermometer(name: str, place: str) -> Thermometer:
        lag = 10.0 if name in others else 2.0
        gain, offset = rng.normal(0.0, 1e-3), rng.normal(0.0, 0.1)
        return Thermometer(place, float(gain), float(offset), float(lag * rng.uniform(0.2, 1.0)))

    each = {name: thermometer(name, place) for name, place in places_of(layout, others).items()}
    instruments = Instruments(layout, tuple(others), error, max(steps, default=1e-5), each)
    if not instruments.two_faces:
        constants = nominal.Constants(**(constants.as_dict() | {"g": 0.0}))
    return constants, instruments


def sense(rng: np.random.Generator, world: World, instruments: Instruments) -> Sensed:
    """The thermometers of one run."""
    noise = {name: instruments.noise * rng.standard_normal(len(world.time)) for name in instruments.each}
    return Sensed(felt_by(instruments, world), noise, instruments)


def drawn_run(
    rng: np.random.Generator, name: str, world: World, instruments: Instruments, noise: StateNoise
) -> UnitRun:
    """A run of what happened, with the noise of its thermometers and of the gyro."""
    series = noise.series(rng, len(world.time), world.sample_s)
    return UnitRun(name, world, sense(rng, world, instruments), series, int(rng.integers(2**62)))


def felt_by(instruments: Instruments, world: World) -> dict[str, FloatArray]:
    """What thermometers feel, by recorded name [degC]."""
    each = instruments.each.items()
    return {name: late(world.nodes[one.place], one.lag_s, world.sample_s) for name, one in each}


def quick_enough(unit: Unit) -> Unit:
    """The unit with thermometers so quick that what their lag alone does to a replay is lost in the noise."""

    def falsified(run: UnitRun) -> FloatArray:
        replayed = nominal.output(unit.constants, unit.seen(run, run.sensed.exact()))
        missed = unit.output(run) - replayed
        return missed[unit.skipped :]

    length = Scales(unit).projected().length([falsified(run) for run in unit.fit])
    if length <= _LAG_D_PRIME:
        return unit
    factor = 0.8 * _LAG_D_PRIME / length
    each = {name: replace(one, lag_s=factor * one.lag_s) for name, one in unit.instruments.each.items()}
    quicker = replace(unit.instruments, each=each)

    def again(run: UnitRun) -> UnitRun:
        return replace(run, sensed=Sensed(felt_by(quicker, run.world), run.sensed.noise, quicker))

    return replace(
        unit,
        instruments=quicker,
        fit=tuple(again(run) for run in unit.fit),
        held_out=tuple(again(run) for run in unit.held_out),
        static=again(unit.static) if unit.static else None,
    )
