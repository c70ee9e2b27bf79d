"""A programme as a few choices that a lab would name, and the ramps and soaks that they come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from fogml.twin.steps import Action, Ramp, Setting, Soak, Step, Turn

ROOM_DEGC = 25.0
LADDERS: Mapping[str, tuple[float, ...]] = {
    "none": (),
    "one rate": (10.0, -10.0),
    "rates": (0.01, -0.01, 1.0, -1.0, 10.0, -10.0, 100.0, -100.0),
    "slow rates": (-0.001, 0.001, -0.002, 0.002, -0.0025, 0.0025, -0.003, 0.003, -0.005, 0.005),
}
"""Table rates [deg/s] of a ladder; the slow ones go through zero beside the Earth's rate."""
RATE_S = 120.0
"""Time at each table rate [s]."""
POWER_OFF_S, WARM_UP_S, TURN_AFTER_ON_S = 1200.0, 2400.0, 300.0
FAN_OFF_S, FAN_ON_S = 1200.0, 1200.0
COMPRESSOR_OFF_S, COMPRESSOR_ON_S = 900.0, 300.0
YAW_S = 900.0
MINOR_SHARE = 0.2
"""Half-width of the minor loop as a share of the span between the limits."""
RAMP_RATES = (0.25, 0.5, 1.0, 2.0)
SOAKS_S = (1800.0, 2700.0, 3600.0, 5400.0, 7200.0, 10800.0, 14400.0, 21600.0)

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
        Table rates in each soak, a key of `LADDERS`.
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
        turned = self.ladder != "none"
        switched = self.power_steps != "none"
        others = (self.minor_loop, self.cold_start, self.fan_off, self.compressor_off, self.yaw)
        return int(turned) + int(switched) + int(self.stops > 0) + sum(map(int, others))


def leg(start: float, end: float, rate: float, design: Design) -> list[Step]:
    """Ramps from one temperature to another with soaks on the way and at the end."""
    steps: list[Step] = []
    at = start
    for number in range(1, design.stops + 2):
        goal = float(round(start + (end - start) * number / (design.stops + 1)))
        if goal != at:
            steps += [Ramp(goal, rate), soak(goal, design)]
            at = goal
    return steps


def soak(temperature: float, design: Design, opening: bool = False) -> Soak:
    """A soak: rest first, then one thing after another."""
    actions: list[Action] = []
    ladder = LADDERS[design.ladder]
    turn_s = RATE_S * len(ladder)
    at = design.soak_s

    def turn(start_s: float) -> None:
        if ladder:
            actions.append(Turn(tuple((rate, RATE_S) for rate in ladder), start_s))

    if opening and design.cold_start:
        actions.append(Setting("power", 1.0))
        at = max(at, WARM_UP_S + turn_s)
        turn(TURN_AFTER_ON_S)
    if ladder:
        turn(at)
        at += turn_s
    if design.yaw:
        angles = (180.0,) if design.mounting in ("up", "down", None) else (90.0, 180.0, 270.0)
        for angle in (*angles, 0.0):
            actions.append(Setting("yaw", angle, at))
            at += YAW_S
    if design.power_steps == "each" or (opening and design.power_steps == "first"):
        actions.append(Setting("power", 0.0, at, POWER_OFF_S))
        at += POWER_OFF_S
        turn(at + TURN_AFTER_ON_S)
        at += WARM_UP_S + turn_s
    if design.fan_off:
        actions.append(Setting("fan", 0.0, at, FAN_OFF_S))
        at += FAN_OFF_S + FAN_ON_S
    if design.compressor_off:
        actions.append(Setting("compressor", 0.0, at, COMPRESSOR_OFF_S))
        at += COMPRESSOR_OFF_S + COMPRESSOR_ON_S
    return Soak(temperature, at, tuple(actions))
