"""Where a gap lies: shares, excesses over the floor and segments."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Share:
    """A part of the structural gap's energy above the floor, with a 90 % interval."""

    name: str
    share: float
    share_ci90: tuple[float, float] | None = None
    excess_rms: float | None = None
    excess_rms_ci90: tuple[float, float] | None = None
    significant: bool = False
    unit: str = "deg/h"


@dataclass(frozen=True)
class TemperatureExcess:
    """The structural gap over the floor in a span of temperature [degC], with up and down apart."""

    from_degc: float
    to_degc: float
    excess_rms: float
    significant: bool
    mean_up: float | None
    mean_down: float | None


@dataclass(frozen=True)
class TimescaleExcess:
    """Ratio of the structural gap to the floor at an averaging time [s], with a 90 % interval."""

    tau_s: float
    excess: float
    ci90: tuple[float, float]
    significant: bool


@dataclass(frozen=True)
class GapSegment:
    """A stretch in which the structural gap exceeds the floor."""

    run: str
    from_s: float
    to_s: float
    excess_rms: float
    unit: str = "deg/h"


@dataclass(frozen=True)
class Where:
    """Where the structural gap lies."""

    stage: tuple[Share, ...] = ()
    regime: tuple[Share, ...] = ()
    temperature: tuple[TemperatureExcess, ...] = ()
    timescale: tuple[TimescaleExcess, ...] = ()
    segments: tuple[GapSegment, ...] = ()
