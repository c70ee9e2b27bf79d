"""How far a gap closes: with what was found, with each candidate, with the nearest families."""

from __future__ import annotations

from dataclasses import dataclass


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
class Onset:
    """Since when an effect acts: the run, the time on its clock [s], and what that explains more [nats]."""

    run: str
    time_s: float
    gain: float


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
        Of that class.
    """

    effect: str
    form: str
    size: str
    length: float
    outcome: str
    named_as: tuple[str, ...]
    probability: float
