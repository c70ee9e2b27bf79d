"""The first reality: its units with their runs, drawn to show given effects, and all of its forms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.blind.first.effects import coil, electrical, invented, memory, sensing, turning
from fogml.blind.first.noise import NoiseConstants, draw_noise, draw_series
from fogml.blind.first.plant import Plant, draw_plant
from fogml.blind.first.programme import Programme, draw_programme, static_programme
from fogml.blind.first.sensors import draw_instruments, sense
from fogml.blind.first.world import happen
from fogml.blind.frame import nominal
from fogml.blind.frame.form import Demands, Form, draw_demands, draw_set_up, forms_in
from fogml.blind.frame.reality import Reality
from fogml.blind.frame.record import World
from fogml.blind.frame.unit import Unit, UnitRun

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
    instruments = instruments.finer(slope, turning_slope, noise.N / np.sqrt(sample_s / 3600.0))

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


KNOWN = forms_in(coil, memory, electrical, turning, sensing)
"""Forms of effects that the catalogue holds; some effects have two.

``mount_tilt`` has none: with Earth rate alone on a table that turns, a tilt that a fixture has stays
far under the noise of every unit here.
"""
INVENTED = forms_in(invented, sensing, turning, known=False)
"""Effects that no library holds."""
WRONG_STRUCTURE = memory.DeepPlate
"""Another thermal order than any twin's."""


REALITY = Reality("first", KNOWN, INVENTED, WRONG_STRUCTURE, draw_unit)
