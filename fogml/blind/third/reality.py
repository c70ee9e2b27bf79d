"""The third reality: its units with their runs, one after another within days, and all of its forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Demands, Form, forms_in
from fogml.blind.frame.noise import StateNoise
from fogml.blind.frame.operators import late
from fogml.blind.frame.record import Course, SetUp, World
from fogml.blind.frame.thermometers import draw_instruments, drawn_run, quick_enough
from fogml.blind.frame.unit import Reality, Unit, UnitRun
from fogml.blind.third.effects import driven, winding
from fogml.blind.third.plant import NAMES, Plant, draw_plant

Turns = tuple[tuple[float, float, float], ...]
_NODES_S = 30.0


@dataclass(frozen=True)
class Programme:
    """One run's programme.

    Attributes
    ----------
    kind
        Which kind of path.
    path
        Set point every 30 s from the run's beginning on [degC].
    turns
        (start s, stop s, rate deg/s).
    powered_on, duration_s
        s on the run's clock.
    loaded
        Whether the power steps with the clock's quarter hours.
    """

    kind: str
    path: FloatArray
    turns: Turns
    powered_on: float
    duration_s: float
    loaded: bool

    @property
    def text(self) -> str:
        """The chamber's part in words."""
        low, high = float(self.path.min()), float(self.path.max())
        return f"{self.kind} between {low:.0f} and {high:.0f} degC for {self.duration_s / 3600.0:.1f} h"

    def set_point(self, time: FloatArray) -> FloatArray:
        """Set point at times [degC]; held before the run."""
        nodes = _NODES_S * np.arange(len(self.path), dtype=np.float64)
        return np.interp(time, nodes, self.path)


def draw_programme(rng: np.random.Generator, demands: Demands, sample_s: float) -> Programme:
    """A run of 5 to 8 h."""
    duration = float(np.round(rng.uniform(5.0, 8.0) * 3600.0 / sample_s) * sample_s)
    t = _NODES_S * np.arange(int(duration / _NODES_S) + 2, dtype=np.float64)
    kind = "plunges" if demands.shock else str(rng.choice(list(_KINDS)))
    low = float(rng.uniform(-40.0, 0.0))
    path = _KINDS.get(kind, _plunges)(rng, t, low, float(rng.uniform(max(low + 35.0, 38.0), 70.0)))
    turns: Turns = ()
    if demands.turns or demands.slow_turns:
        turns = _turns(rng, duration, sample_s, demands)
    on = 0.0 if demands.power_on or rng.random() < 0.6 else -float(rng.uniform(600.0, 9000.0))
    return Programme(kind, np.clip(path, -42.0, 72.0), turns, on, duration, demands.power_steps)


def static_programme(rng: np.random.Generator, sample_s: float) -> Programme:
    """A run of 5 to 8 h at one temperature, for its noise."""
    duration = float(np.round(rng.uniform(5.0, 8.0) * 3600.0 / sample_s) * sample_s)
    level = np.full(int(duration / _NODES_S) + 2, float(rng.uniform(20.0, 28.0)))
    return Programme("rest", level, (), -15000.0, duration, False)


