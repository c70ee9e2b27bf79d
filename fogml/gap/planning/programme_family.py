"""A family of chamber and table programmes to search: what a lab may do with a unit within so many hours.

A member of the family is a `Design`: a few choices that a lab would name, such as rates of ramps, limits,
soaks, a minor loop, turns of the table, power steps. `Family.programme` writes it out as the steps that
`fogml simulate` runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.gap.planning.programme_design import (
    LADDERS,
    MINOR_SHARE,
    RAMP_RATES,
    ROOM_DEGC,
    SOAKS_S,
    Design,
    Mounting,
    leg,
    soak,
)
from fogml.numerals import short
from fogml.twin.programme import Programme
from fogml.twin.steps import Ramp, Step, duration_text


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

    Raises
    ------
    InputError
        If limits lie the wrong way round or beside room temperature, or the hours are too few.
    """

    hours: float = 24.0
    limits: tuple[float, float] = (-40.0, 60.0)
    mountings: tuple[Mounting | None, ...] = ("up",)
    power_steps: bool = True

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
        return Design(rates=(RAMP_RATES[-1], None, None), soak_s=SOAKS_S[0], mounting=self.mountings[0])

    def starts(self) -> tuple[Design, ...]:
        """Designs that a search begins from, each within the hours."""
        mounting = self.mountings[0]
        everything = Design(
            rates=(0.5, 2.0, None),
            ladder="rates",
            minor_loop=True,
            power_steps="first" if self.power_steps else "none",
            fan_off=True,
            mounting=mounting,
        )
        slow = Design(rates=(0.25, None, None), soak_s=7200.0, stops=1, mounting=mounting)
        switched = Design(
            rates=(1.0, None, None),
            ladder="one rate",
            power_steps="each" if self.power_steps else "none",
            cold_start=self.power_steps,
            mounting=mounting,
        )
        found = dict.fromkeys(
            d for d in map(self.shortened, (self.shortest(), everything, slow, switched)) if d is not None
        )
        return tuple(found)

    def neighbours(self, design: Design, rng: np.random.Generator | None = None) -> Iterator[Design]:
        """Designs that differ in one choice; shortened elsewhere where that takes too long.

        In random order where `rng` is given. Each is worked out when its turn comes.
        """
        changes: list[dict[str, Any]] = []
        for place in range(3):
            for rate in (None, *RAMP_RATES):
                rates = list(design.rates)
                rates[place] = rate
                changes.append({"rates": tuple(rates)})
        changes += [{"cold_share": share} for share in (0.25, 0.5, 1.0)]
        changes += [{"hot_share": share} for share in (0.25, 0.5, 1.0)]
        changes += [{"first": first} for first in ("cold", "hot")]
        changes += [{"soak_s": soak} for soak in SOAKS_S]
        changes += [{"stops": stops} for stops in (0, 1, 3)]
        changes += [{"ladder": ladder} for ladder in LADDERS]
        switches = ["minor_loop", "fan_off", "compressor_off", "yaw"]
        if self.power_steps:
            changes += [{"power_steps": steps} for steps in ("none", "first", "each")]
            switches.append("cold_start")
        changes += [{name: value} for name in switches for value in (False, True)]
        changes += [{"mounting": mounting} for mounting in self.mountings]
        told: set[Design | None] = {None, design}
        for place in range(len(changes)) if rng is None else rng.permutation(len(changes)):
            near = self.shortened(replace(design, **changes[place]))
            if near not in told:
                told.add(near)
                yield near  # type: ignore[misc]

    def shortened(self, design: Design) -> Design | None:
        """The design with shorter soaks, then without its later cycles, until it fits; None if it can't."""
        # Designs that come to the same are written out once.
        while self.programme(design := design.plain()).total_hours > self.hours:
            shorter = [soak for soak in SOAKS_S if soak < design.soak_s]
            if shorter:
                design = replace(design, soak_s=shorter[-1])
            elif design.stops:
                design = replace(design, stops=0)
            elif len(design.cycles) > 1:
                *kept, _ = design.cycles
                design = replace(design, rates=(*kept, *([None] * (3 - len(kept)))))  # type: ignore[arg-type]
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
        if design.stops and design.cycles:
            words.append(f"{design.stops} more on each leg")
        if design.minor_loop and design.cycles:
            words.append("a minor loop")
        if design.ladder != "none":
            words.append(f"turns at {design.ladder} in each soak")
        if design.power_steps != "none":
            words.append(
                f"power off and on in {'the first' if design.power_steps == 'first' else 'each'} soak"
            )
        if design.cold_start:
            words.append("switched on at the beginning")
        words += [
            text
            for on, text in (
                (design.fan_off, "fan off in each soak"),
                (design.compressor_off, "compressor off in each soak"),
                (design.yaw, "fixture yawed in each soak"),
            )
            if on
        ]
        if design.mounting is not None:
            words.append(f"input axis {design.mounting}")
        return "; ".join(words)


@lru_cache(maxsize=1024)
def _written(family: Family, design: Design) -> Programme:
    """The steps of a design; a search asks for the same ones several times."""
    cold, hot = family.temperatures(design)
    ends = (cold, hot) if design.first == "cold" else (hot, cold)
    steps: list[Step] = [soak(ROOM_DEGC, design, opening=True)]
    at, rate = ROOM_DEGC, RAMP_RATES[-2]
    for rate in design.cycles:
        for end in ends:
            steps += leg(at, end, rate, design)
            at = end
    if design.minor_loop:
        middle, reach = round(0.5 * (cold + hot)), round(MINOR_SHARE * (hot - cold))
        for turning in (middle, middle - reach, middle + reach):
            steps += leg(at, float(turning), RAMP_RATES[-2], replace(design, stops=0))
            at = float(turning)
    if at != ROOM_DEGC:
        steps += [Ramp(ROOM_DEGC, rate), soak(ROOM_DEGC, design)]
    return Programme(
        steps, name="planned", description=family.in_words(design), powered=not design.cold_start
    )
