"""Readings of a thermometer that are none: sentinels, values out of range, jumps that no heat makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_STARTING = 9
_LEAST_GOOD = 0.5


@dataclass(frozen=True)
class DropoutRule:
    """What a thermometer at a gyro can show, stated sample by sample.

    A reading is none if it is below `low_degC` or above `high_degC`; if it is further from the last
    good one than `jump_degC` and `rate_degC_s` times the time since; or if it is the very value that
    was rejected just before, as a sentinel stays the same however long it lasts. In its place the last
    good reading is held.

    Attributes
    ----------
    low_degC, high_degC
        Range of thermometers in laboratories [degC]; a DS18B20 that is cut off shows -127, others
        -9999 or 999.
    jump_degC
        Largest step between neighbouring readings [degC]: beyond steps and noise of any sensor in use.
    rate_degC_s
        Fastest change [degC/s]: 30 degC/min, twice what a fast chamber makes of its air.
    noise_sigma
        A thermometer noisier than `jump_degC` allows may step this many of its own robust standard
        deviations.
    """

    low_degC: float = -100.0
    high_degC: float = 200.0
    jump_degC: float = 5.0
    rate_degC_s: float = 0.5
    noise_sigma: float = 8.0


RULE = DropoutRule()


@dataclass(frozen=True)
class Reading:
    """What a thermometer showed.

    Attributes
    ----------
    values
        Readings [degC], those that are none replaced by the last good one; shape (n,).
    bad
        Which are none, shape (n,); None where all are good.
    """

    values: FloatArray
    bad: BoolArray | None = None


@dataclass(frozen=True)
class LastReading:
    """What a thermometer showed: the last good reading [degC], its time [s], what was rejected since."""

    good: float
    time: float
    rejected: float | None


def read_thermometer(
    time: FloatArray, values: FloatArray, rule: DropoutRule = RULE, before: LastReading | None = None
) -> Reading:
    """Replace the readings of a thermometer that are none.

    Before the first good reading that one is held. A column of which most would be none is no
    thermometer in degC with dropouts, and is left as it is.

    Parameters
    ----------
    time
        Times [s], shape (n,).
    values
        Readings [degC], shape (n,).
    rule
        What is none.
    before
        What it showed before the first of them, if that is known.
    """
    if before is not None:
        time, values = np.append(before.time, time), np.append(before.good, values)
        found = _read(time, values, rule, before)
        return Reading(found.values[1:], None if found.bad is None else found.bad[1:])
    return _read(time, values, rule, None)


def last_reading(time: FloatArray, values: FloatArray, found: Reading) -> LastReading:
    """The state after readings, to go on from."""
    good = np.flatnonzero(~found.bad) if found.bad is not None else np.array([len(values) - 1])
    at = int(good[-1]) if len(good) else 0
    return LastReading(
        float(found.values[-1]), float(time[at]), float(values[-1]) if at < len(values) - 1 else None
    )


def _read(time: FloatArray, values: FloatArray, rule: DropoutRule, before: LastReading | None) -> Reading:
    if len(values) < 2:
        return Reading(values)
    steps = np.abs(np.diff(values))
    ranged = (values >= rule.low_degC) & (values <= rule.high_degC)
    apart = np.diff(time)
    limit = rule.jump_degC + rule.rate_degC_s * apart
    if ranged.all() and (before is None or before.rejected is None) and not np.any(steps > limit):
        return Reading(values)
    if before is None and np.count_nonzero(ranged) < _LEAST_GOOD * len(values):
        return Reading(values)
    within = np.abs(np.diff(values[ranged]))
    noise = float(np.median(within[within > 0.0])) / 0.6745 if (within > 0.0).any() else 0.0
    jump = max(rule.jump_degC, rule.noise_sigma * noise)
    suspects = np.flatnonzero(~ranged[1:] | (steps > jump + rule.rate_degC_s * apart)) + 1
    bad = np.zeros(len(values), dtype=bool)
    cleaned = values.copy()
    first = _first_good(values, ranged, jump) if before is None else 0
    bad[:first] = True
    cleaned[:first] = values[first]
    at, rejected = first, None
    if before is not None and before.rejected is not None:
        # The spell may go on.
        suspects, rejected = np.append(1, suspects), before.rejected
    for suspect in suspects.tolist():
        if suspect <= at:
            continue
        at = _hold(time, values, ranged, cleaned, bad, suspect, jump, rule.rate_degC_s, rejected)
        rejected = None
    if not bad.any() or (before is None and np.count_nonzero(bad) > (1.0 - _LEAST_GOOD) * len(values)):
        return Reading(values)
    return Reading(cleaned, bad)


def _first_good(values: FloatArray, ranged: BoolArray, jump: float) -> int:
    """The first reading in range that is near to what most of the first ones are."""
    places = np.flatnonzero(ranged)[:_STARTING]
    usual = float(np.median(values[places]))
    near = places[np.abs(values[places] - usual) <= jump]
    return int(near[0]) if len(near) else int(places[0])


def _hold(
    time: FloatArray,
    values: FloatArray,
    ranged: BoolArray,
    cleaned: FloatArray,
    bad: BoolArray,
    start: int,
    jump: float,
    rate: float,
    rejected: float | None,
) -> int:
    """Hold the reading before `start` until one is good again; the place of that one."""
    good, since = float(cleaned[start - 1]), float(time[start - 1])
    for i in range(start, len(values)):
        value = float(values[i])
        if ranged[i] and value != rejected and abs(value - good) <= jump + rate * (time[i] - since):
            return i
        bad[i], cleaned[i], rejected = True, good, value
    return len(values)
