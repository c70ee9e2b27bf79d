"""The bytes of a CSV file as its parsers take them, and the numbers in its text.

Bytes: UTF-8 for UTF-16, no padding, no lines after the data. Numbers: the decimal mark, marks of thousands,
what stands for none.
"""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from fogml.errors import quoted

HEAD_BYTES = 1 << 16
"""Of which it is told how a file is written."""
LINE_END = re.compile(r"\r\n|\r|\n")
_PART_BYTES = 1 << 20
LINES_BYTES = 1 << 23
"""Of a long file, parsed at once and then let go: some 100,000 rows."""
_BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


@dataclass(frozen=True)
class CsvSource:
    """Where a CSV file's text is.

    Attributes
    ----------
    path
        The file.
    wide
        Python's name of its encoding where that is UTF-16 or stated; it is read as UTF-8 then.
    end
        Bytes of the file that hold its table; all of it for None.
    padded
        Whether zero bytes pad its fields; they are read as blanks.
    is_strict
        Whether bytes that are no text of its encoding are an error, of their place in the file.
    """

    path: Path
    wide: str | None = None
    end: int | None = None
    padded: bool = False
    is_strict: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether the file's bytes are read as they are."""
        return self.wide is None and self.end is None and not self.padded

    def open(self) -> BinaryIO:
        """The table's bytes from the beginning."""
        if self.is_plain:
            return self.path.open("rb")
        return cast(BinaryIO, io.BufferedReader(_Converted(self), _PART_BYTES))

    def whole_lines(self) -> Iterator[memoryview]:
        """The table's bytes in parts that end where a line does, used before the next is asked for.

        Raises
        ------
        pyarrow.ArrowInvalid
            Where a line is longer than a part, which is none for the fast parser.
        """
        import pyarrow as arrow

        buffer, rest = bytearray(LINES_BYTES), b""
        view = memoryview(buffer)
        with self.open() as file:
            while read := file.readinto(view[len(rest) :]):  # type: ignore[attr-defined]
                filled = len(rest) + read
                end = max(buffer.rfind(b"\n", 0, filled), buffer.rfind(b"\r", 0, filled)) + 1
                if end == 0 and filled == LINES_BYTES:
                    raise arrow.ArrowInvalid("a line longer than a part")
                yield view[:end]
                rest = bytes(view[end:filled])
                buffer[: len(rest)] = rest
        yield view[: len(rest)]

    def tail(self, size: int) -> bytes:
        """The last bytes of the table, as `open` would give them, of so many in the file or one more."""
        stop = self.stop
        start = max(stop - size, 0)
        with self.path.open("rb") as file:
            file.seek(start - start % 2 if self.wide else start)
            content = file.read(stop - file.tell())
        if self.wide:
            content = content.decode(self.wide, errors="replace").removeprefix("\ufeff").encode()
        return content.replace(b"\0", b" ") if self.padded else content

    @property
    def stop(self) -> int:
        """Where the table ends in the file [bytes]."""
        size = self.path.stat().st_size
        return size if self.end is None else min(self.end, size)

    def without(self, text: str, encoding: str) -> CsvSource:
        """The source without a text at its end."""
        return replace(self, end=self.stop - len(text.encode(self.wide or encoding, "surrogateescape")))


_MOST_CONTROLS = 0.05
"""Share of control characters from which on a text is none: a bad line makes a few, UTF-16 by bytes half."""


def is_binary(start: str) -> bool:
    """Whether the beginning of a file is no text."""
    controls = sum(ord(sign) < 32 and sign not in "\t\r\n\f" for sign in start)
    return controls > _MOST_CONTROLS * len(start)


def csv_source(path: Path) -> tuple[CsvSource, bytes, bytes]:
    """How a file is to be opened, told from its first bytes and its last ones.

    Also the former, `HEAD_BYTES` of the file and of the text that its parsers take.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    wide = _BYTE_ORDER_MARKS.get(head[:2])
    if wide is None and len(head) > 3:
        # UTF-16 without its mark: every other byte of plain letters is zero.
        for at, name in enumerate(("utf-16-be", "utf-16-le")):
            if not any(head[at:256:2]) and all(head[1 - at : 256 : 2]):
                wide = name
    end = None if wide else _without_padding(path)
    source = CsvSource(path, wide, end, padded=wide is None and b"\0" in head[:end])
    with source.open() as opened:
        return source, head, opened.read(HEAD_BYTES)


def _without_padding(path: Path) -> int | None:
    """Bytes of a file before the zero bytes at its end; None where there are none."""
    with path.open("rb") as file:
        size = end = file.seek(0, io.SEEK_END)
        while end > 0:
            start = max(end - _PART_BYTES, 0)
            file.seek(start)
            part = file.read(end - start).rstrip(b"\0")
            if part:
                return start + len(part) if start + len(part) < size else None
            end = start
    return 0


class _Converted(io.RawIOBase):
    """A source's bytes, converted as they are read."""

    def __init__(self, source: CsvSource) -> None:
        self.file = source.path.open("rb")
        self.left = source.stop
        self.padded = source.padded
        errors = "strict" if source.is_strict else "replace"
        self.decoder = codecs.getincrementaldecoder(source.wide)(errors) if source.wide else None
        self.ahead = b""
        self.begun = False

    def readable(self) -> bool:
        return True

    def close(self) -> None:
        self.file.close()
        super().close()

    def readinto(self, buffer: Any) -> int:
        while not self.ahead and self.left > 0:
            part = self.file.read(min(_PART_BYTES, self.left))
            self.left = self.left - len(part) if part else 0
            if self.decoder is not None:
                before = self.file.tell() - len(part) - len(self.decoder.getstate()[0])
                try:
                    text = self.decoder.decode(part, final=self.left == 0)
                except UnicodeDecodeError as error:
                    error.start += before
                    raise
                part = (text if self.begun else text.removeprefix("\ufeff")).encode()
                self.begun = True
            self.ahead = part.replace(b"\0", b" ") if self.padded else part
        count = min(len(buffer), len(self.ahead))
        buffer[:count] = self.ahead[:count]
        self.ahead = self.ahead[count:]
        return count


MISSING = frozenset({"", "nan", "na", "n/a", "null", "-nan", "#n/a", "none"})
"""What stands for a missing value, in lower case."""
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
    # A mark of encodings within a file is one of files put together.
    field = field.strip().lstrip("\ufeff").replace("\u2212", "-")
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
    held = {mark: [field for row in rows for field in row if mark in field] for mark in ".,"}
    for mark, other in _OTHER.items():
        if any(other in field and _EVIDENT[mark].match(field) for field in held[mark]):
            return Marks(mark, True)
    with_mark = {mark: [field for field in held[mark] if _DECIMAL[mark].match(field)] for mark in ".,"}
    in_threes = {
        mark: bool(found) and all(_GROUPS[_OTHER[mark]].match(field) for field in found)
        for mark, found in with_mark.items()
    }
    for mark, other in _OTHER.items():
        if not in_threes[other]:
            continue
        # Numbers such as 10.78 beside 1,000: all that have a comma are groups of three, and points are not.
        if with_mark[mark] and not in_threes[mark]:
            # A column of both was put together from two programs' numbers.
            is_mixed = any(
                all(set(column) & set(found) for found in with_mark.values()) for column in _columns(rows)
            )
            return Marks(mark, True, _doubt(with_mark[other][0], mark, True) if is_mixed else None)
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
        file.read(HEAD_BYTES)
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
