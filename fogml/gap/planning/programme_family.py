"""A family of chamber and table programmes to search: what a lab may do with a unit within so many hours.

A member of the family is a `Design`: a few choices that a lab would name, such as rates of ramps, limits,
soaks, a minor loop, turns of the table, power steps. `Family.programme` writes it out as the steps that
`fogml simulate` runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from fogml.errors import InputError
from fogml.gap.planning.lab import Lab
from fogml.numerals import short
from fogml.twin.programme import Programme
from fogml.twin.steps import Action, Ramp, Setting, Soak, Step, Turn, duration_text
from fogml.twin.timeline import ROOM_DEGC

Mounting = Literal["up", "down", "north", "south", "east", "west"]


@dataclass(frozen=True)
class Design:
    """Choices that make a programme.

    Attributes
    ----------
    rates
        Rate of each cycle between the limits [degC/min]; none for a run at room temperature. None stands
        for a cycle that is left out.
    cold_share, hot_share
        How far the cycles go from room temperature to each limit, 0 to 1.
    first
        The limit that is visited first.
    soak_s
        Time at rest in each soak, before anything is done in it [s].
    stops
        Soaks on the way from one limit to the other.
    minor_loop
        Whether a loop within the large one follows.
    ladder
        Table rates in each soak, a key of the lab's `ladders`.
    power_steps
        Where the power goes off for a while: nowhere, in the first soak, or in each.
    cold_start
        Whether the unit is switched on with the run rather than long before.
    fan_off, compressor_off, yaw
        Whether in each soak the fan or the compressor is off for a while, and the fixture yawed.
    mounting
        Where the input axis points.
    """

    rates: tuple[float | None, float | None, float | None] = (1.0, None, None)
    cold_share: float = 1.0
    hot_share: float = 1.0
    first: Literal["cold", "hot"] = "cold"
    soak_s: float = 3600.0
    stops: int = 0
    minor_loop: bool = False
    ladder: str = "none"
    power_steps: Literal["none", "first", "each"] = "none"
    cold_start: bool = False
    fan_off: bool = False
    compressor_off: bool = False
    yaw: bool = False
    mounting: Mounting | None = "up"

    @property
    def cycles(self) -> tuple[float, ...]:
        """Rates of the cycles that are run [degC/min]."""
        return tuple(rate for rate in self.rates if rate is not None)

    def plain(self) -> Design:
        """The same programme with choices that make no difference at their defaults."""
        cycles = self.cycles
        plain = replace(self, rates=(*cycles, *([None] * (3 - len(cycles)))))  # type: ignore[arg-type]
        if cycles:
            return plain
        plain = replace(plain, first="cold", stops=0)
        return plain if self.minor_loop else replace(plain, cold_share=1.0, hot_share=1.0)

    @property
    def items(self) -> int:
        """How many things are done beside ramps and soaks."""
        chosen = (self.ladder != "none", self.power_steps != "none", self.stops > 0)
        return sum((*chosen, self.minor_loop, self.cold_start, self.fan_off, self.compressor_off, self.yaw))


def leg(start: float, end: float, rate: float, design: Design, lab: Lab) -> list[Step]:
    """Ramps from one temperature to another with soaks on the way and at the end."""
    steps: list[Step] = []
    at = start
    for number in range(1, design.stops + 2):
        goal = float(round(start + (end - start) * number / (design.stops + 1)))
        if goal != at:
            steps += [Ramp(goal, rate), soak(goal, design, lab)]
            at = goal
    return steps


def soak(temperature: float, design: Design, lab: Lab, opening: bool = False) -> Soak:
    """A soak: rest first, then one thing after another."""
    actions: list[Action] = []
    ladder = lab.ladders[design.ladder]
    turn_s = lab.turn_s * len(ladder)
    at = design.soak_s

    def turn(start_s: float) -> None:
        if ladder:
            actions.append(Turn(tuple((rate, lab.turn_s) for rate in ladder), start_s))

    if opening and design.cold_start:
        actions.append(Setting("power", 1.0))
        at = max(at, lab.warm_up_s + turn_s)
        turn(lab.turn_after_on_s)
    if ladder:
        turn(at)
        at += turn_s
    if design.yaw:
        angles = (180.0,) if design.mounting in ("up", "down", None) else (90.0, 180.0, 270.0)
        for angle in (*angles, 0.0):
            actions.append(Setting("yaw", angle, at))
            at += lab.yaw_s
    if design.power_steps == "each" or (opening and design.power_steps == "first"):
        actions.append(Setting("power", 0.0, at, lab.power_off_s))
        at += lab.power_off_s
        turn(at + lab.turn_after_on_s)
        at += lab.warm_up_s + turn_s
    if design.fan_off:
        actions.append(Setting("fan", 0.0, at, lab.fan_off_s))
        at += lab.fan_off_s + lab.fan_on_s
    if design.compressor_off:
        actions.append(Setting("compressor", 0.0, at, lab.compressor_off_s))
        at += lab.compressor_off_s + lab.compressor_on_s
    return Soak(temperature, at, tuple(actions))


@dataclass(frozen=True)
class Family:
    """The designs that a lab can run.

    Attributes
    ----------
    hours
        Longest time of a programme [h].
    limits
        Lowest and highest temperature [degC].
    mountings
        Where the input axis may point.
    power_steps
        Whether the power may be switched.
    lab
        What it can do beside, and how long that takes.

    Raises
    ------
    InputError
        If limits lie the wrong way round or beside room temperature, or the hours are too few.
    """

    hours: float = 24.0
    limits: tuple[float, float] = (-40.0, 60.0)
    mountings: tuple[Mounting | None, ...] = ("up",)
    power_steps: bool = True
    lab: Lab = field(default_factory=Lab)

    def __post_init__(self) -> None:
        low, high = self.limits
        if not -100.0 <= low < ROOM_DEGC < high <= 150.0:
            raise InputError(
                f"temperature limits {low:g} and {high:g} degC: a lowest from -100 to below {ROOM_DEGC:g} "
                f"and a highest from above {ROOM_DEGC:g} to 150 degC are needed"
            )
        least = self.programme(self.shortest()).total_hours
        if not least <= self.hours <= 1000.0:
            raise InputError(
                f"{self.hours:g} h: the shortest programme between {low:g} and {high:g} degC takes "
                f"{short(least)} h; give that or more, up to 1000 h"
            )

    def shortest(self) -> Design:
        """One cycle at the fastest rate with the shortest soaks."""
        fastest, shortest = self.lab.ramp_rates[-1], min(self.lab.soaks_s)
        return Design(rates=(fastest, None, None), soak_s=shortest, mounting=self.mountings[0])

    def starts(self) -> tuple[Design, ...]:
        """Designs that a search begins from, each within the hours."""
        mounting, ladders = self.mountings[0], self.lab.ladders
        eighth, quarter, half, whole = self.lab.ramp_rates
        everything = Design(
            rates=(quarter, whole, None),
            ladder="rates" if "rates" in ladders else "none",
            minor_loop=True,
            power_steps="first" if self.power_steps else "none",
            fan_off=self.lab.fan_steps,
            mounting=mounting,
        )
        slow = Design(rates=(eighth, None, None), soak_s=7200.0, stops=1, mounting=mounting)
        switched = Design(
            rates=(half, None, None),
            ladder="one rate" if "one rate" in ladders else "none",
            power_steps="each" if self.power_steps else "none",
            cold_start=self.power_steps,
            mounting=mounting,
        )
        within = map(self.shortened, (self.shortest(), everything, slow, switched))
        return tuple(dict.fromkeys(design for design in within if design is not None))

    def neighbours(self, design: Design, rng: np.random.Generator | None = None) -> Iterator[Design]:
        """Designs that differ in one choice; shortened elsewhere where that takes too long.

        In random order where `rng` is given. Each is worked out when its turn comes.
        """
        lab = self.lab
        changes: list[dict[str, Any]] = [
            {"rates": (*design.rates[:place], rate, *design.rates[place + 1 :])}
            for place in range(3)
            for rate in (None, *lab.ramp_rates)
        ]
        choices: dict[str, Iterable[Any]] = {
            "cold_share": (0.25, 0.5, 1.0),
            "hot_share": (0.25, 0.5, 1.0),
            "first": ("cold", "hot"),
            "soak_s": lab.soaks_s,
            "stops": (0, 1, 3),
            "ladder": lab.ladders,
        }
        may = {"minor_loop": True, "fan_off": lab.fan_steps, "compressor_off": lab.compressor_steps}
        may |= {"yaw": lab.yaw, "cold_start": self.power_steps}
        if self.power_steps:
            choices["power_steps"] = ("none", "first", "each")
        choices |= {name: (False, True) for name, allowed in may.items() if allowed}
        choices["mounting"] = self.mountings
        changes += [{name: value} for name, values in choices.items() for value in values]
        told: set[Design | None] = {None, design}
        for place in range(len(changes)) if rng is None else rng.permutation(len(changes)):
            near = self.shortened(replace(design, **changes[place]))
            if near not in told:
                told.add(near)
                yield near  # type: ignore[misc]

    def shortened(self, design: Design) -> Design | None:
        """The design with shorter soaks, then without its later cycles, until it fits; None if it can't."""
        # Designs that come to the same are written out once, as plain ones.
        while self.programme(design := design.plain()).total_hours > self.hours:
            shorter = [soak for soak in self.lab.soaks_s if soak < design.soak_s]
            if shorter:
                design = replace(design, soak_s=max(shorter))
            elif design.stops:
                design = replace(design, stops=0)
            elif len(design.cycles) > 1:
                design = replace(design, rates=design.cycles[:-1])  # type: ignore[arg-type]
            else:
                return None
        return design

    def temperatures(self, design: Design) -> tuple[float, float]:
        """Lowest and highest temperature of the cycles [degC], in whole degrees within the limits."""
        low, high = self.limits
        return (
            float(max(round(ROOM_DEGC + design.cold_share * (low - ROOM_DEGC)), math.ceil(low))),
            float(min(round(ROOM_DEGC + design.hot_share * (high - ROOM_DEGC)), math.floor(high))),
        )

    def programme(self, design: Design, name: str = "planned") -> Programme:
        """The design as a programme."""
        written = _written(self, design)
        return written if name == written.name else replace(written, name=name)

    def in_words(self, design: Design) -> str:
        """What the design does, in a line."""
        cold, hot = self.temperatures(design)
        words = []
        if design.cycles:
            rates = ", ".join(f"{rate:g}" for rate in design.cycles)
            words.append(f"{cold:g} to {hot:g} degC at {rates} degC/min, {design.first} first")
        else:
            words.append("at room temperature" + (" but for a minor loop" if design.minor_loop else ""))
        words.append(f"soaks of {duration_text(design.soak_s)}")
        which = "the first" if design.power_steps == "first" else "each"
        speeds = sorted({abs(rate) for rate in self.lab.ladders[design.ladder]})
        turns = " to ".join(f"{rate:g}" for rate in dict.fromkeys((*speeds[:1], *speeds[-1:])))
        told = (
            (design.stops and design.cycles, f"{design.stops} more on each leg"),
            (design.minor_loop and design.cycles, "a minor loop"),
            (design.ladder != "none", f"turns at {turns} deg/s in each soak"),
            (design.power_steps != "none", f"power off and on in {which} soak"),
            (design.cold_start, "switched on at the beginning"),
            (design.fan_off, "fan off in each soak"),
            (design.compressor_off, "compressor off in each soak"),
            (design.yaw, "fixture yawed in each soak"),
            (design.mounting is not None, f"input axis {design.mounting}"),
        )
        return "; ".join([*words, *(text for on, text in told if on)])


@lru_cache(maxsize=1024)
def _written(family: Family, design: Design) -> Programme:
    """The steps of a design; a search asks for the same ones several times."""
    cold, hot = family.temperatures(design)
    lab = family.lab
    ends = (cold, hot) if design.first == "cold" else (hot, cold)
    steps: list[Step] = [soak(ROOM_DEGC, design, lab, opening=True)]
    at, rate = ROOM_DEGC, lab.ramp_rates[-2]
    for rate in design.cycles:
        for end in ends:
            steps += leg(at, end, rate, design, lab)
            at = end
    if design.minor_loop:
        middle, reach = round(0.5 * (cold + hot)), round(lab.minor_share * (hot - cold))
        for turning in (middle, middle - reach, middle + reach):
            steps += leg(at, float(turning), lab.ramp_rates[-2], replace(design, stops=0), lab)
            at = float(turning)
    if at != ROOM_DEGC:
        steps += [Ramp(ROOM_DEGC, rate), soak(ROOM_DEGC, design, lab)]
    return Programme(
        steps,
        name="planned",
        description=family.in_words(design),
        fastest_rate=lab.fastest_ramp,
        powered=not design.cold_start,
    )
