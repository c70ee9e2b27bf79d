"""Quantities with a unit, a range for each grade of gyro, and the prior that follows."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from numbers import Real
from typing import Any, Literal

import numpy as np

from fogml.errors import InputError
from fogml.intervals import Z90

Grade = Literal["tactical", "navigation"]
GRADES: tuple[Grade, ...] = ("tactical", "navigation")
Range = tuple[float, float]
"""Low and high; the usual one of a grade is read as the central 90 % of a log-normal or normal law."""


@dataclass(frozen=True)
class Quantity:
    """An amplitude or a shape parameter.

    Attributes
    ----------
    name
        Whole words, e.g. ``half_width``.
    unit
        Its unit, e.g. ``degC``; ``1`` for a pure number.
    tactical, navigation
        Usual range (low, high) for the grade; of the size where `signed`.
    limits
        What is physically possible; outside is an error.
    signed
        Whether either sign occurs: then the range is that of the size.
    meaning
        A few words.
    default
        What is taken where nothing is stated; the middle of the grade's range if None.
    whole
        Whether it counts something: draws are whole numbers, 1 at least in size.
    """

    name: str
    unit: str
    tactical: Range
    navigation: Range
    meaning: str = ""
    limits: Range = (-math.inf, math.inf)
    signed: bool = False
    default: float | None = None
    whole: bool = False

    def range(self, grade: Grade) -> tuple[float, float]:
        """Usual range (low, high) for a grade."""
        return self.tactical if grade == "tactical" else self.navigation

    def typical(self, grade: Grade = "tactical") -> float:
        """`default`, else the middle of the grade's range: geometric where all of it is positive."""
        if self.default is not None:
            return self.default
        low, high = self.range(grade)
        return self.within(math.sqrt(low * high) if low > 0.0 else 0.5 * (low + high))

    def within(self, value: float) -> float:
        """A value brought to where it can be: within `limits`, and whole where it counts."""
        if self.whole:
            value = math.copysign(max(float(round(abs(value))), 1.0), value)
        return float(np.clip(value, *self.limits))

    def law(self, grade: Grade) -> tuple[float, float, bool]:
        """Middle and standard deviation of the prior, of a `signed` one's size; whether of the logarithm."""
        low, high = self.range(grade)
        if low > 0.0:
            return 0.5 * math.log(low * high), 0.5 * math.log(high / low) / Z90, True
        return 0.5 * (low + high), 0.5 * (high - low) / Z90, False

    @property
    def all_round(self) -> bool:
        """Whether it is a direction, of which none is more usual than others."""
        low, high = self.tactical
        return self.unit == "deg" and high - low >= 180.0

    def draw(self, rng: np.random.Generator, grade: Grade = "tactical") -> float:
        """A value from the prior, within `limits`; the sign is fair where `signed`.

        Log-normal with the range as its central 90 %, normal where the range reaches zero or below, even over
        the range where it is `all_round`.
        """
        middle, spread, log = self.law(grade)
        deviate = float(rng.standard_normal())
        value = middle + spread * deviate
        if self.all_round:
            low, high = self.range(grade)
            value = low + (high - low) * 0.5 * math.erfc(-deviate / math.sqrt(2.0))
        sign = float(rng.choice((-1.0, 1.0))) if self.signed else 1.0
        return self.within(sign * (math.exp(value) if log else value))

    def check(self, value: float, owner: str) -> float:
        """The value as a float.

        Raises
        ------
        InputError
            If it is not a finite number within `limits`; the message names owner and key.
        """
        self.check_finite(value, owner)
        if self.whole and value != round(value):
            raise InputError(f"{owner}: '{self.name}' is {value:g}; a whole number is needed")
        low, high = self.limits
        if not low <= value <= high:
            raise InputError(
                f"{owner}: '{self.name}' is {with_unit(value, self.unit)}, which is not physical; "
                f"it lies between {low:g} and {with_unit(high, self.unit)}"
            )
        return float(value)

    def check_finite(self, value: float, owner: str) -> None:
        """Raise an `InputError` as `check` does, if it is not a finite number, whatever the limits."""
        if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
            unit = "" if self.unit == "1" else f" in {self.unit}"
            raise InputError(f"{owner}: '{self.name}' is {value!r}; a number{unit} is needed")


def check_all(held: object, quantities: Iterable[Quantity], owner: str) -> None:
    """Check what `held` has under the quantities' names, see `Quantity.check`."""
    for quantity in quantities:
        quantity.check(getattr(held, quantity.name), owner)


def limited(name: str, unit: str, low: float, high: float, *, whole: bool = False) -> Quantity:
    """A quantity that has limits and no usual range."""
    return Quantity(name, unit, (0.0, 0.0), (0.0, 0.0), limits=(low, high), whole=whole)


def unsigned(
    unit: str, tactical: Range, navigation: Range, meaning: str, most: float, **more: Any
) -> Quantity:
    """The amplitude of an effect that has a size alone, from 0 to `most`."""
    return Quantity("amplitude", unit, tactical, navigation, meaning, (0.0, most), **more)


def signed(unit: str, tactical: Range, navigation: Range, meaning: str, most: float, **more: Any) -> Quantity:
    """The amplitude of an effect of either sign, up to `most` in size."""
    return Quantity("amplitude", unit, tactical, navigation, meaning, (-most, most), signed=True, **more)


def shared(name: str, unit: str, usual: Range, meaning: str, limits: Range, **more: Any) -> Quantity:
    """A quantity whose usual range is that of either grade."""
    return Quantity(name, unit, usual, usual, meaning, limits, **more)


def phase(name: str, meaning: str) -> Quantity:
    """An angle [deg] of which none is more usual than others; 0 unless stated."""
    return shared(name, "deg", (0.0, 360.0), meaning, (-720.0, 720.0), default=0.0)


def with_unit(value: float, unit: str) -> str:
    """A number and its unit; the number alone where it is a pure one."""
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"
