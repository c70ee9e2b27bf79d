"""The form that an effect takes in a reality: one class, one declaration; and what runs it needs to show."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.record import SetUp, World

Shape = dict[str, float]


@dataclass(frozen=True)
class Demands:
    """What the programmes of a unit's runs must hold, for its effects to show.

    Attributes
    ----------
    turns
        Ladders of table rates in soaks.
    slow_turns
        The table goes round slowly through soaks and ramps.
    small_rates
        The ladders go down to hundredths of a deg/h.
    shock
        One change of the air as fast as the chamber can.
    power_steps
        The unit's power and supply step.
    fan_stops
        The chamber's fan stops for a while.
    power_on
        Each run begins with power-on.
    top_rate
        The greatest rate of the unit's ladders [deg/s].
    """

    turns: bool = False
    slow_turns: bool = False
    small_rates: bool = False
    shock: bool = False
    power_steps: bool = False
    fan_stops: bool = False
    power_on: bool = False
    top_rate: float = 40.0


_WIDE = 5.0


def _within(rng: np.random.Generator, low: float, high: float, evenly: bool) -> float:
    if low > 0.0 and high / low >= _WIDE and not evenly:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))
    return float(rng.uniform(low, high))


class Form(ABC):
    """An effect as it truly acts.

    Attributes
    ----------
    name
        Id of the catalogue's effect that it is a form of, or a name of its own where there is none.
    known
        Whether the catalogue holds it.
    stage
        Where it acts, as the catalogue names it.
    form
        What this form is, in a word or two.
    unit
        Of the amplitude in the catalogue's definition; "" where this form has none that compares.
    demands
        What the programmes must hold for it to show.
    faces
        Whether it needs a sensor on both faces.
    records
        Columns that are recorded, for it to be told.
    fine_sensors
        Whether it acts by rates or small differences of temperature that take good sensors.
    several_runs
        Whether one run can't show it.
    drawn_per_run
        Whether each run has one of its own, which no other run tells.
    horizontal
        Whether the input axis must lie east or west.
    quick_plant
        Whether the unit must be light.
    ranges
        Lowest and highest value of each shape parameter, for those that `draw` draws one by one.
    evenly
        Those of them that are drawn evenly, however wide their range is.
    largest
        Amplitude beyond which no gyro has it; where it would take more to show, the unit can't show it.
    """

    name: ClassVar[str]
    known: ClassVar[bool] = True
    stage: ClassVar[str] = "bias"
    form: ClassVar[str] = ""
    unit: ClassVar[str] = ""
    demands: ClassVar[Demands] = Demands()
    faces: ClassVar[bool] = False
    records: ClassVar[tuple[str, ...]] = ()
    fine_sensors: ClassVar[bool] = False
    several_runs: ClassVar[bool] = False
    drawn_per_run: ClassVar[bool] = False
    horizontal: ClassVar[bool] = False
    quick_plant: ClassVar[bool] = False
    ranges: ClassVar[dict[str, tuple[float, float]]] = {}
    evenly: ClassVar[tuple[str, ...]] = ()
    largest: ClassVar[float] = np.inf

    def draw(self, rng: np.random.Generator) -> Shape:
        """Shape parameters: over `ranges`, evenly in the logarithm where a range spans a factor of 5."""
        return {name: _within(rng, *ends, name in self.evenly) for name, ends in self.ranges.items()}


class Additive(Form):
    """Adds to the output in proportion to its amplitude."""

    @abstractmethod
    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Change of the output per unit of amplitude [deg/h], shape (n,).

        `rng` is the same for every call on one run.
        """


class ScaleFactor(Additive):
    """Adds to the scale factor error [ppm]."""

    stage: ClassVar[str] = "scale_factor"
    demands: ClassVar[Demands] = Demands(turns=True)

    def response(self, world: World, shape: Shape, rng: np.random.Generator) -> FloatArray:
        """Change of the output per unit of amplitude [deg/h], shape (n,)."""
        return 1e-6 * world.rate_deg_h * self.error(world, shape)

    @abstractmethod
    def error(self, world: World, shape: Shape) -> FloatArray:
        """Scale factor error per unit of amplitude [ppm], shape (n,)."""


class Distorting(Form):
    """Changes the noise-free output as a whole; not linear in its amplitude, which has the sign +."""

    greatest: ClassVar[float] = 100.0
    """The largest amplitude that is tried."""

    @abstractmethod
    def distorted(self, output: FloatArray, world: World, amplitude: float, shape: Shape) -> FloatArray:
        """The output [deg/h] that comes of a noise-free `output` [deg/h], shape (n,)."""


OUTER = ("T_out", "T2", "T4")
"""Thermometers on the coil's outer face."""


class Sensing(Form):
    """Falsifies what the coil's sensors feel; not linear in its amplitude, which has the sign +."""

    stage: ClassVar[str] = "sensor"
    greatest: ClassVar[float] = 100.0

    def felt(
        self, name: str, temperature: FloatArray, world: World, amplitude: float, shape: Shape
    ) -> FloatArray:
        """What the coil sensor `name` feels where it would feel `temperature` [degC], shape (n,)."""
        return temperature

    def read(self, values: FloatArray, amplitude: float, shape: Shape) -> FloatArray:
        """What is recorded of a coil sensor that gives `values` [degC], noise included; shape (n,)."""
        return values


def forms_in(*modules: ModuleType, known: bool = True) -> tuple[type[Form], ...]:
    """Forms that modules declare, in their order: of effects that the catalogue holds, or of others."""
    declared = [(module.__name__, each) for module in modules for each in vars(module).values()]
    forms = [each for home, each in declared if isinstance(each, type) and each.__module__ == home]
    return tuple(form for form in forms if issubclass(form, Form) and form.known == known)


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


def draw_set_up(
    rng: np.random.Generator,
    forms: Sequence[type[Form]],
    latitudes: tuple[float, float],
    upright: float,
) -> SetUp:
    """Where a unit stands and which way it points.

    Parameters
    ----------
    rng
        Generator that is drawn from.
    forms
        Effects that have to show; some need the axis horizontal, some need it up.
    latitudes
        Range of the latitude [deg].
    upright
        Share of units with the axis up where no effect asks for either.
    """
    latitude = float(rng.uniform(*latitudes))
    if any(f.horizontal for f in forms):
        return SetUp(latitude, float(rng.choice([90.0, 270.0])))
    if any(f.demands.slow_turns for f in forms) or rng.random() < upright:
        return SetUp(latitude, None)
    return SetUp(latitude, float(rng.uniform(0.0, 360.0)))


def draw_demands(
    rng: np.random.Generator,
    forms: Sequence[type[Form]],
    chance: Mapping[str, float],
    top_rates: tuple[float, float],
) -> Demands:
    """What the forms ask of the programmes, and the rest by chance.

    Parameters
    ----------
    rng
        Generator that is drawn from.
    forms
        Effects that have to show. Turns would tell `logger_skew`, and come with it only where asked for.
    chance
        Probability of a demand that none asks for, by its name; 0 unless stated.
    top_rates
        Range of the greatest table rate [deg/s], log-uniform.
    """
    kinds = [name for name, value in vars(Demands()).items() if isinstance(value, bool)]
    by_chance = dict(zip(kinds, rng.random(len(kinds)).tolist()))
    likely = {**chance, "turns": 0.0} if any(f.name == "logger_skew" for f in forms) else chance
    drawn = {
        name: any(getattr(f.demands, name) for f in forms) or by_chance[name] < likely.get(name, 0.0)
        for name in kinds
    }
    return Demands(**drawn, top_rate=float(np.exp(rng.uniform(*np.log(top_rates)))))
