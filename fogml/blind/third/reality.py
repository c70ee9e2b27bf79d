"""The third reality: its units with their runs, one after another within days, and all of its forms."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from fogml.blind.frame import nominal
from fogml.blind.frame.form import Demands, Form, forms_in
from fogml.blind.frame.noise import StateNoise
from fogml.blind.frame.reality import Reality
from fogml.blind.frame.record import SetUp
from fogml.blind.frame.thermometers import draw_instruments, quick_enough, sense
from fogml.blind.frame.unit import Unit, UnitRun
from fogml.blind.third.effects import driven, unknown, winding
from fogml.blind.third.plant import Plant, draw_plant
from fogml.blind.third.programme import Programme, draw_programme, static_programme
from fogml.blind.third.world import happen

_MIDDLE = {"N": 0.006, "slow": 0.006, "K": 0.003}
_ANOTHER_DAY = 1.15


def draw_noise(rng: np.random.Generator) -> StateNoise:
    """White, two or three processes of any time constants between 20 s and 8 h, and a walk."""
    scatter = np.exp(np.log(2.5) * np.clip(rng.standard_normal(3), -2.0, 2.0))
    white, slow, walk = (middle * float(f) for middle, f in zip(_MIDDLE.values(), scatter))
    count = int(rng.integers(2, 4))
    taus = np.sort(np.exp(rng.uniform(np.log(20.0), np.log(28800.0), count)))
    return StateNoise(white, slow**2 * rng.uniform(0.1, 0.6, count), taus, walk)


def draw_unit(
    rng: np.random.Generator, forms: Sequence[type[Form]], runs: int, static: bool, sample_s: float
) -> Unit:
    """A unit whose programmes and instruments show the given forms; `runs` to fit on, one held out."""
    plant = Plant(draw_plant(rng, any(f.quick_plant for f in forms)))
    noise = draw_noise(rng)
    kinds = ("turns", "slow_turns", "small_rates", "shock", "power_steps", "power_on")
    asked = {name: any(getattr(f.demands, name) for f in forms) for name in kinds}
    still = any(f.name == "logger_skew" for f in forms)
    asked["turns"] |= not still and rng.random() < 0.25
    asked["power_steps"] |= rng.random() < 0.25
    demands = Demands(**asked, top_rate=float(np.exp(rng.uniform(np.log(8.0), np.log(60.0)))))
    constants = nominal.draw_constants(rng, True)
    rest, turning = nominal.temperature_slopes(constants, sample_s)
    turning *= demands.top_rate * float(demands.turns and not demands.small_rates)
    needed = tuple(dict.fromkeys(column for f in forms for column in f.records))
    instruments = draw_instruments(
        rng,
        any(f.faces for f in forms),
        any(f.fine_sensors for f in forms),
        needed,
        noise.N / np.sqrt(sample_s / 3600.0),
        (rest, turning),
    )
    if not instruments.two_faces:
        constants = nominal.Constants(**(constants.as_dict() | {"g": 0.0}))
    latitude = float(rng.uniform(25.0, 58.0))
    heading = float(rng.choice([90.0, 270.0])) if any(f.horizontal for f in forms) else None
    set_up = SetUp(latitude, heading)
    begin = 0.0
    past: tuple[float, ...] = (22.0,)

    def run(name: str, programme: Programme, of: StateNoise, place: int) -> UnitRun:
        world = happen(rng, plant, programme, set_up, sample_s, place, begin, past)
        series = of.series(rng, len(world.time), sample_s)
        return UnitRun(name, world, sense(rng, world, instruments), series, int(rng.integers(2**62)))

    thermal = []
    for place in range(runs + 1):
        name = f"fit-{place + 1}.csv" if place < runs else "held-out-1.csv"
        one = run(name, draw_programme(rng, demands, sample_s), noise, place)
        thermal.append(one)
        winding = one.world.nodes["T_coil"]
        past = (*past, float(winding.min()), float(winding.max()), float(winding[-1]))
        begin += float(one.world.time[-1]) + 86400.0 * float(rng.uniform(0.2, 4.0))
    quiet = None
    if static:
        other = noise.of_another_day(rng, _ANOTHER_DAY)
        quiet = run("static.csv", static_programme(rng, sample_s), other, runs + 1)
    first_day = datetime(2026, 6, 1, 8, 0, tzinfo=UTC) + timedelta(minutes=int(rng.integers(0, 200000)))
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
        first_day=first_day if rng.random() < 0.5 else None,
    )
    return quick_enough(unit, instruments)


KNOWN = forms_in(winding, driven)
"""Forms of effects that a gyro's physics knows by name; those of supply, field and rig stand elsewhere."""
INVENTED = forms_in(unknown, known=False)
"""Effects that no library holds."""
REALITY = Reality("third", KNOWN, INVENTED, winding.OtherInside, draw_unit)
