"""Units and their runs, as every reality draws them, without effects; realities: forms and units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame import nominal
from fogml.blind.frame.form import Form
from fogml.blind.frame.noise import NoiseLaw, Whitening
from fogml.blind.frame.record import SetUp, World


@dataclass(frozen=True)
class Thermometer:
    """Readings are (1 + ``gain``) T + ``offset`` degC of what it feels ``lag_s`` late."""

    place: str
    gain: float
    offset: float
    lag_s: float


@dataclass(frozen=True)
class Instruments:
    """What is recorded of a unit, and how well.

    Attributes
    ----------
    layout
        Sensors on the coil: ``one`` for T, ``two`` for T_in and T_out, ``four`` for T1 to T4.
    others
        Further columns of the run format that are recorded.
    noise, resolution
        Of the temperature sensors [degC].
    each
        Thermometers by recorded name.
    """

    layout: str
    others: tuple[str, ...]
    noise: float
    resolution: float
    each: dict[str, Thermometer]

    @property
    def coil(self) -> dict[str, str]:
        """Recorded coil sensors to the face each sits on."""
        return {name: one.place for name, one in self.each.items() if name not in self.others}

    @property
    def two_faces(self) -> bool:
        """Whether there is a sensor on the outer face."""
        return self.layout != "one"


@dataclass(frozen=True, eq=False)
class Sensed:
    """What a run's thermometers feel, by recorded name [degC], shape (n,) each; their noise."""

    felt: dict[str, FloatArray]
    noise: dict[str, FloatArray]
    instruments: Instruments

    def recorded(self, felt: dict[str, FloatArray] | None = None) -> dict[str, FloatArray]:
        """Recorded columns; of other `felt` temperatures with the same noise, if given."""
        q, exact = self.instruments.resolution, self.exact(felt)
        return {n: np.round(np.round((x + self.noise[n]) / q) * q, 7) for n, x in exact.items()}

    def exact(self, felt: dict[str, FloatArray] | None = None) -> dict[str, FloatArray]:
        """The same without noise and steps."""
        each = self.instruments.each
        held = self.felt if felt is None else felt
        return {name: (1.0 + each[name].gain) * x + each[name].offset for name, x in held.items()}


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
    plant
        Of the reality's own kind.
    earth_stated
        Whether the side files state latitude and axis.
    shown
        Recorded columns beside the time, the gyro, the table and the temperatures.
    first_day
        Day and time of the first run in UTC, where the side files state when runs began; else None.
    """

    plant: Any
    constants: nominal.Constants
    noise: NoiseLaw
    instruments: Instruments
    set_up: SetUp
    earth_stated: bool
    sample_s: float
    fit: tuple[UnitRun, ...]
    held_out: tuple[UnitRun, ...]
    static: UnitRun | None
    shown: tuple[str, ...] = ()
    first_day: datetime | None = None

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


def faces(recorded: dict[str, FloatArray], layout: str) -> tuple[FloatArray, FloatArray | None]:
    """Inner and outer face as the run format has them: means of the odd and of the even sensors."""
    if layout == "one":
        return recorded["T"], None
    if layout == "two":
        return recorded["T_in"], recorded["T_out"]
    return 0.5 * (recorded["T1"] + recorded["T3"]), 0.5 * (recorded["T2"] + recorded["T4"])


DrawUnit = Callable[[np.random.Generator, Sequence[type[Form]], int, bool, float], Unit]
"""Draws a unit whose programmes and instruments show forms, with so many runs to fit on and one held out,
a static one if asked for, at a sample interval [s]."""


@dataclass(frozen=True)
class Reality:
    """One reality.

    Attributes
    ----------
    name
        As it is chosen by.
    known
        Forms of effects that the catalogue holds; an effect may have several.
    invented
        Effects that no library holds.
    wrong_structure
        Another thermal order than any twin's.
    draw_unit
        Its units.
    """

    name: str
    known: tuple[type[Form], ...]
    invented: tuple[type[Form], ...]
    wrong_structure: type[Form]
    draw_unit: DrawUnit

    @property
    def known_names(self) -> tuple[str, ...]:
        """Ids of the catalogue's effects that have a form here, in order."""
        return tuple(dict.fromkeys(form.name for form in self.known))

    @property
    def invented_names(self) -> tuple[str, ...]:
        """Names of what no library holds, in order."""
        return tuple(dict.fromkeys(form.name for form in self.invented))

    def forms_of(self, name: str) -> tuple[type[Form], ...]:
        """Forms of one effect, known or not."""
        everything = (*self.known, *self.invented, self.wrong_structure)
        return tuple(form for form in everything if form.name == name)
