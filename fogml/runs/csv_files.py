"""CSV files by column with a fast parser; line by line where that one stumbles.

Quotation marks of a CSV file: whether the fast parser and the exact one read them alike.

A mark that is not closed makes a parser take the lines below it for one text; Arrow then leaves them out
without a word, and joins what stands before and after a closing mark to one number.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrow_arrays import takes_threads, values_of
from fogml.runs.csv_dialect import CsvDialect, csv_dialect
from fogml.runs.csv_lines import LineReader, cut_error, cut_line, line_of_row, note_of_end, without_footer
from fogml.runs.csv_source import MISSING
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, no_samples, text_column, unreadable
from fogml.runs.stamps import StampClock

if TYPE_CHECKING:
    from pyarrow import RecordBatch, Table


_MARK, _NEWLINE, _RETURN = b'"\n\r'
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def quotes_are_plain(lines: memoryview, separator: str) -> bool:
    """Whether every quoted field of whole lines is closed on its line and between separators (RFC 4180).

    The lines are a view from the beginning of their buffer on.
    """
    # Nothing else finds a byte as quickly as the buffer's own search; often marks are in the header alone.
    last = lines.obj.rfind(b'"', 0, len(lines))  # type: ignore[attr-defined]
    if last < 0:
        return True
    # A byte before and after every mark.
    text = b"\n" + bytes(lines[: last + 2]).removeprefix(_BYTE_ORDER_MARK) + b"\n"
    content = np.frombuffer(text, dtype=np.uint8)
    marks = np.flatnonzero(content == _MARK)
    if len(marks) % 2:
        return False
    opening, closing = marks[::2], marks[1::2]
    line_ends = np.flatnonzero((content == _NEWLINE) | (content == _RETURN))
    if not np.array_equal(np.searchsorted(line_ends, opening), np.searchsorted(line_ends, closing)):
        return False
    # Two marks within a quoted field stand for one.
    beside = np.array([ord(separator), _NEWLINE, _RETURN, _MARK], dtype=np.uint8)
    return bool(np.isin(content[opening - 1], beside).all() and np.isin(content[closing + 1], beside).all())


_NO_BLANK = re.compile(rb"\S")


def read_csv(path: Path, *, repair: bool, seconds: Collection[int] = ()) -> RawTable:
    """The table of a CSV file.

    With `repair`, rows that can't be read are dropped and counted. `seconds` as in `csv_dialect`.
    """
    import pyarrow as arrow

    dialect, notes = without_footer(csv_dialect(path, seconds))
    try:
        batches = list(_batches(dialect))
        if not any(batch.num_rows for batch in batches):
            raise no_samples(path.name)
        table = arrow.Table.from_batches(batches)
        clock = StampClock(dialect.stamps, path.name) if dialect.stamps else None
        whole = _raw(path, dialect, table, 0, clock)
    except OSError as error:
        raise unreadable(path, error) from None
    except arrow.ArrowException:
        # Arrow is fast and strict; line by line tells where the fault is, or forgives it.
        whole = LineReader(path, dialect, repair).whole()
    cut = cut_line(dialect.source, dialect.separator, dialect.marks.decimal)
    whole = whole.noting([*_doubts(dialect), *notes])
    if cut is None:
        return whole.noting([] if notes else note_of_end(dialect.source))
    if not repair:
        raise cut_error(path, cut)
    message = f"the last row, cut off in the middle of a number, dropped: {whole.row_name(len(whole) - 1)}"
    note = Finding("repaired_rows", message, row=len(whole))
    columns = {cell: values[: max(len(whole) - 1, 1)] for cell, values in whole.columns.items()}
    return replace(whole, columns=columns).noting([note])


def csv_blocks(
    path: Path, rows: int, columns: Collection[str] | None = None, seconds: Collection[int] = ()
) -> Iterator[RawTable]:
    """The table of a CSV file in blocks of rows; no repair.

    Only time, gyro and `columns` are read where these are given. `seconds` as in `csv_dialect`.
    """
    import pyarrow as arrow

    dialect, notes = without_footer(csv_dialect(path, seconds).only(columns))
    notes = [*_doubts(dialect), *(notes or note_of_end(dialect.source))]
    if (cut := cut_line(dialect.source, dialect.separator, dialect.marks.decimal)) is not None:
        raise cut_error(path, cut)
    start = 0
    clock = StampClock(dialect.stamps, path.name) if dialect.stamps else None
    told = copy(clock)
    try:
        for table in _regrouped(_batches(dialect), rows):
            raw = _raw(path, dialect, table, start, clock)
            start += table.num_rows
            told = copy(clock)
            yield raw if start > table.num_rows else raw.noting(notes)
    except OSError as error:
        raise unreadable(path, error) from None
    except arrow.ArrowException:
        lines = LineReader(path, dialect)
        for raw in lines.tables(rows, skip=start, clock=told):
            yield raw.noting([*lines.findings(), *(notes if start == 0 else [])])
            start += len(raw)
    if start == 0:
        raise no_samples(path.name)


def _doubts(dialect: CsvDialect) -> list[Finding]:
    """What is to be said of the marks in a file's numbers."""
    doubt = dialect.marks.doubt
    return [Finding("marks_of_thousands", doubt)] if doubt else []


