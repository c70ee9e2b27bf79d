"""What a programme is made of: steps of the chamber, and actions within a step.

Each can be written as the plain sentence that `fogml.twin.sentences` reads.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from fogml.errors import InputError
from fogml.numerals import number_text

Switched = Literal["power", "fan", "compressor", "heater", "humidity", "radiation", "yaw"]
SWITCHED: tuple[Switched, ...] = get_args(Switched)
FASTEST_DEG_S = 10_000.0
"""No table turns faster."""
_LONGEST_S = 1e9
_SHORTEST_S = 1e-6
_CYCLE_SLACK = 1e-6
_COLDEST, _HOTTEST = -100.0, 150.0
AUTOMATIC: tuple[Switched, ...] = ("compressor", "heater", "humidity")
"""What the chamber sees to by itself unless told otherwise."""


def duration_text(seconds: float) -> str:
    """A time such as ``1 h`` or ``90 s``, in the largest unit that gives a whole number."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= size and seconds % size == 0.0:
            return f"{number_text(seconds / size)} {unit}"
    return f"{number_text(seconds)} s"


def _need(value: float, low: float, high: float, what: str) -> None:
    """Check that a number of a programme made in Python lies where it can."""
    if not (math.isfinite(value) and low <= value <= high):
        raise InputError(f"{what} is {value:g}; it lies between {low:g} and {high:g}")


def _from_text(start_s: float) -> str:
    return f" from {duration_text(start_s)}" if start_s else ""


@dataclass(frozen=True)
class Turn:
    """Turn the table at one rate after another, then stop.

    Attributes
    ----------
    segments
        (rate [deg/s], time [s]) in turn; a time of None lasts to the end of the step.
    start_s
        When, from the beginning of the step [s].
    """

    segments: tuple[tuple[float, float | None], ...]
    start_s: float = 0.0

    def __post_init__(self) -> None:
        if not self.segments or any(time is None for _, time in self.segments[:-1]):
            raise InputError("a turn needs rates, and all but the last a time")
        _need(self.start_s, 0.0, _LONGEST_S, "turn: start [s]")
        for rate, time in self.segments:
            _need(rate, -FASTEST_DEG_S, FASTEST_DEG_S, "turn: rate [deg/s]")
            _need(1.0 if time is None else time, _SHORTEST_S, _LONGEST_S, "turn: time [s]")

    def __str__(self) -> str:
        parts = [
            f"{number_text(rate)} deg/s" + ("" if time is None else f" for {duration_text(time)}")
            for rate, time in self.segments
        ]
        return f"turn at {', then '.join(parts)}" + (f",{_from_text(self.start_s)}" if self.start_s else "")


@dataclass(frozen=True)
class TurnTo:
    """Turn the table to an angle [deg] the shorter way round, or by an angle, at a rate [deg/s]."""

    angle_deg: float
    rate_deg_s: float
    start_s: float = 0.0
    relative: bool = False

    def __post_init__(self) -> None:
        _need(self.angle_deg, -1e6, 1e6, "turn: angle [deg]")
        _need(self.rate_deg_s, 1e-9, FASTEST_DEG_S, "turn: rate on the way to an angle [deg/s]")
        _need(self.start_s, 0.0, _LONGEST_S, "turn: start [s]")

    def __str__(self) -> str:
        way = "by" if self.relative else "to"
        text = f"turn {way} {number_text(self.angle_deg)} deg at {number_text(self.rate_deg_s)} deg/s"
        return text + _from_text(self.start_s)


@dataclass(frozen=True)
class Oscillate:
    """Turn to and fro about rest: rate ``rate_deg_s sin(2 pi frequency_hz t)`` for a whole number of cycles.

    Attributes
    ----------
    rate_deg_s, frequency_hz
        Greatest rate [deg/s] and frequency [Hz].
    duration_s, start_s
        For how long, and when from the beginning of the step [s].
    """

    rate_deg_s: float
    frequency_hz: float
    duration_s: float
    start_s: float = 0.0

    def __post_init__(self) -> None:
        _need(self.rate_deg_s, 1e-9, FASTEST_DEG_S, "oscillate: rate [deg/s]")
        _need(self.frequency_hz, 1e-6, 1e6, "oscillate: frequency [Hz]")
        _need(self.duration_s, _SHORTEST_S, _LONGEST_S, "oscillate: time [s]")
        _need(self.start_s, 0.0, _LONGEST_S, "oscillate: start [s]")
        cycles = self.frequency_hz * self.duration_s
        if abs(cycles - round(cycles)) > _CYCLE_SLACK or round(cycles) < 1:
            raise InputError(
                f"oscillate: {number_text(self.frequency_hz)} Hz for {duration_text(self.duration_s)} are "
                f"{cycles:g} cycles; a whole number is needed, so that the table ends at rest where it began"
            )

    def __str__(self) -> str:
        return (
            f"oscillate at {number_text(self.rate_deg_s)} deg/s and {number_text(self.frequency_hz)} Hz "
            f"for {duration_text(self.duration_s)}" + _from_text(self.start_s)
        )


