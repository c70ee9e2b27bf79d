"""Tokens of feature text, read one after another, and what they make: signals, lengths, calls of operators.

Errors point at their places in the text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn, cast

from fogml.errors import InputError, quoted
from fogml.features.atoms import HYSTERESIS_DEGC, Atom
from fogml.features.own import FUNCTIONS, METHODS, Function, Recursion
from fogml.features.signal import NOT_INPUTS, TIME_ON, Signal, known_temperatures

MOST_CHARACTERS = 10_000
"""Longest feature text: what the toolkit writes itself has some hundreds of characters."""
_SHOWN = 40
# Characters of a text to each side of the place that a message points at.
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+(?:\.(?!\.)\d*)?|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<range>\.\.)|(?P<sign>[-+*^,()\[\]]))",
    re.ASCII,
)
_SPACE = re.compile(r"\s*")


@dataclass(frozen=True)
class Token:
    """A number, name, range, sign or the end, and where it stands in the text."""

    kind: str
    text: str
    at: int


class TokenReader:
    """The tokens of a text; raises errors that point at a place in it."""

    def __init__(self, text: str) -> None:
        self.text = text
        if len(text) > MOST_CHARACTERS:
            hint = f"at most {MOST_CHARACTERS} are read"
            self.fail(f"{len(text)} characters long", MOST_CHARACTERS, hint)
        self.tokens: list[Token] = []
        at = _SPACE.match(text).end()  # type: ignore[union-attr]  # matches always
        while at < len(text):
            match = _TOKEN.match(text, at)
            if match is None:
                self.fail(f"unexpected {quoted(text[at])}", at, self.known())
            kind = cast(str, match.lastgroup)
            self.tokens.append(Token(kind, match[kind], match.start(kind)))
            at = _SPACE.match(text, match.end()).end()  # type: ignore[union-attr]
        self.tokens.append(Token("end", "", len(text.rstrip())))
        self.next = 0

    def fail(self, message: str, at: int, hint: str = "", error: type[InputError] = InputError) -> NoReturn:
        """Raise an InputError that points at a place of the text."""
        start, end = max(0, at - _SHOWN), at + _SHOWN
        before, after = "..." if start else "", "..." if end < len(self.text) else ""
        shown = before + re.sub(r"\s", " ", self.text[start:end]) + after
        lines = [f"feature text: {message}", f"  {shown}", f"  {' ' * (at - start + len(before))}^"]
        raise error("\n".join([*lines, hint] if hint else lines))

    @staticmethod
    def known() -> str:
        """What feature text can be made of."""
        return (
            f"known: temperatures {known_temperatures()}, and any other column by its name; differences "
            "T_in-T_out, diff(x); rates d(x), dT; directions sign(dT); memory lag(x, 600 s), "
            "play(x, 4 degC), hysteresis(x), since_on(400 s); the way beyond(x, -20 degC, 60 degC); "
            "products x*y, powers x^3, x^1..5; "
            f"options [method, window], method {', '.join(METHODS)}, window e.g. 64 s"
        )

    @property
    def token(self) -> Token:
        """The next token."""
        return self.tokens[self.next]

    def take(self, *texts: str) -> Token | None:
        """The next token if it is one of these signs, else None."""
        token = self.token
        if token.kind in ("sign", "range") and token.text in texts:
            self.next += 1
            return token
        return None

    def expect(self, text: str, why: str) -> None:
        """Take this sign, or fail."""
        if self.take(text) is None:
            self.fail(f"'{text}' expected {why}, found {self.found()}", self.token.at)

    def found(self) -> str:
        """The next token as messages name it."""
        return quoted(self.token.text) if self.token.kind != "end" else "the end"


WINDOW_UNITS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}

_RATE_NAME = re.compile(r"d(T\w*)\Z", re.ASCII)


class OperandReader(TokenReader):
    """Reads signals, lengths of time, and operators with a memory or with bounds."""

    def calls(self, function: str) -> bool:
        """Whether a call of a function comes next."""
        return self.token.kind == "name" and self.token.text == function

    def hysteresis(self) -> list[Atom]:
        at = self.token.at
        self.next += 1
        signal = self.signal_in_parentheses("hysteresis")
        if signal.unit != "degC":
            self.fail(
                f"hysteresis({signal.text}) is not of a temperature",
                at,
                "write play(x, 0.5) with half widths",
            )
        return [Atom("play", signal, memory=half_width) for half_width in HYSTERESIS_DEGC]

    def memory(self) -> Atom:
        """A lag, a play, a decay since power-on, or what lies beyond bounds."""
        function = self.token.text
        self.next += 1
        self.expect("(", f"after {function}")
        if function == "since_on":
            atom = Atom(
                "since_on", Signal.of(TIME_ON), memory=self.length("time constant", "since_on(400 s)")
            )
        else:
            signal, following = self.signal(), _FOLLOWING[function]
            self.expect(",", f"before the {following} of {function}")
            if function == "lag":
                atom = Atom("lag", signal, memory=self.length(following, "lag(T, 600 s)"))
            elif function == "play":
                atom = Atom("play", signal, memory=self.half_width(signal))
            else:
                atom = self.beyond(signal)
        self.expect(")", f"to close {function}(")
        return atom

    def own(self, declared: Function | Recursion) -> Atom:
        """An operator of one's own, with its parameters."""
        self.next += 2
        signal, given = self.signal(), []
        for kind in declared.parameters:
            self.expect(",", f"before a parameter of {declared.name}")
            if kind == "s":
                given.append(self.length("parameter", f"{declared.name}(..., 60 s)"))
            else:
                given.append(self.number(signal, kind == "x"))
        self.expect(")", f"to close {declared.name}(")
        return Atom(declared.name, signal, parameters=tuple(given))

    def number(self, signal: Signal, of_signal: bool) -> float:
        """A number, in the unit of a signal or plain."""
        sign = -1.0 if self.take("-") else 1.0
        token = self.token
        if token.kind != "number":
            self.fail(f"a number expected, found {self.found()}", token.at)
        self.next += 1
        if of_signal:
            self.unit_of_number(signal, "number", "4 degC")
        return sign * self.finite(token)

    def beyond(self, signal: Signal) -> Atom:
        at = self.token.at
        low = self.bound(signal)
        self.expect(",", "before the upper bound of beyond")
        high = self.bound(signal)
        if not low < high:
            self.fail("the upper bound must be above the lower one", at, "e.g. beyond(T, -20 degC, 60 degC)")
        return Atom("beyond", signal, bounds=(low, high))

    def bound(self, signal: Signal) -> float:
        sign = -1.0 if self.take("-") else 1.0
        token = self.token
        if token.kind != "number":
            self.fail(
                f"a bound expected, found {self.found()}", token.at, "e.g. beyond(T, -20 degC, 60 degC)"
            )
        self.next += 1
        self.unit_of_number(signal, "bound", "beyond(T, -20 degC, 60 degC)")
        return sign * self.finite(token)

    def finite(self, token: Token) -> float:
        """What a number's text says, if a number can be as large."""
        value = float(token.text)
        if value == float("inf"):
            self.fail("the number is too large", token.at)
        return value

    def half_width(self, signal: Signal) -> float:
        token = self.token
        if token.kind != "number":
            self.fail(
                f"a half width above 0 expected, found {self.found()}", token.at, "e.g. play(T, 4 degC)"
            )
        self.next += 1
        self.unit_of_number(signal, "half width", "play(T, 4 degC)", is_width=True)
        half_width = float(token.text)
        if not 0.0 < half_width < float("inf"):
            self.fail("the half width must be more than 0", token.at)
        return half_width

    def unit_of_number(self, signal: Signal, what: str, example: str, *, is_width: bool = False) -> None:
        """Take the unit behind a number that is of a signal's kind; kelvins of what may be no temperature."""
        units = {"degC": ("degC",), "": ()}.get(signal.written_unit, (signal.written_unit,))
        if signal.unit == "degC" and (is_width or signal.is_difference):
            units += ("K",)
        if self.token.kind == "name":
            if self.token.text not in units:
                told = f"'{units[0]}'" if units else "no unit"
                self.fail(f"{told} expected after the {what}, found {self.found()}", self.token.at)
            self.next += 1
        elif signal.unit == "degC":
            self.fail(f"the {what}'s unit expected, found {self.found()}", self.token.at, f"e.g. {example}")

    @staticmethod
    def is_rate(token: Token) -> bool:
        if token.kind != "name":
            return False
        # A column may have a name such as duty: only dT... is a rate without parentheses.
        return token.text == "d" or _RATE_NAME.match(token.text) is not None

    def signal_in_parentheses(self, function: str) -> Signal:
        self.expect("(", f"after {function}")
        signal = self.signal()
        self.expect(")", f"to close {function}(")
        return signal

    def signal(self) -> Signal:
        at = self.token.at
        sign = -1.0 if self.take("-") else 1.0
        parts = [self.part(sign)]
        while token := self.take("+", "-"):
            parts.append(self.part(1.0 if token.text == "+" else -1.0))
        try:
            return Signal(tuple(parts))
        except InputError as error:
            self.fail(str(error).removeprefix("signal: "), at)

    def part(self, sign: float) -> tuple[str, float]:
        coefficient = 1.0
        if self.token.kind == "number":
            coefficient = float(self.token.text)
            self.next += 1
            self.expect("*", "between a number and the column that it scales")
        token = self.token
        if token.kind == "name" and (token.text in FUNCTIONS or self.is_rate(token)):
            hint = "write the rate of a difference as d(T_in-T_out)"
            self.fail(f"a column expected, found '{token.text}'", token.at, hint)
        if token.kind == "name" and token.text in NOT_INPUTS:
            self.fail(f"'{token.text}' is no input of a drift model", token.at, self.known())
        if token.kind == "name":
            self.next += 1
            return token.text, sign * coefficient
        self.fail(f"a column or a function of it expected, found {self.found()}", token.at, self.known())

    def length(self, what: str = "window's length", example: str = "[block, 64 s]") -> float:
        """A time above 0 with its unit [s]."""
        token = self.token
        if token.kind != "number":
            self.fail(f"a {what} above 0 expected, found {self.found()}", token.at, f"e.g. {example}")
        self.next += 1
        unit = self.token
        if unit.kind != "name" or unit.text not in WINDOW_UNITS:
            hint = f"known units: {', '.join(WINDOW_UNITS)}"
            self.fail(f"its unit expected, found {self.found()}", unit.at, hint)
        self.next += 1
        length = float(token.text) * WINDOW_UNITS[unit.text]
        if not 0.0 < length < float("inf"):
            self.fail(f"the {what} must be more than 0", token.at)
        return length


_FOLLOWING = {"lag": "time constant", "play": "half width", "beyond": "lower bound"}