def _for_line_by_line(reason: str) -> Exception:
    """Leaves a file to the exact reader, which tells where the fault is or reads it after all."""
    import pyarrow as arrow

    error: Exception = arrow.ArrowInvalid(reason)
    return error


def _batches(dialect: CsvDialect) -> Iterator[RecordBatch]:
    """A table by parts of whole lines, each parsed on all cores: Arrow's reader of streams has one."""
    import pyarrow as arrow
    from pyarrow import csv as arrow_csv

    source, skipped = dialect.source, dialect.skipped_lines
    for part in source.whole_lines():
        if not quotes_are_plain(part, dialect.separator):
            raise _for_line_by_line("quotation marks that the fast parser reads otherwise")
        if _NO_BLANK.search(part):
            options = _options(dialect, skipped)
            options["read_options"].use_threads = takes_threads(part)
            yield from arrow_csv.read_csv(arrow.BufferReader(part), **options).to_batches()
            skipped = 0


def _regrouped(batches: Iterable[RecordBatch], rows: int) -> Iterator[Table]:
    """Batches put together to tables of `rows` rows, the last one shorter."""
    import pyarrow as arrow

    held: list[RecordBatch] = []
    count = 0
    for batch in batches:
        held.append(batch)
        count += batch.num_rows
        if count >= rows:
            table = arrow.Table.from_batches(held)
            for start in range(0, count - rows + 1, rows):
                yield table.slice(start, rows)
            held = table.slice(count - count % rows).to_batches()
            count %= rows
    if count:
        yield arrow.Table.from_batches(held)


def _options(dialect: CsvDialect, skipped: int) -> dict[str, Any]:
    import pyarrow as arrow
    from pyarrow import csv as arrow_csv

    width = len(dialect.cells)
    names = [str(i) for i in range(width + dialect.blanks)]
    kinds = {str(i): arrow.float64() for i in dialect.read}
    kinds |= {str(i): arrow.string() for i in dialect.stamp_places}
    # Anything in the empty fields at a line's end is a fault, which no column takes.
    blanks = dict.fromkeys(names[width:], arrow.null())
    spellings = {spelling for word in MISSING for spelling in (word, word.upper(), word.capitalize())}
    return {
        # Bytes of other encodings stand in text only, which is not read.
        "read_options": arrow_csv.ReadOptions(skip_rows=skipped, column_names=names),
        "parse_options": arrow_csv.ParseOptions(delimiter=dialect.separator),
        "convert_options": arrow_csv.ConvertOptions(
            check_utf8=False,
            column_types={**kinds, **blanks},
            include_columns=[*kinds, *blanks],
            decimal_point=dialect.marks.decimal,
            null_values=[*spellings, "NaN", "-NaN"],
        ),
    }


def _raw(path: Path, dialect: CsvDialect, table: Table, start: int, clock: StampClock | None) -> RawTable:
    columns = {dialect.cells[i]: values_of(table.column(str(i))) for i in dialect.read}
    if clock is not None:
        texts = [table.column(str(i)).combine_chunks() for i in dialect.stamp_places]
        columns[dialect.time_cell] = clock.seconds(texts)
        if np.isnan(columns[dialect.time_cell]).any():
            raise _for_line_by_line("a time that is no stamp of the first one's form")
    return RawTable(
        path.name,
        dialect.cells,
        columns,
        row_name=lambda i: f"line {line_of_row(dialect, start + i)}",
        findings=tuple(text_column(dialect.name(i)) for i in sorted(dialect.text)),
        started=dialect.stamps.started if dialect.stamps else None,
    )
