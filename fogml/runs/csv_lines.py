"""CSV files line by line: slow and exact, to name the place of a fault or to forgive it; and their end.

At the end may be lines after the data, or a recording that was cut off within its last number.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError, counted, quoted
from fogml.runs.csv_dialect import CsvDialect
from fogml.runs.csv_header import another_header, fields_of, names_others
from fogml.runs.csv_source import CsvSource, number
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, no_samples, text_column
from fogml.runs.stamps import StampClock

_CHUNK_ROWS = 1 << 16


def line_of_row(dialect: CsvDialect, row: int) -> int:
    """Line of a data row, both counted from 1 and 0, of a file in which no field holds a line's end."""
    seen, line = -1, dialect.skipped_lines
    # Latin-1 decodes any bytes, and keeps line ends as they are.
    with io.TextIOWrapper(dialect.source.open(), encoding="latin-1", newline="") as file:
        for line, text in enumerate(file, start=1):
            if line <= dialect.skipped_lines:
                continue
            seen += text not in ("\n", "\r\n", "\r")
            if seen == row:
                break
    return line


@dataclass
class LineReader:
    """Reads a CSV file line by line.

    Attributes
    ----------
    path, dialect
        The file.
    repair
        Drop rows that can't be read, and count them, instead of raising.
    dropped
        How many rows were dropped.
    first_fault
        Data row, from 1, and message of the first of them.
    text_lines
        Position of a column unknown to the run format to the first line that holds text there.
    """

    path: Path
    dialect: CsvDialect
    repair: bool = False
    dropped: int = 0
    first_fault: tuple[int, str] | None = None
    text_lines: dict[int, int] = field(default_factory=dict)

    def tables(
        self, rows: int = _CHUNK_ROWS, skip: int = 0, clock: StampClock | None = None
    ) -> Iterator[RawTable]:
        """Tables of at most `rows` rows, after so many data rows that are skipped, which `clock` has seen."""
        values: list[list[float]] = []
        stamps: list[list[str]] = []
        lines: list[int] = []
        if clock is None and self.dialect.stamps:
            clock = StampClock(self.dialect.stamps, self.path.name)
        for row, (line, fields) in enumerate(self._records()):
            if row < skip:
                continue
            try:
                values.append(self._values(fields, line))
                stamps.append([fields[place] for place in self.dialect.stamp_places])
            except _Fault as fault:
                if names_others(fields, self.dialect.cells):
                    raise another_header(self.path.name, line, self.dialect.separator.join(fields)) from None
                if not self.repair:
                    cure = "correct the line, or --repair drops such rows"
                    raise InputError(f"{self.path.name}, {fault}; {cure}") from None
                self.first_fault = self.first_fault or (row + 1, str(fault))
                self.dropped += 1
                continue
            lines.append(line)
            if len(values) == rows:
                yield self._table(values, lines, stamps, clock)
                values, lines, stamps = [], [], []
        if values:
            yield self._table(values, lines, stamps, clock)

    def whole(self) -> RawTable:
        """The whole table, with what was noticed."""
        tables = list(self.tables())
        if not tables:
            if self.first_fault is None:
                raise no_samples(self.path.name)
            raise InputError(f"{self.path.name}, {self.first_fault[1]}; no row of the file can be read")
        columns = {cell: np.concatenate([t.columns[cell] for t in tables]) for cell in tables[0].columns}
        names = [table.row_name for table in tables]
        lengths = np.cumsum([0, *(len(table) for table in tables)])

        def row_name(i: int) -> str:
            part = int(np.searchsorted(lengths, i, side="right")) - 1
            return names[part](int(i - lengths[part]))

        findings = [text_column(self.dialect.name(i)) for i in sorted(self.dialect.text)] + self.findings()
        return replace(tables[0], columns=columns, row_name=row_name, findings=tuple(findings))

    def findings(self) -> list[Finding]:
        """What was noticed so far: rows dropped, text in columns of numbers."""
        found = [
            Finding(
                "text_column",
                f"column {quoted(self.dialect.name(i))} holds text, first in line {line}; missing there",
                column=self.dialect.name(i),
            )
            for i, line in sorted(self.text_lines.items())
        ]
        if self.first_fault is not None:
            row, message = self.first_fault
            message = f"rows dropped that can't be read: {self.dropped}, the first: {message}"
            found.append(Finding("repaired_rows", message, row=row, count=self.dropped))
        return found

    def _table(
        self, values: list[list[float]], lines: list[int], stamps: list[list[str]], clock: StampClock | None
    ) -> RawTable:
        table = np.array(values, dtype=np.float64).reshape(len(values), -1)
        columns: dict[str, NDArray[np.float64]] = {
            self.dialect.cells[i]: np.ascontiguousarray(table[:, j]) for j, i in enumerate(self.dialect.read)
        }
        if clock is not None:
            import pyarrow as arrow

            texts = [arrow.array(column, arrow.string()) for column in zip(*stamps, strict=True)]
            columns[self.dialect.time_cell] = clock.seconds(texts)
        places = np.array(lines)
        return RawTable(
            self.path.name,
            self.dialect.cells,
            columns,
            row_name=lambda i: f"line {places[i]}",
            started=clock.stamps.started if clock is not None else None,
        )

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        """First line and fields of each record; lines of nothing but spaces are none."""
        dialect = self.dialect
        opened = dialect.source.open()
        with io.TextIOWrapper(opened, encoding=dialect.encoding, errors="replace", newline="") as file:
            for _ in range(dialect.skipped_lines):
                file.readline()
            lines = (line.replace("\x00", "\ufffd") for line in file)
            reader = csv.reader(lines, delimiter=dialect.separator, strict=True)
            begin = dialect.skipped_lines + 1
            try:
                for fields in reader:
                    if len(fields) > 1 or (fields and fields[0].strip()):
                        yield begin, fields
                    begin = dialect.skipped_lines + reader.line_num + 1
            except csv.Error as error:
                raise InputError(
                    f"{self.path.name}, line {begin}: not readable as CSV ({error}); "
                    "is a quotation mark not closed there?"
                ) from None

    def _values(self, fields: Sequence[str], line: int) -> list[float]:
        dialect = self.dialect
        width = len(dialect.cells)
        if len(fields) < width or any(text.strip() for text in fields[width:]):
            kind = "cut short" if len(fields) < width else "too long"
            is_split = dialect.separator == "," and any(text.strip().isdigit() for text in fields[width:])
            hint = "; has a column no name? Write one in the header"
            hint += "; is the comma a decimal mark too? Export it with semicolons between" if is_split else ""
            hint = "" if len(fields) < width else hint
            held = counted(len(fields), "field")
            raise _Fault(f"line {line}: {held} where the header has {width} (row {kind}){hint}")
        for place, form in dialect.stamps.columns if dialect.stamps else ():
            if not form.matches(fields[place]):
                raise _Fault(
                    f"line {line}, column {quoted(dialect.name(place))}: {quoted(fields[place].strip())} is "
                    f"no {form.kind} as in the first row"
                )
        values = []
        for i in dialect.read:
            text = fields[i]
            value = dialect.value(text)
            if value is None and i in dialect.known:
                mark = "comma" if dialect.marks.decimal == "," else "point"
                what = f"is not a number (with a decimal {mark})"
                if dialect.name(i) == "time" and ":" in text:
                    what = "is no date or time of day that is read, such as 2026-03-02T08:00:00+01:00"
                raise _Fault(f"line {line}, column {quoted(dialect.name(i))}: {quoted(text.strip())} {what}")
            if value is None:
                self.text_lines.setdefault(i, line)
                value = np.nan
            values.append(value)
        return values


