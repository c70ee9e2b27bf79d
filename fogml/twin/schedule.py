"""From steps to what happens when: tracks of set point, table rate and switches over time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.numerals import number_text
from fogml.twin.steps import (
    SWITCHED,
    Action,
    Hold,
    Oscillate,
    Ramp,
    Repeat,
    Setting,
    Soak,
    Step,
    Switched,
    Turn,
    TurnTo,
    duration_text,
)
from fogml.twin.table import Table, Wave

_REST: dict[Switched, float] = {"power": 1.0, "fan": 1.0, "yaw": 0.0, "radiation": 0.0}
_SLACK_S = 1e-6
MOST_STEPS = 1_000_000
"""Steps of a programme, repeats written out: one a minute for two years, and some seconds to work out."""


@dataclass(frozen=True)
class Track:
    """Values at times [s], in time order; how to go from one to the next is the reader's matter."""

    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def add(self, time: float, value: float) -> None:
        """Append a value; a later one at the same time replaces it."""
        if self.times and self.times[-1] >= time:
            self.times.pop()
            self.values.pop()
        self.times.append(time)
        self.values.append(value)

    @cached_property
    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Times and values of a track that is whole, shape (n,) each."""
        return np.asarray(self.times), np.asarray(self.values)


@dataclass(frozen=True)
class Schedule:
    """A programme worked out.

    Attributes
    ----------
    set_point
        Set point of the chamber [degC], linear in between.
    table_rate
        Table rate [deg/s], linear in between, and 0 after the last.
    table_angle
        Table angle [deg] at the same times.
    waves
        Oscillations of the table about rest, on top, in time order.
    settings
        Switches and settings, each held until the next; NaN is left to the chamber. The first
        value holds from the beginning, or from long before.
    step_starts, step_names
        When each step begins [s], repeats written out, and its sentence.
    total_s
        How long it all lasts [s].
    """

    set_point: Track
    table_rate: Track
    table_angle: Track
    waves: tuple[Wave, ...]
    settings: dict[Switched, Track]
    step_starts: tuple[float, ...]
    step_names: tuple[str, ...]
    total_s: float


def schedule(
    steps: Sequence[Step],
    *,
    start_temperature: float,
    fastest_rate: float,
    table_acceleration: float,
    powered: bool | None,
    name: str = "programme",
) -> Schedule:
    """Work out steps.

    Parameters
    ----------
    steps
        The steps.
    start_temperature
        Where the chamber begins [degC].
    fastest_rate
        Of the chamber [degC/min].
    table_acceleration
        Of the table [deg/s^2].
    powered
        Whether the unit is on at the beginning, since long before; None for on, unless the first
        that is said of the power is that it goes on.
    name
        For messages.
    """
    if (count := _count(steps)) > MOST_STEPS:
        raise InputError(
            f"{name}: with repeats written out it has {count} steps, and {MOST_STEPS} are the most; repeat "
            "fewer times"
        )
    set_point, table = Track(), Table(table_acceleration)
    moments: dict[Switched, list[tuple[float, Setting, str]]] = {what: [] for what in SWITCHED}
    now, temperature = 0.0, start_temperature
    set_point.add(now, temperature)
    starts, names = [], []
    for label, step in _flat(steps):
        owner = f"{name}, {label}, '{step}'"
        starts.append(now)
        names.append(str(step))
        begin = now
        if isinstance(step, Soak):
            now += 60.0 * abs(step.temperature - temperature) / fastest_rate
            temperature, begin = step.temperature, now
            set_point.add(now, temperature)
        if isinstance(step, Ramp):
            if step.rate > fastest_rate:
                raise InputError(
                    f"{owner}: the chamber's fastest rate is {number_text(fastest_rate)} degC/min; "
                    "lower the rate, or state a higher 'fastest_rate'"
                )
            if step.temperature == temperature:
                raise InputError(f"{owner}: the chamber is at {number_text(temperature)} degC already")
            now += 60.0 * abs(step.temperature - temperature) / step.rate
            temperature = step.temperature
        else:
            now += step.duration_s
        set_point.add(now, temperature)
        _act(step.actions, begin, now, owner, table, moments)
    if not now > 0.0:
        raise InputError(f"{name}: there is no step")
    settings = {what: _track(what, moments[what], powered) for what in SWITCHED}
    times, rates, angles = table.knots()
    turning = Track(times, rates), Track(times, angles)
    return Schedule(set_point, *turning, tuple(table.waves), settings, tuple(starts), tuple(names), now)


def _count(steps: Sequence[Step]) -> int:
    """Number of steps, repeats written out."""
    return sum(step.count * _count(step.steps) if isinstance(step, Repeat) else 1 for step in steps)


def _flat(steps: Sequence[Step], above: str = "step ") -> Iterator[tuple[str, Soak | Hold | Ramp]]:
    """Steps with repeats written out, each with a label such as ``step 3.2``."""
    for number, step in enumerate(steps, start=1):
        if isinstance(step, Repeat):
            for _ in range(step.count):
                yield from _flat(step.steps, f"{above}{number}.")
        else:
            yield f"{above}{number}", step


def _act(
    actions: Sequence[Action],
    begin: float,
    end: float,
    owner: str,
    table: Table,
    moments: dict[Switched, list[tuple[float, Setting, str]]],
) -> None:
    turns = sorted((a for a in actions if not isinstance(a, Setting)), key=lambda turn: turn.start_s)
    for turn in turns:
        place = f"{owner}, action '{turn}'"
        _check_within(turn.start_s, end - begin, place)
        if isinstance(turn, TurnTo):
            stop = table.move(begin + turn.start_s, turn.angle_deg, turn.rate_deg_s, turn.relative, place)
        elif isinstance(turn, Oscillate):
            stop = begin + turn.start_s + turn.duration_s
            table.oscillate(Wave(begin + turn.start_s, stop, turn.rate_deg_s, turn.frequency_hz), place)
        else:
            stop = _turn(turn, begin, end, table, place)
        _check_within(stop - begin, end - begin, place)
    for action in actions:
        if isinstance(action, Setting):
            place = f"{owner}, action '{action}'"
            _check_within(action.start_s + (action.duration_s or 0.0), end - begin, place)
            moments[action.what].append((begin + action.start_s, action, place))


def _turn(turn: Turn, begin: float, end: float, table: Table, place: str) -> float:
    at = begin + turn.start_s
    for rate, lasting in turn.segments:
        stop = end if lasting is None else at + lasting
        table.turn(at, stop, rate, place)
        at = stop
    table.stop(at)
    return at


def _check_within(moment: float, length: float, place: str) -> None:
    if moment > length + _SLACK_S:
        raise InputError(
            f"{place}: this reaches to {duration_text(round(moment, 3))} after the beginning of the step, "
            f"which lasts {duration_text(round(length, 3))}"
        )


def _track(what: Switched, moments: list[tuple[float, Setting, str]], powered: bool | None) -> Track:
    """The value over time: lasting settings, with timed ones laid over them."""
    moments = sorted(moments, key=lambda moment: moment[0])
    base = _REST.get(what, math.nan)
    if what == "power":
        first_on = bool(moments) and moments[0][1].value == 1.0
        base = float(not first_on if powered is None else powered)
    track = Track()
    track.add(-math.inf, base)
    until = -math.inf
    for at, setting, place in moments:
        value = math.nan if setting.value is None else setting.value
        if at < until - _SLACK_S:
            raise InputError(f"{place}: another setting of '{what}' lasts until after this one begins")
        if until > -math.inf and at > until:
            track.add(until, base)
        track.add(at, value)
        if setting.duration_s is None:
            base, until = value, -math.inf
        else:
            until = at + setting.duration_s
    if until > -math.inf:
        track.add(until, base)
    return track
