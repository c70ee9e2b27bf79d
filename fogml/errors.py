"""The errors that fogml raises on purpose, and how their messages quote what was found.

Anything else that escapes is a defect. The command line turns an `InputError` into one
message and exit status 2.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

LONGEST_QUOTED = 60
"""Characters of a value that a message quotes; more tells nobody anything."""
LONGEST_MESSAGE = 2000
"""Characters of a whole message: a screenful."""
# Line ends stay: some messages point at a place below a line. Lone surrogates can't be printed.
_UNPRINTABLE = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


class FogmlError(Exception):
    """Base of every error that fogml raises on purpose; its message is fit to be printed."""

    def __init__(self, message: object = "") -> None:
        super().__init__(printable(str(message), LONGEST_MESSAGE))


class InputError(FogmlError):
    """Bad input or usage.

    The message names the file, the column and the row where they are known, what was
    expected, and what to do.
    """


class UnknownName(InputError):
    """A name that neither fogml nor an installed package declares."""


def printable(text: str, longest: int = LONGEST_QUOTED) -> str:
    """Text from a file fit for a message: cut in the middle of what is too long, no control characters."""
    if len(text) > longest:
        end = longest // 3
        text = f"{text[: longest - end - 3]}...{text[len(text) - end :]}"
    return _UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)


def first_line(error: BaseException) -> str:
    """The reason that an exception gives, in one line; its kind where it gives none."""
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def in_one_line(message: str) -> str:
    """A message without the text that it points into and the mark below that."""
    lines = message.splitlines()
    kept = [line for line, below in zip(lines, [*lines[1:], ""]) if "^" not in (line.strip(), below.strip())]
    return "; ".join(line.strip() for line in kept)


def quoted(value: object) -> str:
    """A value that was found, for a message: text in quotation marks, any other as Python writes it, cut."""
    if isinstance(value, str):
        return f"'{printable(value.replace(chr(10), ' '))}'"
    return printable(_brief.repr(value).replace("\n", " "))


def other_schema(found: object, schema: str, remedy: str) -> str:
    """What is wrong with a file of another schema than the one that is read: one of a newer fogml says so."""
    name, _, number = found.rpartition("/") if isinstance(found, str) else ("", "", "")
    own, _, read = schema.rpartition("/")
    if name == own and number.isdecimal() and (len(number), number) > (len(read), read):
        return f"schema {quoted(found)} is of a newer fogml; this one reads '{schema}': update fogml"
    return f"schema {quoted(found)}, expected '{schema}'{'; ' if remedy else ''}{remedy}"


def did_you_mean(name: str, known: Iterable[str], most: int = 1) -> str:
    """``did you mean 'x'? `` where known names look like this one or hold it, else nothing."""
    known = list(known)
    near = get_close_matches(name, known, n=most, cutoff=0.6 if most == 1 else 0.5)
    near += [one for one in known if len(name) > 2 and name in one and one not in near][: most - len(near)]
    return f"did you mean {' or '.join(repr(one) for one in near)}? " if near else ""


def did_you_mean_of(word: str, told: Mapping[str, str]) -> str:
    """``did you mean 'x'? `` of names and what each is for: nearly the word, else told by it or like it."""
    if len(word) < 3 or get_close_matches(word, told, n=1, cutoff=0.8):
        return did_you_mean(word, told)
    held = [name for name, text in told.items() if re.search(rf"\b{re.escape(word)}", text, re.IGNORECASE)]
    return f"did you mean {' or '.join(map(repr, held[:3]))}? " if held else did_you_mean(word, told)


def known_are(name: str, known: Iterable[str], what: str = "known") -> str:
    """``did you mean 'x'? known are x, y``: how a message on a name that is none of these ends."""
    known = list(known)
    return f"{did_you_mean(name, known)}{what} are {', '.join(known)}"


def install_words(extra: str) -> str:
    """How to install what an extra brings, with a network and without."""
    return f"pip install '.[{extra}]' in fogml's source; without a network: fogml docs install"


def counted(count: int, word: str, words: str | None = None) -> str:
    """``1 row``, ``3 rows``; `words` where the plural is no mere s."""
    return f"{count} {word if count == 1 else words or word + 's'}"


def listed(names: object, most: int = 12) -> str:
    """Names for a message, each cut, and only so many of them."""
    texts = [printable(str(name).replace("\n", " ")) for name in list(names)]  # type: ignore[call-overload]
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return ", ".join(texts[:most]) + more


_brief = reprlib.Repr()
_brief.maxstring = _brief.maxother = _brief.maxlong = LONGEST_QUOTED