class _Fault(Exception):
    """A row that can't be read."""


_TAIL_BYTES = 1 << 15
_LEAST_LINES = 20
_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+\Z")


def without_footer(dialect: CsvDialect) -> tuple[CsvDialect, list[Finding]]:
    """The dialect for reading a file's table alone, and a note of the lines of text below it, if any.

    Such a line has neither a time nor a gyro's number in their places, or words in that of the time.
    """
    text = dialect.source.tail(_TAIL_BYTES).decode(dialect.encoding, errors="surrogateescape")
    lines = _LINE.findall(text)[1:]  # the first of them may be a part of one
    places = [i for i in dialect.known if dialect.name(i) == "time" or dialect.name(i).startswith("gyro")]
    forms = dict(dialect.stamps.columns) if dialect.stamps else {}
    clock = {*forms, *(i for i in places if dialect.name(i) == "time")}

    def is_sample(line: str) -> bool:
        fields = fields_of(line, dialect.separator)
        held = {i: fields[i] for i in {*places, *forms} if i < len(fields) and fields[i].strip()}
        found = {
            i: forms[i].matches(f) if i in forms else dialect.value(f) is not None for i, f in held.items()
        }
        # Means below a column stand beside a word.
        is_told = any(not found[i] and held[i].strip(' "')[:1].isalpha() for i in clock & found.keys())
        return any(found.values()) and not is_told

    # The longest last part of the lines without a sample; its blank lines stay.
    last = next((n for n, line in enumerate(reversed(lines)) if line.strip() and is_sample(line)), None)
    below = lines[len(lines) - last :] if last else []
    told = [line.strip() for line in below if line.strip(' ",;\t\r\n')]
    # An odd mark closes a quoted field of several lines, which belongs to the sample above.
    if not below or "".join(below).count('"') % 2:
        return dialect, []
    count = counted(len(told), "line")
    message = f"{count} below the last sample left out: {quoted(told[0])}" if told else ""
    source = dialect.source.without("".join(below), dialect.encoding.removesuffix("-sig"))
    return replace(dialect, source=source), [Finding("footer", message, count=len(told))] if told else []