def _saw(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """Slowly up and quickly down, or the other way round."""
    period, steep = rng.uniform(5000.0, 14000.0), rng.uniform(0.08, 0.3)
    x = (t / period + rng.random()) % 1.0
    wave = np.where(x < 1.0 - steep, x / (1.0 - steep), (1.0 - x) / steep)
    return low + (high - low) * (wave if rng.random() < 0.5 else 1.0 - wave)


def _approaches(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """A new level every hour or so, approached exponentially."""
    found, level = np.empty_like(t), float(rng.uniform(18.0, 28.0))
    aim, left, tau = level, rng.uniform(600.0, 2400.0), 600.0
    for k in range(len(t)):
        if left <= 0.0:
            aim, left = float(rng.uniform(low, high)), float(rng.uniform(2400.0, 7000.0))
            tau = float(rng.uniform(300.0, 1500.0))
        level += (aim - level) * _NODES_S / tau
        left -= _NODES_S
        found[k] = level
    return found


def _plunges(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """From one end to the other as fast as the chamber can, with a long and a short stay."""
    period, share = rng.uniform(7000.0, 13000.0), rng.uniform(0.3, 0.7)
    x = (t / period + rng.uniform(0.0, 0.5)) % 1.0
    return np.where(x < share, low, high)


def _trips(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """A vehicle in and out of a hangar: smooth bumps upon a slow drift."""
    middle, size = 0.5 * (low + high), 0.5 * (high - low)
    waves = [(rng.uniform(4000.0, 30000.0), rng.uniform(0.0, 2 * np.pi), rng.exponential()) for _ in range(4)]
    total = sum(w * np.sin(2 * np.pi * t / p + a) for p, a, w in waves)
    return np.asarray(middle + size * total / np.abs(total).max())


def _growing(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """Swings that grow from turn to turn about the room."""
    period, room = rng.uniform(4000.0, 9000.0), rng.uniform(18.0, 28.0)
    swing = np.sin(2.0 * np.pi * t / period) * (0.2 + 0.8 * t / t[-1])
    return np.where(swing > 0.0, room + (high - room) * swing, room + (room - low) * swing)


_KINDS = {"saw": _saw, "approaches": _approaches, "plunges": _plunges, "trips": _trips, "growing": _growing}


def _turns(rng: np.random.Generator, duration: float, sample_s: float, demands: Demands) -> Turns:
    """Single turns at random times; small, fast or slow ones as the effects ask."""
    turns, t = [], float(sample_s * np.ceil(rng.uniform(200.0, 900.0) / sample_s))
    while t < duration - 300.0:
        if demands.slow_turns and (not demands.turns or rng.random() < 0.5):
            length, rate = rng.uniform(900.0, 4000.0), np.exp(rng.uniform(np.log(0.05), np.log(0.4)))
        elif demands.small_rates:
            length, rate = rng.uniform(60.0, 300.0), np.exp(rng.uniform(np.log(3e-5), np.log(5e-3)))
        else:
            length, rate = rng.uniform(20.0, 120.0), demands.top_rate * rng.beta(1.5, 1.0)
        stop = t + float(sample_s * np.ceil(length / sample_s))
        turns.append((t, min(stop, duration), float(rate * rng.choice([-1.0, 1.0]))))
        t = stop + float(sample_s * np.ceil(rng.exponential(400.0) / sample_s))
    return tuple(turns)


_FINE_S, _LONGEST_BEFORE_S = 10.0, 6000.0


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
    course = Course.of(programme, sample_s, _FINE_S, _LONGEST_BEFORE_S)
    fine, t, at = course.step_s, course.t, course.at
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
    full = {f"T_{name}": states[:, k] for k, name in enumerate(NAMES)}
    full |= {
        "T_in": full["T_inner"],
        "T_out": full["T_outer"],
        "T_coil": states[:, 2:5].mean(axis=1),
        "T_case": full["T_cover"],
        "T_electronics": full["T_board"],
        "T_chamber": air,
    }
    turn, level = np.radians(course.angle), rng.uniform(16.0, 26.0)
    stray = rng.normal(0.0, 2.0, 3)[:, None] * heater[at]
    shaking = rng.uniform(0.01, 0.05) * np.exp(0.3 * late(rng.standard_normal(len(at)), 60.0, sample_s))
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
    return course.world(
        full, states[:, 2:5], drives=drives, set_up=set_up, place=place, since_first=since_first, past=past
    )


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
    constants, instruments = draw_instruments(rng, forms, demands, noise, sample_s)
    latitude = float(rng.uniform(25.0, 58.0))
    heading = float(rng.choice([90.0, 270.0])) if any(f.horizontal for f in forms) else None
    set_up = SetUp(latitude, heading)
    begin = 0.0
    past: tuple[float, ...] = (22.0,)

    def run(name: str, programme: Programme, of: StateNoise, place: int) -> UnitRun:
        world = happen(rng, plant, programme, set_up, sample_s, place, begin, past)
        return drawn_run(rng, name, world, instruments, of)

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
    return quick_enough(unit)


KNOWN = forms_in(winding, driven)
"""Forms of effects that a gyro's physics knows by name; those of supply, field and rig stand elsewhere."""
INVENTED = forms_in(driven, known=False)
"""Effects that no library holds."""
REALITY = Reality("third", KNOWN, INVENTED, winding.OtherInside, draw_unit)
