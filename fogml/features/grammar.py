"""The grammar of feature text: from ``T^1..5, dT[slope, 60 s], T*dT`` to terms.

::

    features   = product { "," product }
    product    = factor { "*" factor }
    factor     = primary [ options ] [ "^" power [ ".." power ] ]    options and power in either order
    primary    = signal | "(" primary ")" | rate | "diff" "(" signal ")" | "sign" "(" rate [ options ] ")"
               | memory
    memory     = "lag" "(" signal "," time ")"                       lag(T, 600 s)
               | "play" "(" signal "," number [ unit ] ")"           play(T, 4 degC)
               | "hysteresis" "(" signal ")"                         play(T, 4 degC), play(T, 10 degC) ...
               | "since_on" "(" time ")"                             since_on(400 s)
               | "beyond" "(" signal "," bound "," bound ")"         beyond(T, -20 degC, 60 degC)
               | own "(" signal { "," number [ unit ] } ")"          one of one's own: `fogml.features.own`
    bound      = [ "-" ] number [ unit ]
    rate       = "d" temperature | "d" "(" signal ")"                dT, dT_in, d(T_in-T_out), d(power)
    signal     = [ "-" ] part { ("+" | "-") part }                   T, T_in-T_out, 0.5*T1+0.5*T3, power
    part       = [ number "*" ] column
    options    = "[" method [ "," window ] "]" | "[" window "]"
    window     = number unit

A column is a temperature or any other that runs record, by its name; ``time_on`` is the time since
power-on. Sums and differences of columns bind tighter than products and powers, because a feature can be no
other sum: ``T_in-T_out^2`` is ``(T_in-T_out)^2``. Spaces do not matter.
"""

from __future__ import annotations

from itertools import product as all_products
from math import prod

from fogml.errors import InputError, UnknownName, known_are, quoted
from fogml.features.atoms import Atom
from fogml.features.operands import OperandReader
from fogml.features.operators import DEFAULT_WINDOW, Window
from fogml.features.own import METHODS, operator_names, own_operator, own_window, window_names
from fogml.features.signal import Signal
from fogml.features.terms import Term
from fogml.runs.columns import is_temperature

HIGHEST_POWER = 20
MOST_PARENTHESES = 10
"""Most parentheses within each other."""
MOST_FACTORS = 20
"""Most factors of a product."""
MOST_TERMS = 1000
"""Most terms, ranges of powers spread out: a fit takes time in their square."""


def parse_terms(text: str) -> tuple[Term, ...]:
    """The terms that feature text stands for, in the order written, ranges of powers spread out.

    Raises
    ------
    InputError
        If the text is not understood, or a feature is there twice; the message points at the
        place and lists what is known there.
    """
    return _Parser(text).features()


class _Parser(OperandReader):
    """Recursive descent over the tokens, one method per rule of the grammar."""

    def features(self) -> tuple[Term, ...]:
        terms: dict[Term, None] = {}
        while True:
            at = self.token.at
            for term in self.product(MOST_TERMS - len(terms)):
                if term in terms:
                    self.fail(f"{term.text} is there twice", at, "name each feature once")
                terms[term] = None
            if self.token.kind == "end":
                return tuple(terms)
            if self.take(",") is None:
                before = self.tokens[self.next - 1]
                if self.token.text == "(" and before.kind == "name":
                    known = known_are(before.text, operator_names(), "operators")
                    hint = f"{known}, and those of packages that are installed"
                    self.fail(f"there is no operator {quoted(before.text)}", before.at, hint, UnknownName)
                self.fail(f"unexpected {self.found()}", self.token.at, "features are separated by commas")

    def product(self, most: int) -> list[Term]:
        at = self.token.at
        factors = [self.factor()]
        while star := self.take("*"):
            if len(factors) == MOST_FACTORS:
                self.fail(f"a product of more than {MOST_FACTORS} factors", star.at, "write powers: x^3")
            factors.append(self.factor())
        if prod(len(factor) for factor in factors) > most:
            self.fail(f"more than {MOST_TERMS} terms", at, "state fewer, or narrower ranges of powers")
        return [Term(choice) for choice in all_products(*factors)]

    def factor(self) -> list[tuple[Atom, int]]:
        at = self.token.at
        if self.calls("hysteresis"):
            atoms = self.hysteresis()
            spread = self.powers() if self.token.text == "^" else range(1, 2)
            return [(atom, power) for atom in atoms for power in spread]
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

    def primary(self, depth: int = 0) -> Atom:
        token = self.token
        if token.kind == "name" and token.text in ("lag", "play", "since_on", "beyond"):
            return self.memory()
        if (
            token.kind == "name"
            and self.tokens[self.next + 1].text == "("
            and (own := own_operator(token.text))
        ):
            return self.own(own)
        if self.calls("hysteresis"):
            self.fail("hysteresis(...) stands for several features; parentheses hold one", token.at)
        if token.kind == "name" and token.text == "diff":
            self.next += 1
            return Atom("diff", self.signal_in_parentheses("diff"))
        if token.kind == "name" and token.text == "sign":
            self.next += 1
            return self.direction()
        if self.is_rate(token):
            return self.rate()
        if token.text == "(":
            if depth == MOST_PARENTHESES:
                self.fail(f"more than {MOST_PARENTHESES} parentheses within each other", token.at)
            self.next += 1
            atom = self.primary(depth + 1)
            self.expect(")", "to close the parenthesis")
            return atom
        return Atom("value", self.signal())

    def rate(self) -> Atom:
        token = self.token
        self.next += 1
        if token.text == "d":
            atom = Atom("d", self.signal_in_parentheses("d"))
        else:
            sensor = token.text[1:]
            if not is_temperature(sensor):
                self.fail(f"{quoted(sensor)} is not a temperature", token.at + 1, self.known())
            atom = Atom("d", Signal.of(sensor))
        self.no_sum_of_rates()
        return atom

    def no_sum_of_rates(self) -> None:
        if self.token.text in ("+", "-"):
            hint = "write the rate of a difference as d(T_in-T_out)"
            self.fail("only columns can be added or subtracted", self.token.at, hint)

    def direction(self) -> Atom:
        self.expect("(", "after sign")
        if not self.is_rate(self.token):
            self.fail(f"a rate expected in sign(...), found {self.found()}", self.token.at, "write sign(dT)")
        at = self.token.at
        rate = self.rate()
        if self.token.text == "[":
            rate = self.with_options(rate, at)
        self.expect(")", "to close sign(")
        if rate.signal.unit != "degC":
            self.fail("the direction of a temperature only is known", at, "write sign(dT)")
        return Atom("sign", rate.signal, rate.window)

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
        small = token.kind == "number" and token.text.isdigit() and len(token.text) < 5
        if not small or not 1 <= int(token.text) <= HIGHEST_POWER:
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
            hint = "options belong to rates and differences, as in d(x)[slope, 60 s]"
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
        if token.kind != "name" or (token.text not in METHODS and own_window(token.text) is None):
            hint = f"known methods: {', '.join(window_names())}, and those of packages that are installed"
            error = UnknownName if token.kind == "name" else InputError
            self.fail(
                f"a method or a window expected, found {self.found()}",
                token.at,
                f"{hint}; e.g. dT[block, 64 s]",
                error,
            )
        self.next += 1
        method = token.text
        comma = self.take(",")
        if comma is None:
            return Window(method)
        if method == "first":
            self.fail("first takes no window: it is of neighbouring samples", comma.at)
        return Window(method, self.length())