def note_of_end(source: CsvSource) -> list[Finding]:
    """A note where the last line has no end: a recording cut there reads as a shorter number."""
    if source.tail(1) in (b"\r", b"\n"):
        return []
    message = "the last line has no line end; if the recording was cut there, its last value may be cut too"
    return [Finding("unfinished_line", message)]


def cut_line(source: CsvSource, separator: str | None, decimal: str) -> str | None:
    """The last line where it is evidently cut within its last number, else None.

    It has no end, and its last number has fewer decimals (or, for whole numbers, fewer digits)
    than that of every one of at least 20 lines before it: what wrote these was stopped there.
    No separator stands for blanks.
    """
    tail = source.tail(_TAIL_BYTES)
    if tail.endswith((b"\r", b"\n")):
        return None
    # The first line of the tail may be a part of one.
    lines = [line for line in re.split(r"[\r\n]+", tail.decode("latin-1"))[1:] if line.strip()]
    widths = {len(fields_of(line, separator)) for line in lines[-2:]}
    fields = [line.rsplit(separator, 1)[-1].strip(' "') for line in lines]
    # A row that ends before its last field is one cut short, whatever it ends with.
    if len(fields) <= _LEAST_LINES or len(widths) > 1:
        return None
    if any(number(field, decimal) is None for field in fields):
        return None
    sizes = [_digits(field, decimal) for field in fields]
    (whole, decimals), before = sizes[-1], sizes[:-1]
    least = min(size[1] for size in before)
    is_cut = decimals < least if least else whole < min(size[0] for size in before)
    return lines[-1] if is_cut else None


def cut_error(path: Path, line: str, cure: str = "--repair drops the row") -> InputError:
    """What to say of a file that ends with such a line, and what else than a new copy helps."""
    shown = quoted(line.strip())
    return InputError(
        f"{path.name}, last line: the file ends in the middle of a number, {shown}; "
        f"copy or export it again, or {cure}"
    )


def _digits(field: str, decimal: str) -> tuple[int, int]:
    """Digits before and after the decimal mark."""
    whole, _, after = re.split("[eE]", field)[0].lstrip("+-").partition(decimal)
    return len(whole), len(after)
