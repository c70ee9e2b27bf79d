"""Reads a sentence word by word, with numbers in stated units, and points at what it can't read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NoReturn

from fogml.errors import InputError

_TIME = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
}
_DEGREES = ("degC", "°C", "C", "K")
_UNITS: Mapping[str, Mapping[str, float]] = {
    "time": _TIME,
    "temperature": {"degC": 1.0, "°C": 1.0, "C": 1.0, "K": 1.0},
    "temperature rate": {
        f"{degree}/{time}": 60.0 / size
        for degree in _DEGREES
        for time, size in (("min", 60.0), ("h", 3600.0), ("s", 1.0))
    },
    "table rate": {
        "deg/s": 1.0,
        "°/s": 1.0,
        "deg/min": 1.0 / 60.0,
        "deg/h": 1.0 / 3600.0,
        "°/h": 1.0 / 3600.0,
    },
    "table acceleration": {"deg/s2": 1.0, "deg/s^2": 1.0, "deg/s²": 1.0, "°/s²": 1.0},
    "frequency": {"Hz": 1.0, "mHz": 1e-3, "kHz": 1e3},
    "angle": {"deg": 1.0, "°": 1.0, "degree": 1.0, "degrees": 1.0},
    "duty": {"%": 0.01},
    "humidity": {"%": 1.0},
    "dose rate": {"Gy/h": 1.0, "Gy/min": 60.0, "krad/h": 10.0},
}
_EXAMPLES = {
    "time": "30 min",
    "temperature": "-40 degC",
    "temperature rate": "1 degC/min",
    "table rate": "10 deg/s",
    "table acceleration": "50 deg/s2",
    "frequency": "10 Hz",
    "angle": "90 deg",
    "duty": "50 %",
    "humidity": "20 %",
    "dose rate": "10 Gy/h",
}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_UNIT = re.compile(r"\s*([^\s,;:\d][^\s,;:]*)")
_WORD = re.compile(r"[A-Za-z]+")
_MOMENTS = ("from", "at", "after")


class SentenceReader:
    """Reads a sentence from left to right and points at the place where it fails."""

    def __init__(self, text: str) -> None:
        # Typeset minus signs come with pasted text.
        self.text = text.replace("\N{MINUS SIGN}", "-")
        self.place = 0
        self._skip()

    def fail(self, message: str, place: int | None = None) -> NoReturn:
        """Raise with the sentence and a caret under the place."""
        at = self.place if place is None else place
        raise InputError(f"{message}\n    {self.text}\n    {' ' * at}^")

    def _skip(self) -> None:
        while self.place < len(self.text) and self.text[self.place] in " \t\n,":
            self.place += 1

    def peek(self) -> str:
        """The word at the place, in small letters; empty if there is none."""
        match = _WORD.match(self.text, self.place)
        return match[0].lower() if match else ""

    def take(self, *words: str) -> bool:
        """Whether one of these words follows; if so it is passed."""
        if self.peek() not in words:
            return False
        self.place += len(self.peek())
        self._skip()
        return True

    def expect(self, *words: str) -> None:
        """Pass a word that must follow."""
        if not self.take(*words):
            self.fail(f"'{words[0]}' was expected here")

    def one_of(self, words: tuple[str, ...], instead: str | None = None) -> str:
        """The word that follows, one of these; `instead` is what to say of a misplaced word."""
        word = self.peek()
        if word not in words:
            wanted = " or ".join(filter(None, [", ".join(f"'{w}'" for w in words[:-1]), f"'{words[-1]}'"]))
            self.fail(instead or f"{wanted} was expected here")
        self.take(word)
        return word

    def number(self) -> float:
        """The number that follows."""
        match = _NUMBER.match(self.text, self.place)
        if match is None:
            self.fail("a number was expected here")
        self.place = match.end()
        return float(match[0])

    def count(self) -> int:
        """A whole number of at least 1."""
        place, value = self.place, self.number()
        if not (value >= 1.0 and value.is_integer()):
            self.fail("a whole number of at least 1 was expected here", place)
        self._skip()
        return int(value)

    def quantity(self, dimension: str) -> float:
        """A number with a unit of this dimension, in the internal unit."""
        return self._with_unit(dimension)[0]

    def temperature(self) -> float:
        """A temperature [degC]."""
        value, unit = self._with_unit("temperature")
        return value - 273.15 if unit == "K" else value

    def _with_unit(self, dimension: str) -> tuple[float, str]:
        place = self.place
        if not _NUMBER.match(self.text, place):
            self.fail(f"a {dimension} such as '{_EXAMPLES[dimension]}' was expected here")
        value, units = self.number(), _UNITS[dimension]
        match = _UNIT.match(self.text, self.place)
        unit = match[1] if match else ""
        if unit not in units:
            self._skip()
            found = f"'{unit}' is not one" if unit else "there is none"
            self.fail(f"a {dimension} needs a unit ({', '.join(units)}), and {found}")
        self.place += len(match[0]) if match else 0
        self._skip()
        return value * units[unit], unit

    def duration(self) -> float:
        """A time above 0 such as ``1 h 30 min`` [s]."""
        place = self.place
        total = self._time()
        if not total > 0.0:
            self.fail("a time above 0 was expected here", place)
        return total

    def _time(self) -> float:
        """A time such as ``1 h 30 min`` [s]; a sign belongs to the first of its parts alone."""
        total = self.quantity("time")
        while _NUMBER.match(self.text, self.place):
            if self.text[self.place] in "+-":
                self.fail("the parts of a time add up, a sign between them was not expected")
            total += self.quantity("time")
        return total

    def moment(self) -> float:
        """When an action begins [s]; at the beginning of the step where nothing is said."""
        if not self.take(*_MOMENTS):
            return 0.0
        place, word = self.place, self.peek()
        if self.take("the"):
            self.expect("start", "beginning")
            return 0.0
        if word in _TIME and self.take(word):
            start = self.number() * _TIME[word]
            self._skip()
        else:
            start = self._time()
        if start < 0.0:
            self.fail("a moment counts from the beginning of the step", place)
        return start

    def end(self) -> None:
        """Check that nothing is left over."""
        if self.place < len(self.text):
            self.fail("this was not understood")
