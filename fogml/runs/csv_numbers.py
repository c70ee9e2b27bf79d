"""Numbers of text files: the decimal mark, marks of thousands, what stands for none."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.errors import quoted
from fogml.runs.csv_source import CsvSource

MISSING = frozenset({"", "nan", "na", "n/a", "null", "-nan", "#n/a", "none"})
"""What stands for a missing value, in lower case."""
_HEAD_BYTES = 1 << 16
_SEARCH_BYTES = 1 << 24
_MARK = re.compile(rb"\d[.,]\d")
_OTHER = {".": ",", ",": "."}
_BLANKS = "\u00a0\u202f "
_DECIMAL = {mark: re.compile(rf"\s*[+-]?\d*{re.escape(mark)}\d+([eE][+-]?\d+)?\s*\Z") for mark in ".,"}
_NUMBER = re.compile(r"\s*[+-]?\d[\d.,]*\s*\Z")
_BARE = re.compile(r"\s*[+-]?\d{1,3}\s*\Z")
# Groups of three digits, by the decimal mark that they leave; no group begins with a zero.
_GROUPS = {
    mark: re.compile(rf"\s*[+-]?[1-9]\d{{0,2}}([{other}'{_BLANKS}]\d{{3}})+({re.escape(mark)}\d*)?\s*\Z")
    for mark, other in _OTHER.items()
}
# With decimals, or of more than one mark, nobody takes them for anything else.
_EVIDENT = {
    mark: re.compile(
        rf"\s*[+-]?[1-9]\d{{0,2}}([{other}'{_BLANKS}]\d{{3}})+({re.escape(mark)}\d+|[{other}'{_BLANKS}]\d{{3}})\s*\Z"
    )
    for mark, other in _OTHER.items()
}


@dataclass(frozen=True)
class Marks:
    """How numbers are written.

    Attributes
    ----------
    decimal
        The decimal mark.
    grouped
        Whether marks of thousands are within numbers.
    doubt
        What the reader should check, where the file's first rows leave the meaning of a mark open.
    """

    decimal: str
    grouped: bool = False
    doubt: str | None = None


PLAIN = Marks(".")
"""Numbers with a decimal point."""


def number(field: str, decimal: str, grouped: bool = False) -> float | None:
    """The value of a field, NaN where it is missing, None where it is no number.

    Marks of thousands are taken out where they can be nothing else, or where a file is known to have them.
    """
    field = field.strip().replace("\u2212", "-")
    if field.lower() in MISSING:
        return np.nan
    if (_GROUPS if grouped else _EVIDENT)[decimal].match(field):
        field = "".join(c for c in field if c.isdigit() or c in f"+-{decimal}")
    if decimal == ",":
        # A point would be a thousands separator or a mix of both marks: nobody can tell.
        if "." in field:
            return None
        field = field.replace(",", ".")
    # Python also takes 1_000 and digits of other scripts, which no logger means.
    if "_" in field or not field.isascii():
        return None
    try:
        return float(field)
    except ValueError:
        return None


def marks_of(source: CsvSource, rows: Sequence[Sequence[str]], separator: str) -> Marks:
    """The marks in a file's numbers, from its first rows, else from the rest.

    Notes
    -----
    A number such as 1.005 may be a decimal or 1005. It is the latter where other marks stand for decimals, or
    where its column also holds numbers below 1000 without any, which decimals of a fixed count never lack.
    Where all that have a mark have three digits behind it, the separator decides: a semicolon and a decimal
    comma go together, as a comma and a decimal point do; and what remains open is said.
    """
    fields = [field for row in rows for field in row]
    for mark in ".,":
        if any(mark in field and _OTHER[mark] in field and _EVIDENT[mark].match(field) for field in fields):
            return Marks(mark, True)
    with_mark = {
        mark: [field for field in fields if mark in field and _DECIMAL[mark].match(field)] for mark in ".,"
    }
    in_threes = {
        mark: bool(found) and all(_GROUPS[_OTHER[mark]].match(field) for field in found)
        for mark, found in with_mark.items()
    }
    for mark, other in _OTHER.items():
        if not in_threes[other]:
            continue
        # Numbers such as 10.78 beside 1,000: all that have a comma are groups of three, and points are not.
        if with_mark[mark] and not in_threes[mark]:
            return Marks(mark, True)
        if not with_mark[mark] and any(_is_of_thousands(column, mark) for column in _columns(rows)):
            return Marks(mark, True, _doubt(with_mark[other][0], mark, True))
    if separator == "," and in_threes[","]:
        return Marks(".", True, _doubt(with_mark[","][0], ".", True))
    if with_mark[","]:
        is_open = separator == "\t" and in_threes[","]
        return Marks(",", False, _doubt(with_mark[","][0], ",", False) if is_open else None)
    if with_mark["."] and separator == ";" and in_threes["."]:
        return Marks(".", False, _doubt(with_mark["."][0], ".", False))
    if separator == "," or with_mark["."]:
        return Marks(".", separator == "," and bool(with_mark["."]))
    with source.open() as file:
        file.read(_HEAD_BYTES)
        while part := file.read(_SEARCH_BYTES):
            if found := _MARK.search(part):
                return Marks(found[0][1:2].decode("ascii"))
    return Marks(".")


def _columns(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    return [[row[i] for row in rows if i < len(row)] for i in range(max(map(len, rows), default=0))]


def _is_of_thousands(column: Sequence[str], mark: str) -> bool:
    """Whether a column's numbers are groups of three digits and, below 1000, bare ones."""
    numbers = [field for field in column if _NUMBER.match(field)]
    grouped = sum(bool(_GROUPS[mark].match(field)) for field in numbers)
    bare = sum(bool(_BARE.match(field)) for field in numbers)
    return grouped > 0 and bare > 0 and grouped + bare == len(numbers)


def _doubt(example: str, decimal: str, grouped: bool) -> str:
    """What is said of numbers that may mean something else."""
    value, other = number(example, decimal, grouped), number(example, _OTHER[decimal], not grouped)
    way = "with another count of decimals" if grouped else "without marks of thousands"
    return (
        f"numbers such as {quoted(example.strip())} are read as {value:.10g}; where {other:.10g} is meant, "
        f"export them {way}"
    )
