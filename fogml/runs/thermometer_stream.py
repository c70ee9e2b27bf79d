"""Readings of a thermometer that are none, told sample by sample as on board."""

from __future__ import annotations

from enum import Enum

from fogml.runs.dropouts import RULE, DropoutRule, believed


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

    Parameters
    ----------
    rule
        What is none.
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
