"""The grammar of feature text: from ``T^1..5, dT[slope, 60 s], T*dT`` to terms.

::

    features   = product { "," product }
    product    = factor { "*" factor }
    factor     = primary [ options ] [ "^" power [ ".." power ] ]    options and power in either order
    primary    = signal | "(" primary ")" | rate | "diff" "(" signal ")" | "sign" "(" rate [ options ] ")"
    rate       = "d" sensor | "d" "(" signal ")"                     dT, dT_in, d(T_in-T_out)
    signal     = [ "-" ] part { ("+" | "-") part }                   T, T_in-T_out, 0.5*T1+0.5*T3
    part       = [ number "*" ] sensor
    options    = "[" method [ "," window ] "]" | "[" window "]"
    window     = number unit

Sums and differences of sensors bind tighter than products and powers, because a feature can be no
other sum: ``T_in-T_out^2`` is ``(T_in-T_out)^2``. Spaces do not matter.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import product as all_products
from typing import NoReturn, cast

from fogml.errors import InputError
from fogml.features.atoms import DEFAULT_WINDOW, METHODS, Atom, Method, Window
from fogml.features.signal import Signal, known_temperatures
from fogml.features.terms import Term
from fogml.runs.columns import is_temperature

HIGHEST_POWER = 20
WINDOW_UNITS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+(?:\.(?!\.)\d*)?|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<range>\.\.)|(?P<sign>[-+*^,()\[\]]))"
)
_SPACE = re.compile(r"\s*")
_RATE_NAME = re.compile(r"d(T\w*)\Z")


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    at: int


def parse_terms(text: str) -> tuple[Term, ...]:
    """The terms that feature text stands for, in the order written, ranges of powers spread out.

    Raises
    ------
    InputError
        If the text is not understood, or a feature is there twice; the message points at the
        place and lists what is known there.
    """
    return _Parser(text).features()


class _Parser:
    """Recursive descent over the tokens, one method per rule of the grammar."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens: list[_Token] = []
        at = _SPACE.match(text).end()  # type: ignore[union-attr]  # matches always
        while at < len(text):
            match = _TOKEN.match(text, at)
            if match is None:
                self.fail(f"unexpected '{text[at]}'", at, self.known())
            kind = cast(str, match.lastgroup)
            self.tokens.append(_Token(kind, match[kind], match.start(kind)))
            at = _SPACE.match(text, match.end()).end()  # type: ignore[union-attr]
        self.tokens.append(_Token("end", "", len(text.rstrip())))
        self.next = 0

    def fail(self, message: str, at: int, hint: str = "") -> NoReturn:
        shown = re.sub(r"\s", " ", self.text)
        lines = [f"feature text: {message}", f"  {shown}", f"  {' ' * at}^"]
        raise InputError("\n".join([*lines, hint] if hint else lines))

    @staticmethod
    def known() -> str:
        return (
            f"known: temperatures {known_temperatures()}; differences T_in-T_out, diff(x); rates d(x), dT; "
            "directions sign(dT); products x*y, powers x^3, x^1..5; "
            f"options [method, window], method {', '.join(METHODS)}, window e.g. 64 s"
        )

    @property
    def token(self) -> _Token:
        return self.tokens[self.next]

    def take(self, *texts: str) -> _Token | None:
        """The next token if it is one of these signs, else None."""
        token = self.token
        if token.kind in ("sign", "range") and token.text in texts:
            self.next += 1
            return token
        return None

    def expect(self, text: str, why: str) -> None:
        if self.take(text) is None:
            self.fail(f"'{text}' expected {why}, found {self.found()}", self.token.at)

    def found(self) -> str:
        return f"'{self.token.text}'" if self.token.kind != "end" else "the end"

    def features(self) -> tuple[Term, ...]:
        terms: dict[Term, None] = {}
        while True:
            at = self.token.at
            for term in self.product():
                if term in terms:
                    self.fail(f"{term.text} is there twice", at, "name each feature once")
                terms[term] = None
            if self.token.kind == "end":
                return tuple(terms)
            if self.take(",") is None:
                self.fail(f"unexpected {self.found()}", self.token.at, "features are separated by commas")

    def product(self) -> list[Term]:
        factors = [self.factor()]
        while self.take("*"):
            factors.append(self.factor())
        return [Term(choice) for choice in all_products(*factors)]

    def factor(self) -> list[tuple[Atom, int]]:
        at = self.token.at
        atom = self.primary()
        powers = None
        windowed = False
        while True:
            if self.token.text == "[" and not windowed:
                atom, windowed = self.with_options(atom, at), True
            elif self.token.text == "^" and powers is None:
                powers = self.powers()
            else:
                return [(atom, power) for power in powers or (1,)]

    def primary(self) -> Atom:
        token = self.token
        if token.kind == "name" and token.text == "diff":
            self.next += 1
            return Atom("diff", self.signal_in_parentheses("diff"))
        if token.kind == "name" and token.text == "sign":
            self.next += 1
            return self.direction()
        if self.is_rate(token):
            return self.rate()
        if token.text == "(":
            self.next += 1
            atom = self.primary()
            self.expect(")", "to close the parenthesis")
            return atom
        return Atom("value", self.signal())

    @staticmethod
    def is_rate(token: _Token) -> bool:
        return token.kind == "name" and (token.text == "d" or _RATE_NAME.match(token.text) is not None)

    def rate(self) -> Atom:
        token = self.token
        self.next += 1
        if token.text == "d":
            atom = Atom("d", self.signal_in_parentheses("d"))
        else:
            sensor = token.text[1:]
            if not is_temperature(sensor):
                self.fail(f"'{sensor}' is not a temperature", token.at + 1, self.known())
            atom = Atom("d", Signal.of(sensor))
        self.no_sum_of_rates()
        return atom

    def no_sum_of_rates(self) -> None:
        if self.token.text in ("+", "-"):
            hint = "write the rate of a difference as d(T_in-T_out)"
            self.fail("only temperatures can be added or subtracted", self.token.at, hint)

    def direction(self) -> Atom:
        self.expect("(", "after sign")
        if not self.is_rate(self.token):
            self.fail(f"a rate expected in sign(...), found {self.found()}", self.token.at, "write sign(dT)")
        at = self.token.at
        rate = self.rate()
        if self.token.text == "[":
            rate = self.with_options(rate, at)
        self.expect(")", "to close sign(")
        return Atom("sign", rate.signal, rate.window)

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
            self.expect("*", "between a number and the temperature that it scales")
        token = self.token
        if token.kind == "name" and is_temperature(token.text):
            self.next += 1
            return token.text, sign * coefficient
        if token.kind == "name" and (token.text in ("d", "diff", "sign") or self.is_rate(token)):
            hint = "write the rate of a difference as d(T_in-T_out)"
            self.fail(f"a temperature expected, found '{token.text}'", token.at, hint)
        what = f"unknown name '{token.text}'" if token.kind == "name" else f"found {self.found()}"
        self.fail(f"a temperature or a function of it expected, {what}", token.at, self.known())

    def powers(self) -> range:
        self.next += 1
        low = high = self.power()
        if self.take(".."):
            at = self.token.at
            high = self.power()
            if high < low:
                self.fail(f"the range {low}..{high} runs backwards", at)
        return range(low, high + 1)

    def power(self) -> int:
        token = self.token
        if token.kind != "number" or not token.text.isdigit() or not 1 <= int(token.text) <= HIGHEST_POWER:
            self.fail(
                f"a whole power from 1 to {HIGHEST_POWER} expected, found {self.found()}",
                token.at,
                "write x^3, or x^1..5 for the powers 1 to 5",
            )
        self.next += 1
        return int(token.text)

    def with_options(self, atom: Atom, at: int) -> Atom:
        opening = self.token.at
        self.next += 1
        if atom.window is None:
            hint = f"options belong to rates and differences: d({atom.text})[...]"
            self.fail(f"{atom.text} takes no options", opening, hint)
        if atom.window != DEFAULT_WINDOW:
            self.fail(f"{atom.text} has its options already", opening)
        window = self.window()
        self.expect("]", "to close the options")
        self.no_sum_of_rates()
        return Atom(atom.operator, atom.signal, window)

    def window(self) -> Window:
        token = self.token
        if token.kind == "number":
            return Window("block", self.length())
        if token.kind != "name" or token.text not in METHODS:
            hint = f"known methods: {', '.join(METHODS)}; e.g. dT[block, 64 s]"
            self.fail(f"a method or a window expected, found {self.found()}", token.at, hint)
        self.next += 1
        method: Method = token.text
        comma = self.take(",")
        if comma is None:
            return Window(method)
        if method == "first":
            self.fail("first takes no window: it is of neighbouring samples", comma.at)
        return Window(method, self.length())

    def length(self) -> float:
        token = self.token
        if token.kind != "number":
            self.fail(f"a window's length expected, found {self.found()}", token.at, "e.g. [block, 64 s]")
        self.next += 1
        unit = self.token
        if unit.kind != "name" or unit.text not in WINDOW_UNITS:
            hint = f"known units: {', '.join(WINDOW_UNITS)}"
            self.fail(f"the window's unit expected, found {self.found()}", unit.at, hint)
        self.next += 1
        length = float(token.text) * WINDOW_UNITS[unit.text]
        if not 0.0 < length < float("inf"):
            self.fail("the window's length must be more than 0", token.at)
        return length
