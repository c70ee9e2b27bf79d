"""How a CSV file is written: encoding, separator, decimal mark, header, told from its first lines."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fogml.errors import InputError
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.raw_table import wanted_cells

SEPARATORS = (",", ";", "\t")
MISSING = frozenset({"", "nan", "na", "n/a", "null", "-nan", "#n/a", "none"})
"""What stands for a missing value, in lower case."""
_HEAD_BYTES = 1 << 16
_LINE_END = re.compile(r"\r\n|\r|\n")
_SEARCH_BYTES = 1 << 24
_MARK = re.compile(rb"\d[.,]\d")
_DECIMAL_POINT = re.compile(r"\s*[+-]?\d*\.\d+([eE][+-]?\d+)?\s*\Z")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*\Z")


@dataclass(frozen=True)
class CsvDialect:
    """How a CSV file is written.

    Attributes
    ----------
    separator, decimal, encoding
        As Python's `csv` and `open` take them.
    header_line
        Line of the header, counted from 1.
    cells
        Header cells in order.
    blanks
        Empty fields that each line has beyond the header's, from separators at its end.
    text
        Positions of columns unknown to the run format that hold text.
    unwanted
        Positions of other columns that are not read.
    """

    separator: str
    decimal: str
    encoding: str
    header_line: int
    cells: tuple[str, ...]
    blanks: int = 0
    text: frozenset[int] = frozenset()
    unwanted: frozenset[int] = frozenset()

    @cached_property
    def read(self) -> tuple[int, ...]:
        """Positions of the columns that are read."""
        return tuple(i for i in range(len(self.cells)) if i not in self.text | self.unwanted)

    @cached_property
    def known(self) -> frozenset[int]:
        """Positions of the columns of the run format."""
        return frozenset(i for i, cell in enumerate(self.cells) if column_spec(parse_header(cell)[0]))

    def only(self, columns: Collection[str] | None) -> CsvDialect:
        """The dialect for reading time, gyro and these columns; all of them for None."""
        wanted = wanted_cells(self.cells, columns)
        return replace(self, unwanted=frozenset(i for i, c in enumerate(self.cells) if c not in wanted))

    def name(self, i: int) -> str:
        """Name of the column at a position."""
        return parse_header(self.cells[i])[0]


def csv_dialect(path: Path) -> CsvDialect:
    """Tell the dialect from a file's first lines.

    Raises
    ------
    InputError
        If the file is empty, no text, or begins with numbers in place of a header.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    # UTF-16, which spreadsheets call "Unicode text", is full of zero bytes too.
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError(f"{path.name}: the text is UTF-16; save it as CSV in UTF-8")
    if b"\x00" in head:
        raise _no_text(path.name)
    cut = len(head) == _HEAD_BYTES
    encoding = _encoding(head, cut)
    lines = _LINE_END.split(head.decode(encoding, errors="ignore"))
    if cut and len(lines) > 1:
        lines.pop()  # incomplete
    first = next((i for i, line in enumerate(lines) if line.strip()), None)
    if cut and (first is None or len(lines) == 1):
        raise InputError(
            f"{path.name}: no line ends within the first {_HEAD_BYTES} bytes; a header such as "
            "'time [s],gyro [deg/h],T [degC]' and rows of numbers were expected"
        )
    if first is None:
        raise InputError(f"{path.name}: the file is empty; a header and samples were expected")
    if any(ord(character) < 32 and character != "\t" for character in lines[first]):
        raise _no_text(path.name)
    separator = max(SEPARATORS, key=lambda s: _outside_quotes(lines[first]).count(s))
    cells = _cells(_fields(lines[first], separator))
    rows = [_fields(line, separator) for line in lines[first + 1 :] if line.strip()]
    dialect = CsvDialect(separator, _decimal_mark(path, rows, separator), encoding, first + 1, cells)
    _check_header(path.name, dialect)
    text = {
        i
        for i in set(range(len(cells))) - dialect.known
        if any(i < len(row) and number(row[i], dialect.decimal) is None for row in rows)
    }
    blanks = _blanks(rows[0], len(cells)) if rows else 0
    return CsvDialect(separator, dialect.decimal, encoding, first + 1, cells, blanks, frozenset(text))


def number(field: str, decimal: str) -> float | None:
    """The value of a field, NaN where it is missing, None where it is no number."""
    field = field.strip()
    if field.lower() in MISSING:
        return np.nan
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


def _decimal_mark(path: Path, rows: Sequence[Sequence[str]], separator: str) -> str:
    """The mark in the first rows; in the rest of the file, where those hold whole numbers only."""
    fields = [field for row in rows for field in row]
    if any(_DECIMAL_COMMA.match(field) for field in fields if "," in field):
        return ","
    if separator == "," or any(_DECIMAL_POINT.match(field) for field in fields):
        return "."
    with path.open("rb") as file:
        file.seek(_HEAD_BYTES)
        while part := file.read(_SEARCH_BYTES):
            if found := _MARK.search(part):
                return found[0][1:2].decode("ascii")
    return "."


def _encoding(head: bytes, cut: bool) -> str:
    for end in range(4 if cut else 1):
        # The last character of a cut head may be incomplete.
        try:
            head[: len(head) - end].decode("utf-8")
        except UnicodeDecodeError:
            continue
        return "utf-8-sig"
    return "latin-1"


def _outside_quotes(line: str) -> str:
    return re.sub(r'"[^"]*"', "", line)


def _fields(line: str, separator: str) -> list[str]:
    if line and '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator), [])


def _cells(fields: Sequence[str]) -> tuple[str, ...]:
    """Header cells; a column without a name is called by its place."""
    cells = [field.strip() for field in fields]
    while cells and not cells[-1]:
        cells.pop()
    return tuple(cell or f"column {i}" for i, cell in enumerate(cells, start=1))


def _blanks(row: Sequence[str], width: int) -> int:
    beyond = row[width:]
    return 0 if any(field.strip() for field in beyond) else len(beyond)


def _check_header(file: str, dialect: CsvDialect) -> None:
    numbers = sum(number(cell, mark) is not None for cell in dialect.cells for mark in (".", ","))
    if not dialect.cells or numbers >= len(dialect.cells) / 2:
        found = "holds numbers" if dialect.cells else "names no columns"
        raise InputError(
            f"{file}, line {dialect.header_line}: no header, the first line {found}; "
            "write a header such as 'time [s],gyro [deg/h],T [degC]'"
        )


def _no_text(file: str) -> InputError:
    return InputError(
        f"{file}: not a text file (it holds control characters); CSV was expected, as it is none of "
        "Parquet, HDF5 and MATLAB"
    )
