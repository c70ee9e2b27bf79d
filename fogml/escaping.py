"""Text of foreign origin made fit for where it is written to: one function for each target.

Names of runs, units, columns and notes come from files that anyone may have made. In a target they
are text and nothing else: no code, no markup, no formula, no command of a terminal. YAML and JSON
are written by their libraries, which quote for themselves.
"""

from __future__ import annotations

import codecs
import re
import unicodedata

from markupsafe import Markup, escape

_COMMENT_MARKS = re.compile(r"(?<=\*)(?=/)|(?<=/)(?=\*)|(?<=\?)(?=\?)")
_UNPRINTABLE = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")
# Controls, formats (directions of writing among them), surrogates, unassigned, ends of line.
_LONGEST_CELL = 32_767
# What a cell of a workbook holds [characters].


class CCode(str):
    """Text that is C itself, made here from numbers and fixed words; `c_text` leaves it alone."""

    __slots__ = ()


def visible(text: object) -> str:
    r"""Text on one line, each character that does not print written as ``\x1b`` or ``\u202e``."""
    return _shown(str(text), kept="")


def c_text(text: object) -> str:
    r"""Text as it may stand inside a comment of C, and cannot end it, on one line of ASCII.

    A star and a slash never meet, nor two question marks (trigraphs), and there is no backslash;
    what is not printable ASCII becomes ``<U+00E9>``. C of one's own, a `CCode`, stays as it is.
    """
    if isinstance(text, CCode):
        return text
    plain = "".join(c if " " <= c <= "~" and c != "\\" else f"<U+{ord(c):04X}>" for c in str(text))
    return _COMMENT_MARKS.sub(" ", plain)


def markup(text: object) -> Markup:
    """Text in HTML, XML or SVG, inside an element or a quoted attribute; a `Markup` stays as it is."""
    return escape(text) if isinstance(text, Markup) else escape(_lines(text))


def script_data(json: str) -> Markup:
    """JSON inside a script element of HTML, which no text in it can end."""
    return Markup(json.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


def figure_text(text: object) -> str:
    """Text in a plotly figure, which takes ``<b>`` and links for markup elsewhere."""
    return str(markup(text)).replace("&#39;", "'").replace("&#34;", '"')


def cell_text(text: object) -> str:
    """Text in a cell of a workbook, at most as long as one may be; written as text, never as a formula."""
    return _lines(text)[:_LONGEST_CELL]


def terminal_text(text: object, encoding: str | None = None) -> str:
    """Text for a terminal: lines and tabs stay, and nothing in it commands the terminal.

    Parameters
    ----------
    text
        What is shown.
    encoding
        The terminal's: signs of figures that it lacks are written in ASCII, letters as question marks.

    Examples
    --------
    >>> terminal_text("−7.1 × 10⁻⁵", "ascii")
    '-7.1 x 10^-5'
    """
    encoding = encoding or "utf-8"
    return _lines(text).encode(encoding, _IN_ASCII).decode(encoding)


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that an encoding lacks, as a handler of its errors."""
    assert isinstance(error, UnicodeEncodeError)
    lacking = _RAISED.sub(lambda held: "^" + held[0], error.object[error.start : error.end])
    return "".join(c if c.isascii() else _PLAIN.get(c, "?") for c in lacking), error.end


_RAISED = re.compile("[⁻⁰¹²³⁴-⁹]+")
_PLAIN = {"…": "...", "→": "->", "±": "+/-", "≤": "<=", "≥": ">=", "√": "sqrt", "✓": "yes", "✗": "no"}
_PLAIN |= dict(zip("−–⁻×·⁰¹²³⁴⁵⁶⁷⁸⁹", "---x*0123456789", strict=True))
_IN_ASCII = "fogml-in-ascii"
codecs.register_error(_IN_ASCII, _in_ascii)


def _lines(text: object) -> str:
    return _shown(str(text), kept="\n\t")


def _shown(text: str, kept: str) -> str:
    """Text whose characters that do not print are written in letters, but for those that are kept."""
    if text.isprintable():
        return text
    return "".join(c if c in kept or unicodedata.category(c) not in _UNPRINTABLE else _coded(c) for c in text)


def _coded(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
