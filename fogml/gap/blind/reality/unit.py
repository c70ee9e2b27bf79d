"""One unit and its runs: drawn to show given effects, without any of them yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.gap.blind.reality import nominal
from fogml.gap.blind.reality.form import Form
from fogml.gap.blind.reality.noise import NoiseConstants, draw_noise, draw_series
from fogml.gap.blind.reality.plant import Plant, draw_plant
from fogml.gap.blind.reality.programme import Demands, Programme, draw_programme, static_programme
from fogml.gap.blind.reality.recurrences import FloatArray
from fogml.gap.blind.reality.sensors import Instruments, Sensed, draw_instruments, faces, sense
from fogml.gap.blind.reality.whitening import Whitening
from fogml.gap.blind.reality.world import SetUp, World, happen

_STATIC_FACTOR = 1.3
"""Noise constants of another day, relative to those of the runs."""


@dataclass(frozen=True, eq=False)
class UnitRun:
    """One run of a unit: what happened, what its sensors felt, its noise.

    Attributes
    ----------
    name
        Base name of the file.
    noise
        Realised [deg/h], shape (n,).
    seed
        Of whatever an effect draws for this run.
    """

    name: str
    world: World
    sensed: Sensed
    noise: FloatArray
    seed: int


@dataclass(frozen=True, eq=False)
class Unit:
    """A unit with its runs, before any effect.

    Attributes
    ----------
    constants, noise
        Of its nominal gyro in the thermal runs.
    fit, held_out, static
        Runs.
    earth_stated
        Whether the side files state latitude and axis.
    """

    plant: Plant
    constants: nominal.Constants
    noise: NoiseConstants
    instruments: Instruments
    set_up: SetUp
    earth_stated: bool
    sample_s: float
    fit: tuple[UnitRun, ...]
    held_out: tuple[UnitRun, ...]
    static: UnitRun | None

    def output(self, run: UnitRun) -> FloatArray:
        """The nominal gyro's true output without noise [deg/h], shape (n,)."""
        world = run.world
        outer = world.nodes["T_out"] if self.instruments.two_faces else None
        seen = nominal.Seen(world.nodes["T_in"], outer, world.deltas["T_in"], world.rate_deg_h)
        return nominal.output(self.constants, seen)

    def seen(self, run: UnitRun, recorded: dict[str, FloatArray]) -> nominal.Seen:
        """What a replay of `recorded` temperatures [degC] acts on."""
        inner, outer = faces(recorded, self.instruments.layout)
        delta = nominal.delta_of_record(run.world.time, inner)
        return nominal.Seen(inner, outer, delta, run.world.rate_deg_h)

    @property
    def runs(self) -> tuple[UnitRun, ...]:
        """All thermal runs."""
        return (*self.fit, *self.held_out)

    @property
    def turning(self) -> bool:
        """Whether the table turns in any of them."""
        return any(run.world.table_rate.any() for run in self.runs)

    @property
    def constant_names(self) -> tuple[str, ...]:
        """Nominal constants that show in the runs."""
        return nominal.names(self.turning, self.instruments.two_faces)

    @property
    def skipped(self) -> int:
        """Rows at a run's start that count for nothing: the windows of DeltaT are not full there."""
        return int(np.ceil(2.0 * nominal.WINDOW_S / self.sample_s))

    def columns(self, run: UnitRun, recorded: dict[str, FloatArray]) -> FloatArray:
        """Responses of a replay of `recorded` temperatures to the nominal constants, on the rows that count.

        Shape (n - skipped, p).
        """
        return nominal.columns(self.seen(run, recorded), self.constant_names)[self.skipped :]

    def whitening(self, run: UnitRun) -> Whitening:
        """The true whitening of a run's rows that count."""
        count = len(run.world.time) - self.skipped
        inner = run.world.nodes["T_in"][self.skipped :] - 25.0
        rate = 1e-6 * run.world.rate_deg_h[self.skipped :]
        c, tools = self.constants, self.instruments
        # DeltaT and the difference of the faces see little of it; a scale factor over temperature does.
        slope = c.b1 + 2.0 * c.b2 * inner + rate * (c.k1 + 2.0 * c.k2 * inner)
        sensors = 2.0 if tools.layout == "four" else 1.0
        variance = (tools.noise**2 + tools.resolution**2 / 12.0) / sensors
        return Whitening(self.noise, count, self.sample_s, self.skipped, slope**2 * variance)


def compatible(forms: Sequence[type[Form]]) -> bool:
    """Whether one set of programmes can show all of them."""
    turning = any(f.demands.turns or f.demands.slow_turns for f in forms)
    upright = any(f.demands.slow_turns for f in forms)
    fast = any(f.demands.turns and not f.demands.small_rates for f in forms)
    small = any(f.demands.small_rates for f in forms)
    # Any edge of the table's rate would show the smallest skew, and nothing else.
    skewed = any(f.name == "logger_skew" for f in forms)
    flat = any(f.horizontal for f in forms)
    names = [f.name for f in forms]
    return len(set(names)) == len(names) and not (
        (skewed and turning) or (flat and upright) or (small and fast)
    )


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
    set_up = _draw_set_up(rng, forms)
    earth_stated = bool(rng.random() < 0.85)
    demands = _draw_demands(rng, forms)
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
    )


def _draw_set_up(rng: np.random.Generator, forms: Sequence[type[Form]]) -> SetUp:
    latitude = float(rng.uniform(20.0, 60.0))
    if any(f.horizontal for f in forms):
        return SetUp(latitude, float(rng.choice([90.0, 270.0])))
    if any(f.demands.slow_turns for f in forms) or rng.random() < 0.75:
        return SetUp(latitude, None)
    return SetUp(latitude, float(rng.uniform(0.0, 360.0)))


def _draw_demands(rng: np.random.Generator, forms: Sequence[type[Form]]) -> Demands:
    """What the forms ask for, and the rest by chance."""
    kinds = [name for name, value in vars(Demands()).items() if isinstance(value, bool)]
    asked = {name: any(getattr(f.demands, name) for f in forms) for name in kinds}
    by_chance = rng.random(len(kinds))
    still = any(f.name == "logger_skew" for f in forms)
    chance = {"turns": 0.0 if still else 0.4, "power_steps": 0.3, "fan_stops": 0.15}
    drawn = {
        name: bool(wanted or draw < chance.get(name, 0.0))
        for (name, wanted), draw in zip(asked.items(), by_chance)
    }
    return Demands(**drawn, top_rate=float(np.exp(rng.uniform(np.log(10.0), np.log(80.0)))))
