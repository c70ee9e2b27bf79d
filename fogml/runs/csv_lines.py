"""CSV files line by line: slow and exact, to name the place of a fault or to forgive it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError, counted, quoted
from fogml.runs.csv_dialect import CsvDialect
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, no_samples, text_column
from fogml.runs.stamps import StampClock

_CHUNK_ROWS = 1 << 16


def line_of_row(dialect: CsvDialect, row: int) -> int:
    """Line of a data row, both counted from 1 and 0; blank lines and quoted line ends count as they do."""
    seen, quoted, line = -1, False, dialect.skipped_lines
    # Latin-1 decodes any bytes, and keeps line ends and quotation marks as they are.
    with io.TextIOWrapper(dialect.source.open(), encoding="latin-1", newline="") as file:
        for line, text in enumerate(file, start=1):
            if line <= dialect.skipped_lines:
                continue
            seen += not quoted and text not in ("\n", "\r\n", "\r")
            if seen == row:
                break
            quoted ^= text.count('"') % 2 == 1
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

    def tables(self, rows: int = _CHUNK_ROWS, skip: int = 0) -> Iterator[RawTable]:
        """Tables of at most `rows` rows, after so many data rows that are skipped."""
        values: list[list[float]] = []
        stamps: list[list[str]] = []
        lines: list[int] = []
        clock = StampClock(self.dialect.stamps, self.path.name) if self.dialect.stamps else None
        for row, (line, fields) in enumerate(self._records()):
            if row < skip:
                continue
            try:
                values.append(self._values(fields, line))
                stamps.append([fields[place] for place in self.dialect.stamp_places])
            except _Fault as fault:
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
            reader = csv.reader(_without_zero_bytes(file), delimiter=dialect.separator, strict=True)
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
            hint = "; is the comma a decimal mark too? Export it with semicolons between" if is_split else ""
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
                mark = "comma" if dialect.decimal == "," else "point"
                raise _Fault(
                    f"line {line}, column {quoted(dialect.name(i))}: {quoted(text.strip())} is not a number "
                    f"(with a decimal {mark})"
                )
            if value is None:
                self.text_lines.setdefault(i, line)
                value = np.nan
            values.append(value)
        return values


class _Fault(Exception):
    """A row that can't be read."""


def _without_zero_bytes(file: Any) -> Iterator[str]:
    return (line.replace("\x00", "\ufffd") for line in file)
