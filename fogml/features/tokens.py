"""The tokens of feature text, read one after the other, and errors that point at their places."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn, cast

from fogml.errors import InputError, quoted
from fogml.features.signal import known_temperatures
from fogml.features.windows import METHODS

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

    def fail(self, message: str, at: int, hint: str = "") -> NoReturn:
        """Raise an InputError that points at a place of the text."""
        start, end = max(0, at - _SHOWN), at + _SHOWN
        before, after = "..." if start else "", "..." if end < len(self.text) else ""
        shown = before + re.sub(r"\s", " ", self.text[start:end]) + after
        lines = [f"feature text: {message}", f"  {shown}", f"  {' ' * (at - start + len(before))}^"]
        raise InputError("\n".join([*lines, hint] if hint else lines))

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
