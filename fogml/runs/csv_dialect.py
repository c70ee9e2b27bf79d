"""How a CSV file is written, told from its first lines: separator, marks in numbers, header, clock."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from fogml.errors import InputError, printable
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.csv_header import fields_of, header_over_lines
from fogml.runs.csv_source import (
    HEAD_BYTES,
    LINE_END,
    CsvSource,
    Marks,
    csv_source,
    is_binary,
    marks_of,
    number,
)
from fogml.runs.encodings import encoding_of
from fogml.runs.header_spelling import DATE_NAMES
from fogml.runs.raw_table import empty_file, no_text, wanted_cells
from fogml.runs.stamp_forms import FRACTION, StampForm
from fogml.runs.stamps import Stamps, part_of_a_second, stamps_of


@dataclass(frozen=True)
class CsvDialect:
    """How a CSV file is written.

    Attributes
    ----------
    source
        Where its bytes are.
    separator, encoding
        As Python's `csv` and `open` take them.
    marks
        How its numbers are written.
    header_line
        Line of the header, counted from 1.
    skipped_lines
        Lines before the data: the header's, and a row of units below it.
    cells
        Header cells in order, spelled as in the run format.
    stamps
        The clock, where times are dates and times of day.
    blanks
        Empty fields that each line has beyond the header's, from separators at its end.
    text
        Positions of columns unknown to the run format that hold text.
    unwanted
        Positions of other columns that are not read.
    """

    source: CsvSource
    separator: str
    marks: Marks
    encoding: str
    header_line: int
    skipped_lines: int
    cells: tuple[str, ...]
    stamps: Stamps | None = None
    blanks: int = 0
    text: frozenset[int] = frozenset()
    unwanted: frozenset[int] = frozenset()

    @cached_property
    def stamp_places(self) -> tuple[int, ...]:
        """Positions of the columns that make the clock's stamps."""
        return tuple(place for place, _ in self.stamps.columns) if self.stamps else ()

    @cached_property
    def time_cell(self) -> str:
        """Header cell of the clock that stamps become."""
        return self.cells[self.stamp_places[-1]]

    @cached_property
    def read(self) -> tuple[int, ...]:
        """Positions of the columns of numbers that are read."""
        left_out = self.text | self.unwanted | set(self.stamp_places)
        return tuple(i for i in range(len(self.cells)) if i not in left_out)

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

    def value(self, field: str) -> float | None:
        """As `number`, by this dialect's marks."""
        return number(field, self.marks.decimal, self.marks.grouped)


def csv_dialect(path: Path, seconds: Collection[int] = ()) -> CsvDialect:
    """Tell the dialect from a file's first lines.

    `seconds` are places of columns that are in seconds whatever the header says.

    Raises
    ------
    InputError
        If the file is empty, no text, or begins with numbers in place of a header.
    """
    source, raw, head = csv_source(path)
    cut = len(head) == HEAD_BYTES
    encoding = encoding_of(head, cut)
    lines = LINE_END.split(head.decode(encoding, errors="ignore"))
    if cut and len(lines) > 1:
        lines.pop()  # incomplete
    header = header_over_lines(lines)
    if cut and (header is None or len(lines) == 1):
        raise InputError(
            f"{path.name}: no line ends within the first {HEAD_BYTES} bytes; a header such as "
            "'time [s],gyro [deg/h],T [degC]' and rows of numbers were expected"
        )
    if header is None:
        raise empty_file(path.name)
    is_padded = source.wide is None and b"\0" in raw
    if any(ord(character) < 32 and character != "\t" for character in lines[header.line]) or (
        is_padded and not header.is_sure
    ):
        raise no_text(path.name)
    rows = [fields_of(line, header.separator) for line in lines[header.data :] if line.strip()]
    marks = marks_of(source, rows, header.separator)
    named = (f"{parse_header(cell)[0]} [s]" if i in seconds else cell for i, cell in enumerate(header.cells))
    cells, stamps = _clock(tuple(named), rows, marks)
    dialect = CsvDialect(
        source,
        header.separator,
        marks,
        encoding,
        header.line + 1,
        header.data,
        cells,
        stamps,
        _blanks(rows[0], len(cells)) if rows else 0,
    )
    _check_header(path.name, dialect, rows[0] if rows else [])
    unknown = set(range(len(cells))) - dialect.known - set(dialect.stamp_places)
    text = {i for i in unknown if any(i < len(row) and dialect.value(row[i]) is None for row in rows)}
    return replace(dialect, text=frozenset(text))


def decoded_head(path: Path) -> tuple[str, str, CsvSource]:
    """The first lines of a text file, each with a newline, its encoding, and where it is.

    Raises
    ------
    InputError
        If it is no text.
    """
    source, _, head = csv_source(path)
    if is_binary(head[:1000].decode("latin-1")):
        raise no_text(path.name)
    encoding = encoding_of(head, len(head) == HEAD_BYTES)
    text = LINE_END.sub("\n", head.decode(encoding, errors="replace"))
    # A line that the head cuts is left out.
    text = text if len(head) < HEAD_BYTES else text[: text.rfind("\n") + 1]
    return text, source.wide or encoding, source