@dataclass(frozen=True)
class Setting:
    """Switch or set something, for a time [s] or until it is set again.

    Attributes
    ----------
    what
        ``power``, ``fan``, ``compressor`` or ``heater`` (0 to 1), ``humidity`` (%), ``radiation`` (Gy/h),
        ``yaw`` (deg).
    value
        The value; None leaves it to the chamber.
    start_s, duration_s
        When, from the beginning of the step [s], and for how long, if not for good.
    """

    what: Switched
    value: float | None
    start_s: float = 0.0
    duration_s: float | None = None

    def __post_init__(self) -> None:
        if self.value is None and self.what not in AUTOMATIC:
            raise InputError(f"{self.what}: it can't be left to the chamber")
        if self.what == "power" and self.value not in (0.0, 1.0):
            raise InputError("power: it is on (1) or off (0)")
        highest = {"yaw": 1e6, "humidity": 100.0, "radiation": 1e6}.get(self.what, 1.0)
        lowest = -highest if self.what == "yaw" else 0.0
        _need(self.value or 0.0, lowest, highest, self.what)
        _need(self.start_s, 0.0, _LONGEST_S, f"{self.what}: start [s]")
        _need(
            _SHORTEST_S if self.duration_s is None else self.duration_s,
            _SHORTEST_S,
            _LONGEST_S,
            f"{self.what}: time [s]",
        )

    def __str__(self) -> str:
        lasting = "" if self.duration_s is None else f" for {duration_text(self.duration_s)}"
        return f"{self.what} {self._value_text()}{lasting}{_from_text(self.start_s)}"

    def _value_text(self) -> str:
        if self.value is None:
            return "automatic"
        if self.what == "yaw":
            return f"to {number_text(self.value)} deg"
        if self.what == "humidity":
            return f"{number_text(self.value)} %"
        if self.what == "radiation":
            return f"at {number_text(self.value)} Gy/h"
        if self.value in (0.0, 1.0):
            return "on" if self.value else "off"
        return f"at {number_text(100.0 * self.value)} %"


Action = Turn | TurnTo | Oscillate | Setting


@dataclass(frozen=True)
class Soak:
    """Go to a temperature [degC] as fast as the chamber can, then stay there for a time [s].

    The time, and the times of its actions, count from the arrival of the set point.
    """

    temperature: float
    duration_s: float
    actions: Sequence[Action] = ()

    def __post_init__(self) -> None:
        _need(self.temperature, _COLDEST, _HOTTEST, "soak: temperature [degC]")
        _need(self.duration_s, _SHORTEST_S, _LONGEST_S, "soak: time [s]")

    def __str__(self) -> str:
        return f"soak at {number_text(self.temperature)} degC for {duration_text(self.duration_s)}"


@dataclass(frozen=True)
class Hold:
    """Stay at the temperature of the step before for a time [s]."""

    duration_s: float
    actions: Sequence[Action] = ()

    def __post_init__(self) -> None:
        _need(self.duration_s, _SHORTEST_S, _LONGEST_S, "hold: time [s]")

    def __str__(self) -> str:
        return f"hold for {duration_text(self.duration_s)}"


@dataclass(frozen=True)
class Ramp:
    """Go to a temperature [degC] at a rate [degC/min], which is stated without a sign."""

    temperature: float
    rate: float
    actions: Sequence[Action] = ()

    def __post_init__(self) -> None:
        _need(self.temperature, _COLDEST, _HOTTEST, "ramp: temperature [degC]")
        _need(self.rate, 1e-6, 1e3, "ramp: rate [degC/min], without a sign")

    def __str__(self) -> str:
        return f"ramp to {number_text(self.temperature)} degC at {number_text(self.rate)} degC/min"


@dataclass(frozen=True)
class Repeat:
    """The same steps several times."""

    count: int
    steps: Sequence[Step]

    def __post_init__(self) -> None:
        _need(self.count, 1, 1_000_000, "repeat: times")

    def __str__(self) -> str:
        return f"repeat {self.count} times"


Step = Soak | Hold | Ramp | Repeat
