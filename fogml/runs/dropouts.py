"""Readings of a thermometer that are none (sentinels, out of range, jumps), in a run or sample by sample."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.signals import large

_STARTING = 9
_LEAST_GOOD = 0.5
_STEP_PER_OFF = 3.075
# Of white noise s: sqrt(2) s over the median 0.3755 of the lesser of two normal sizes, times sqrt(1.5) s.


@dataclass(frozen=True)
class DropoutRule:
    """What a thermometer at a gyro can show, stated sample by sample.

    A reading is none if it is below `low_degC` or above `high_degC`; if it is further from the last
    good one than `jump_degC` and `rate_degC_s` times the time since; or if it goes on with a reading that
    was rejected just before: the very value, as a sentinel stays the same however long it lasts, or one that
    is within half of `jump_degC` and `rate_degC_s` of it, for up to `spell_s`. In its place the last good
    reading is held.

    So, in a spell that began with a step that no heat makes, the time that passes lends it no likelihood;
    half of the jump, as a sound reading right after a false one is further than that from it.

    Attributes
    ----------
    low_degC, high_degC
        Range of thermometers in laboratories [degC]; a DS18B20 that is cut off shows -127, others
        -9999 or 999.
    jump_degC
        Largest step between neighbouring readings [degC]: beyond steps and noise of any sensor in use.
    rate_degC_s
        Fastest change [degC/s]: 30 degC/min, twice what a fast chamber makes of its air.
    spell_s
        How long a spell of readings that go on with a false one is false [s]: a thermometer whose readings
        have stepped for longer, as one that was moved, is believed within the fastest change since.
    noise_sigma
        A thermometer noisier than `jump_degC` allows may step this many of its own robust standard
        deviations.
    """

    low_degC: float = -100.0
    high_degC: float = 200.0
    jump_degC: float = 5.0
    rate_degC_s: float = 0.5
    spell_s: float = 300.0
    noise_sigma: float = 8.0

    @property
    def continuing_degC(self) -> float:
        """How near to a false reading the next one goes on with it [degC], and `rate_degC_s` further."""
        return 0.5 * self.jump_degC

    def off_degC(self, missing_s: float) -> float:
        """How far a false reading can be off that passes as heat [degC], `missing_s` after a good one.

        It is within the rule of the last good reading, and true heat has gone as far the other way at most.
        """
        return self.jump_degC + 2.0 * self.rate_degC_s * missing_s


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
    """What a thermometer showed: the last good reading [degC] and its time [s]; what was rejected last since
    then, and when."""

    good: float
    time: float
    rejected: float | None
    rejected_s: float


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
    rejected = float(values[-1]) if at < len(values) - 1 else None
    return LastReading(float(found.values[-1]), float(time[at]), rejected, float(time[-1]))


def _read(time: FloatArray, values: FloatArray, rule: DropoutRule, before: LastReading | None) -> Reading:
    if len(values) < 2:
        return Reading(values)
    none_rejected = before is None or before.rejected is None
    least, most = large.extremes(values)
    in_range = least >= rule.low_degC and most <= rule.high_degC
    if none_rejected and in_range and _greatest_step(values) <= rule.jump_degC:
        return Reading(values)
    ranged = large.each(lambda x: (x >= rule.low_degC) & (x <= rule.high_degC), values, kind=bool)
    if ranged.all() and none_rejected and not len(_jumps(time, values, rule, rule.jump_degC)):
        return Reading(values)
    if before is None and np.count_nonzero(ranged) < _LEAST_GOOD * len(values):
        return Reading(values)
    jump = max(rule.jump_degC, rule.noise_sigma * _noise(large.chosen(values, ranged)))
    suspects = np.union1d(np.flatnonzero(~ranged[1:]) + 1, _jumps(time, values, rule, jump))
    bad = np.zeros(len(values), dtype=bool)
    cleaned = large.each(np.copy, values)
    used = replace(rule, jump_degC=jump)
    first = _first_good(time, values, ranged, used) if before is None else 0
    bad[:first] = True
    cleaned[:first] = values[first]
    at, rejected = first, None
    if before is not None and before.rejected is not None:
        # The spell may go on.
        suspects, rejected = np.append(1, suspects), before
    for suspect in suspects.tolist():
        if suspect <= at:
            continue
        at = _hold(time, values, ranged, cleaned, bad, suspect, used, rejected)
        rejected = None
    if not bad.any() or (before is None and np.count_nonzero(bad) > (1.0 - _LEAST_GOOD) * len(values)):
        return Reading(values)
    return Reading(cleaned, bad)


def _greatest_step(values: FloatArray) -> float:
    """Largest step from one reading to the next [degC]."""
    return max(max(-steps.min(), steps.max()) for _, steps in large.differences(values))


def _jumps(time: FloatArray, values: FloatArray, rule: DropoutRule, jump_degC: float) -> IndexArray:
    """Readings further from the one before than a jump and the fastest change."""
    found = [
        part.start
        + 1
        + np.flatnonzero(np.abs(np.diff(values[part])) > jump_degC + rule.rate_degC_s * np.diff(time[part]))
        for part in large.pieces(values, overlap=1)
    ]
    return np.concatenate(found)


def _noise(values: FloatArray) -> float:
    """Robust standard deviation of a step, by readings that changed and those two before and after [degC].

    How far one is off their middle, the lesser of two neighbours: beside a false reading one is off nothing,
    so that no spikes make a quiet thermometer a noisy one, however seldom it changes; nor does a ramp.
    """

    def off() -> Iterator[FloatArray]:
        for part in large.pieces(values):
            changed = values[part][np.diff(values[part], prepend=np.nan) != 0.0]
            away = np.abs(changed[2:-2] - 0.5 * (changed[:-4] + changed[4:]))
            yield np.minimum(away[:-1], away[1:])

    middle = large.median(off)
    return 0.0 if np.isnan(middle) else _STEP_PER_OFF * middle


def _first_good(time: FloatArray, values: FloatArray, ranged: BoolArray, rule: DropoutRule) -> int:
    """The first reading in range that is as near to what most of the first ones are as heat allows."""
    places = np.flatnonzero(ranged)[:_STARTING]
    usual, middle = float(np.median(values[places])), float(np.median(time[places]))
    limit = rule.jump_degC + rule.rate_degC_s * np.abs(time[places] - middle)
    near = places[np.abs(values[places] - usual) <= limit]
    return int(near[0]) if len(near) else int(places[0])


def _hold(
    time: FloatArray,
    values: FloatArray,
    ranged: BoolArray,
    cleaned: FloatArray,
    bad: BoolArray,
    start: int,
    rule: DropoutRule,
    before: LastReading | None,
) -> int:
    """Hold the reading before `start` until one is good again; the place of that one."""
    good, since = float(cleaned[start - 1]), float(time[start - 1])
    rejected, rejected_s = (None, since) if before is None else (before.rejected, before.rejected_s)
    for i in range(start, len(values)):
        value, now = float(values[i]), float(time[i])
        if ranged[i] and believed(rule, value, now, good, since, rejected, rejected_s):
            return i
        bad[i], cleaned[i], rejected, rejected_s = True, good, value, now
    return len(values)


def believed(
    rule: DropoutRule,
    value: float,
    now_s: float,
    good: float,
    good_s: float,
    rejected: float | None,
    rejected_s: float,
) -> bool:
    """Whether a reading in range [degC] is one, after a good one and what was rejected since, if anything."""
    passed = now_s - good_s
    if not abs(value - good) <= rule.jump_degC + rule.rate_degC_s * passed:
        return False
    if rejected is None or (passed > rule.spell_s and value != rejected):
        return True
    return not abs(value - rejected) <= rule.continuing_degC + rule.rate_degC_s * (now_s - rejected_s)


class Told(Enum):
    """What a reading is.

    ``FIRST``: nothing confirms it yet, and nothing before it counts. ``GOOD``: it goes on from the last
    good one. ``MISSING``: it is none.
    """

    FIRST = 0
    GOOD = 1
    MISSING = 2


class ThermometerStream:
    """`fogml.runs.dropouts.read_thermometer` fed one reading at a time.

    A recording's first readings are told by those around them, which are not known on board: there a first
    reading that the next one contradicts is replaced by it. Noise beyond the rule's jump is not made up for.
    """

    def __init__(self, rule: DropoutRule = RULE) -> None:
        self._rule = rule
        self._good = self._good_s = self._rejected_s = float("nan")
        self._readings = 0
        self._rejected: float | None = None

    def read(self, time_s: float, value: float) -> Told:
        """What a reading [degC] at a time [s] is."""
        rule, known = self._rule, self._readings > 0
        held = self._good, self._good_s, self._rejected, self._rejected_s
        near = known and believed(rule, value, time_s, *held)
        repeated = known and value == self._rejected
        ranged = rule.low_degC <= value <= rule.high_degC
        if not ranged or repeated or (self._readings > 1 and not near):
            self._rejected, self._rejected_s = value, time_s
            return Told.MISSING
        self._good, self._good_s, self._rejected = value, time_s, None
        self._readings = 2 if near else 1
        return Told.GOOD if near else Told.FIRST
