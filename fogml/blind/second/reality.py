"""The second reality: its units with their runs, days apart, drawn to show given effects; all of its forms.

A unit's noise is white, a slope of its own between flat and steep, at times a bump, and a walk. The slope is
a sum of Ornstein-Uhlenbeck processes, one in each half decade of time constants, whose variances follow a
power of the time constant and scatter about it: no unit's is 1/f.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from fogml.blind.frame import nominal
from fogml.blind.frame.form import Form, draw_demands, draw_set_up, forms_in
from fogml.blind.frame.noise import StateNoise
from fogml.blind.frame.reality import Reality
from fogml.blind.frame.record import World
from fogml.blind.frame.thermometers import draw_instruments, quick_enough, sense
from fogml.blind.frame.unit import Unit, UnitRun
from fogml.blind.second.effects import driven, lasting, sensing, turning, unknown, winding
from fogml.blind.second.plant import Plant, draw_plant
from fogml.blind.second.programme import Programme, draw_programme, static_programme
from fogml.blind.second.world import draw_chamber, happen

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
    faces = any(f.faces for f in forms)
    constants = nominal.draw_constants(rng, True)
    rest, turning = nominal.temperature_slopes(constants, sample_s)
    turning *= demands.top_rate * float(demands.turns and not demands.small_rates)
    white = noise.N / np.sqrt(sample_s / 3600.0)
    needed = tuple(dict.fromkeys(column for f in forms for column in f.records))
    fine = any(f.fine_sensors for f in forms)
    instruments = draw_instruments(rng, faces, fine, needed, white, (rest, turning))
    if not instruments.two_faces:
        constants = nominal.Constants(**(constants.as_dict() | {"g": 0.0}))
    chamber = draw_chamber(rng)
    begin, past = 0.0, tuple(rng.uniform((-20.0, 20.0, 15.0), (15.0, 55.0, 30.0)).tolist())

    def run(name: str, programme: Programme, of: StateNoise, place: int) -> UnitRun:
        world = happen(rng, plant, chamber, programme, set_up, sample_s, place, begin, past)
        series = of.series(rng, len(world.time), sample_s)
        return UnitRun(name, world, sense(rng, world, instruments), series, int(rng.integers(2**62)))

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
    return quick_enough(unit, instruments)


def _remembered(past: tuple[float, ...], world: World) -> tuple[float, ...]:
    """Where the winding turned, with the run's own extremes and its end; then back to the room."""
    winding = world.nodes["T_coil"]
    low, high = int(winding.argmin()), int(winding.argmax())
    turned = [float(winding[k]) for k in sorted((low, high))]
    return (*past, *turned, float(winding[-1]), 22.0)


KNOWN = forms_in(winding, lasting, driven, turning, sensing)
"""Forms of effects that a gyro's physics knows by name; how near the catalogue's are is not asked.

``mount_tilt`` and ``coil_expansion`` have none: with Earth rate alone on a table that turns, and with sensors
on the coil, no run of a unit here shows them.
"""
INVENTED = forms_in(unknown, sensing, known=False)
"""Effects that no library holds."""
REALITY = Reality("second", KNOWN, INVENTED, lasting.AnotherOrder, draw_unit)
