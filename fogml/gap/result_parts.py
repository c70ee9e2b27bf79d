"""Parts of the result of a diagnosis: where, how far, what may be compensated, series for drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.numerals import number
from fogml.pictures import AFTER, BEFORE, Panel, in_time


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


@dataclass(frozen=True)
class ConstantFit:
    """A constant of the model: prior and fitted value."""

    name: str
    unit: str
    prior_mean: float
    prior_sd: float
    value: float
    se: float


WORSE = 1.05
"""Rms after over rms before from which a replay is called worse, of constants and causes alike."""


@dataclass(frozen=True)
class HowFar:
    """How far the gap closes on a held-out run; rms of averages over `averaging_s` [deg/h]."""

    run: str
    averaging_s: float
    before: float
    recalibrated: float
    after: float
    floor: float
    closed: float | None
    closed_ci90: tuple[float, float] | None
    note: str = ""
    unit: str = "deg/h"

    @property
    def made_worse(self) -> bool:
        """Whether constants as fitted leave more than those given, by over `WORSE`."""
        return self.recalibrated > WORSE * self.before


def beyond_noise(far: Sequence[HowFar]) -> str:
    """Words of the held-out run where constants alone leave most over noise; empty where none stands out."""
    out = [item for item in far if item.closed is not None]
    if not out:
        return ""
    most = max(out, key=lambda item: (item.made_worse, item.recalibrated / (item.floor or item.recalibrated)))
    told = f"on {most.run} the recalibrated twin leaves {number(most.recalibrated)} deg/h"
    if most.made_worse:
        told += f", more than the {number(most.before)} of the twin as given,"
    return f"{told} where noise makes {number(most.floor)}"


@dataclass(frozen=True)
class WhatIf:
    """What a held-out run keeps with one more candidate beside those named [deg/h rms of averages].

    ``share`` is of the fit runs' structural gap.
    """

    effect: str
    beside: tuple[str, ...]
    run: str
    after: float
    closed: float | None
    closed_ci90: tuple[float, float] | None
    share: float


@dataclass(frozen=True)
class CauseShare:
    """A cause's share of what all of them take away of the gap's energy: in all, on a run, or in a regime.

    ``effect`` is ``unknown`` for whatever is not known. Shares of one run or regime add to 1; where causes
    cancel, one may be negative.
    """

    effect: str
    run: str | None
    regime: str | None
    share: float
    ci90: tuple[float, float]


@dataclass(frozen=True)
class Nearest:
    """A known family, how much of the gap's energy it holds alone, and how probable it is."""

    family: str
    effect: str
    share: float
    probability: float


@dataclass(frozen=True)
class Rehearsed:
    """What a diagnosis of these runs would say if one candidate acted alone.

    Attributes
    ----------
    effect, form, size
        What acts: its id; its shape, in the middle of the ranges or at their ends; its usual size or the
        found one.
    length
        Whitened length beside the constants: how much the runs show of it.
    outcome
        ``named``, ``missed``, or ``mistaken`` for another.
    named_as
        The class that is named.
    probability
        Of that class, or of the likeliest one where none is named.
    """

    effect: str
    form: str
    size: str
    length: float
    outcome: str
    named_as: tuple[str, ...]
    probability: float


@dataclass(frozen=True)
class Compensable:
    """A candidate as features of a drift model.

    Attributes
    ----------
    effect
        Its id.
    counted
        Whether a model made of the diagnosis takes it: it is named, or the twin has it already.
    features
        Text of each feature; none where a unit can't compensate it by itself.
    reason
        Why not.
    """

    effect: str
    counted: bool
    features: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True)
class Brought:
    """What a drift model brings on a held-out run: rms of averages over `averaging_s` [deg/h].

    Attributes
    ----------
    before
        Of the output less the training runs' mean, or less Earth rate where that is known.
    constants
        Compensated with the twin's constants alone.
    after
        With the causes that count as well; where none does, as `constants`.
    floor
        Of the noise.
    """

    run: str
    averaging_s: float
    before: float
    constants: float
    after: float
    floor: float
    unit: str = "deg/h"


@dataclass(frozen=True)
class Compensation:
    """The twin's constants and every candidate as features, and what those that count bring.

    ``held_out`` is empty until a drift model was fitted; ``note`` says why none could be.
    """

    constants: tuple[str, ...]
    causes: tuple[Compensable, ...]
    held_out: tuple[Brought, ...] = ()
    note: str = ""

    @property
    def counted(self) -> tuple[Compensable, ...]:
        """Causes that a model takes: they count, and have features."""
        return tuple(c for c in self.causes if c.counted and c.features)


@dataclass(frozen=True, eq=False)
class Course:
    """What one effect makes of a run at a size.

    Attributes
    ----------
    effect
        Its id.
    size, unit
        The amplitude that ``values`` are of, in the card's unit.
    acts
        Whether it is part of what is replayed: named, or on in the twin.
    signed
        Whether it may be of either sign.
    values
        [deg/h], shape (k,).
    """

    effect: str
    size: float
    unit: str
    acts: bool
    signed: bool
    values: FloatArray


@dataclass(frozen=True, eq=False)
class RunSeries:
    """What a page draws of a run: averages over `averaging_s`, all of shape (k,) [deg/h] unless said.

    ``recorded`` is less the reference; ``gap_recalibrated`` and ``gap_after`` are recorded less replayed;
    ``rate_degc_min`` tells up and down apart. ``gyro`` and ``axis`` name the unit, ``note`` is what the run's
    facts say of it. ``courses``, where they were asked for, are linear in their size; what is not, as a
    deadband, is none of them, and part of what is replayed where it acts.
    """

    run: str
    role: Literal["fit", "held_out"]
    averaging_s: float
    time_s: FloatArray
    temperature_degc: FloatArray
    rate_degc_min: FloatArray
    regime: NDArray[np.int8]
    recorded: FloatArray
    replayed_before: FloatArray
    replayed_recalibrated: FloatArray
    replayed_after: FloatArray
    gap_recalibrated: FloatArray
    gap_after: FloatArray
    floor: float
    gyro: str | None = None
    axis: str | None = None
    note: str = ""
    courses: tuple[Course, ...] = ()

    @property
    def replayed_bare(self) -> FloatArray:
        """Replayed without its courses: with the sum of factor * course it is exact at any factors."""
        return np.asarray(self.replayed_after - sum(c.values for c in self.courses if c.acts))

    def panel(self) -> Panel:
        """The gap over time, before and after what was found."""
        before = in_time(self.time_s, self.gap_recalibrated, "gap, recalibrated", BEFORE)
        after = in_time(self.time_s, self.gap_after, "with what was found", AFTER)
        return Panel([before, after], "time [h]", f"{self.run} [deg/h]")
