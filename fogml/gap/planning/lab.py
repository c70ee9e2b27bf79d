"""What a laboratory can do: its chamber, its table, what it may switch, and how long things take."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from fogml.errors import InputError
from fogml.settings_check import check_numbers
from fogml.twin.steps import FASTEST_DEG_S

_LADDERS: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "one rate": (10.0, -10.0),
        "rates": (0.01, -0.01, 1.0, -1.0, 10.0, -10.0, 100.0, -100.0),
        "slow rates": (-0.001, 0.001, -0.002, 0.002, -0.0025, 0.0025, -0.003, 0.003, -0.005, 0.005),
    }
)


@dataclass(frozen=True)
class Lab:
    """What a laboratory can do, and how long each thing takes in a planned programme.

    Attributes
    ----------
    fastest_ramp
        Of the chamber [degC/min]: common chambers hold 2 with a unit and its fixture in them. Ramps are this
        fast, a half, a quarter and an eighth: what the rate of temperature makes shows in its ratio between
        ramps, and slower ones take their hours for little.
    fastest_turn
        Of the table [deg/s], faster rates are cut to it; 0 where there is no table.
    fan_steps, compressor_steps, yaw
        Whether the chamber's fan and compressor may go off for a while, and whether the fixture can be turned
        about the vertical.
    soaks_s
        Times at rest in a soak [s]: from two time constants of a usual case, 15 min, to nine of a plate's,
        40 min, after which 0.01 % of a step is left.
    turn_s
        Time at each table rate [s]: many times what a table takes to settle, and short beside drift.
    power_off_s, fan_off_s, compressor_off_s
        How long each is off [s]: power and fan for longer than the case's time constant, the compressor for
        no longer than a chamber holds a temperature without it.
    warm_up_s, fan_on_s, compressor_on_s
        Time after each is on again [s]: two time constants of a usual warm-up, 20 min; as long as the fan was
        off; until a compressor has caught up.
    turn_after_on_s
        From power-on to turns [s]: while the electronics warm up, and once a loop has closed.
    yaw_s
        Time at each heading of the fixture [s]: white noise of 0.01 deg/sqrt(h) averages to 0.02 deg/h, and
        three headings and the way back take an hour.
    minor_share
        How far the minor loop goes either way, as a share of the span between the limits: of 100 degC as far
        as the catalogue's widest hysteresis is half wide, 20 degC.

    Raises
    ------
    InputError
        If a number is none that can be, naming it.
    """

    fastest_ramp: float = 2.0
    fastest_turn: float = 100.0
    fan_steps: bool = True
    compressor_steps: bool = True
    yaw: bool = True
    soaks_s: tuple[float, ...] = (1800.0, 2700.0, 3600.0, 5400.0, 7200.0, 10800.0, 14400.0, 21600.0)
    turn_s: float = 120.0
    power_off_s: float = 1200.0
    warm_up_s: float = 2400.0
    turn_after_on_s: float = 300.0
    fan_off_s: float = 1200.0
    fan_on_s: float = 1200.0
    compressor_off_s: float = 900.0
    compressor_on_s: float = 300.0
    yaw_s: float = 900.0
    minor_share: float = 0.2

    def __post_init__(self) -> None:
        check_numbers(self, may_be_0=("fastest_turn",), chances=("minor_share",))
        for name, low, high, unit in (
            ("fastest_ramp", 0.01, 100.0, "degC/min"),
            ("fastest_turn", 0.0, FASTEST_DEG_S, "deg/s"),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"'{name}' is {value:g} {unit}; it lies between {low:g} and {high:g} {unit}")

    @property
    def ramp_rates(self) -> tuple[float, float, float, float]:
        """Rates of ramps that are tried, the slowest first [degC/min]."""
        whole = self.fastest_ramp
        return whole / 8.0, whole / 4.0, whole / 2.0, whole

    @property
    def ladders(self) -> dict[str, tuple[float, ...]]:
        """Table rates [deg/s] that may be gone through in a soak, by name; slow ones go through zero."""
        told: dict[str, tuple[float, ...]] = {"none": ()}
        for name, rates in _LADDERS.items():
            cut = dict.fromkeys(math.copysign(min(abs(r), self.fastest_turn), r) for r in rates)
            if self.fastest_turn and tuple(cut) not in told.values():
                told[name] = tuple(cut)
        return told
