"""Readings of a thermometer that are none, told sample by sample as on board."""

from __future__ import annotations

from enum import Enum

from fogml.runs.dropouts import RULE, DropoutRule


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
        self._good = self._good_s = float("nan")
        self._readings = 0
        self._rejected: float | None = None

    def read(self, time_s: float, value: float) -> Told:
        """What a reading [degC] at a time [s] is."""
        rule = self._rule
        repeated = value == self._rejected
        if not rule.low_degC <= value <= rule.high_degC or (self._readings and repeated):
            self._rejected = value
            return Told.MISSING
        if self._readings:
            limit = rule.jump_degC + rule.rate_degC_s * (time_s - self._good_s)
            if abs(value - self._good) > limit and self._readings > 1:
                self._rejected = value
                return Told.MISSING
            near = abs(value - self._good) <= limit
        else:
            near = False
        self._good, self._good_s, self._rejected = value, time_s, None
        self._readings = 2 if near else 1
        return Told.GOOD if near else Told.FIRST