def text_of(path: Path) -> str:
    """The whole text of a small file, in whatever encoding a spreadsheet program saves it.

    Raises
    ------
    InputError
        If it is no text.
    """
    *_, source = decoded_head(path)
    with source.open() as opened:
        content = opened.read()
    return content.decode(encoding_of(content, cut=False), errors="replace")


def is_sure(content: bytes) -> bool:
    """Whether a text has a header that names a time and a gyro."""
    header = header_over_lines(_head_lines(content))
    return header is not None and header.is_sure


def has_rows(content: bytes) -> bool:
    """Whether a text has two rows or more below its header."""
    lines = _head_lines(content)
    header = header_over_lines(lines)
    below = lines[header.data :] if header is not None else ()
    return header is not None and sum(bool(line.strip(f"{header.separator} ")) for line in below) > 1


def _head_lines(content: bytes) -> list[str]:
    return LINE_END.split(content[:HEAD_BYTES].decode("utf-8", errors="ignore"))


def _clock(
    cells: tuple[str, ...], rows: Sequence[Sequence[str]], marks: Marks
) -> tuple[tuple[str, ...], Stamps | None]:
    """The header cells with the clock's as ``time [s]``, and the clock where it is one of stamps."""
    stamps = _stamps(cells, rows, marks.decimal)
    if stamps is None:
        return cells, None
    place = stamps.columns[-1][0]
    before, behind = cells[:place], cells[place + 1 :]
    if (part := _fractions(rows, len(cells), place)) is None:
        name = parse_header(behind[0])[0] if behind else ""
        texts = [row[place + 1] for row in rows if len(row) >= len(cells) > place + 1]
        if (part := part_of_a_second(name, texts)) is None:
            return (*before, "time [s]", *behind), stamps
        behind = behind[1:]
    first, digits = part
    columns = (*stamps.columns, (place + 1, StampForm(FRACTION, part_digits=digits)))
    with_parts = replace(stamps, columns=columns, first_ns=stamps.first_ns + first)
    return (*before, "time of day", "time [s]", *behind), with_parts


def _fractions(rows: Sequence[Sequence[str]], width: int, place: int) -> tuple[int, int] | None:
    """As `part_of_a_second`, where the comma before a part separates fields too."""
    full = [row for row in rows if len(row) >= width]
    behind = [row[place + 1].strip() for row in full if len(row) > width]
    sizes = {len(field) if field.isdecimal() else 0 for field in behind}
    if len(behind) < len(full) or len(sizes) != 1 or not 0 < (size := sizes.pop()) <= 9:
        return None
    if not all(re.search(r":\d\d\Z", row[place].strip()) for row in full):
        return None
    return int(behind[0]) * 10 ** (9 - size), 0


def _stamps(cells: Sequence[str], rows: Sequence[Sequence[str]], decimal: str) -> Stamps | None:
    """The clock of dates and times of day in the first rows, in one column or two."""
    names = [parse_header(cell)[0] for cell in cells]
    dates = [i for i, name in enumerate(names) if name.lower() in DATE_NAMES]
    times = [i for i, name in enumerate(names) if name == "time"]
    places = times or dates
    full = [row for row in rows if len(row) >= len(cells)]
    if len(places) != 1 or not full or number(full[0][places[0]], decimal) is not None:
        return None
    texts = {i: [row[i] for row in full] for i in {*places, *dates}}
    if times and len(dates) == 1:
        both = stamps_of([(dates[0], texts[dates[0]]), (times[0], texts[times[0]])])
        if both and [form.kind for _, form in both.columns] == ["date", "time"]:
            return both
    return stamps_of([(places[0], texts[places[0]])])


def _blanks(row: Sequence[str], width: int) -> int:
    beyond = row[width:]
    return 0 if any(field.strip() for field in beyond) else len(beyond)


def _check_header(file: str, dialect: CsvDialect, row: Sequence[str]) -> None:
    """Refuse a file without a header, or whose fields blanks separate; `row` is its first one of data."""
    between = [number(field, dialect.marks.decimal) is not None for field in " ".join(row).split()]
    if len(dialect.cells) == len(row) == 1 < len(between) and all(between):
        raise InputError(
            f"{file}: blanks between its fields, where commas, semicolons or tabs were expected; "
            f"'fogml import {printable(file)} --draft -o profile.yaml' writes a profile that reads them"
        )
    numbers = sum(number(cell, mark) is not None for cell in dialect.cells for mark in (".", ","))
    if not dialect.cells or numbers >= len(dialect.cells) / 2:
        found = "holds numbers" if dialect.cells else "names no columns"
        raise InputError(
            f"{file}, line {dialect.header_line}: no header, the first line {found}; "
            "write a header such as 'time [s],gyro [deg/h],T [degC]', or correct the profile that "
            f"'fogml import {printable(file)} --draft -o profile.yaml' writes"
        )
