"""CSV files: separator, decimal mark and encoding told from the file; exact places of faults."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.errors import InputError
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.findings import Finding
from fogml.runs.raw_table import RawTable, text_column

if TYPE_CHECKING:
    from pyarrow import RecordBatch, Table

SEPARATORS = (",", ";", "\t")
_HEAD_BYTES = 1 << 16
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*\Z")
_MISSING = {"", "nan", "na", "n/a", "null", "-nan", "#n/a", "none"}


@dataclass(frozen=True)
class CsvDialect:
    """How a CSV file is written; `header_line` counts from 1."""

    separator: str
    decimal: str
    encoding: str
    header_line: int
    cells: tuple[str, ...]


def csv_dialect(path: Path) -> CsvDialect:
    """Tell the dialect from a file's first lines.

    Raises
    ------
    InputError
        If the file is empty, no text, or holds a header only.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if not head.strip():
        raise InputError(f"{path.name}: the file is empty; a header and samples were expected")
    # UTF-16, which spreadsheets call "Unicode text", is full of zero bytes too.
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError(f"{path.name}: the text is UTF-16; save it as CSV in UTF-8")
    if b"\x00" in head:
        raise InputError(
            f"{path.name}: not a text file (it holds zero bytes); CSV was expected from its name"
        )
    encoding = _encoding(head, len(head) == _HEAD_BYTES)
    lines = head.decode(encoding, errors="ignore").splitlines()
    first = next(i for i, line in enumerate(lines) if line.strip())
    separator = max(SEPARATORS, key=lambda s: _outside_quotes(lines[first]).count(s))
    cells = tuple(cell.strip() for cell in next(csv.reader([lines[first]], delimiter=separator)))
    while cells and not cells[-1]:
        cells = cells[:-1]
    decimal = "."
    following = next((line for line in lines[first + 1 :] if line.strip()), None)
    if following is not None and separator != ",":
        fields = next(csv.reader([following], delimiter=separator))
        decimal = "," if any(_DECIMAL_COMMA.match(field) for field in fields) else "."
    return CsvDialect(separator, decimal, encoding, first + 1, cells)


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


def read_csv(path: Path, *, repair: bool) -> RawTable:
    """The table of a CSV file.

    With `repair`, rows that can't be read are dropped and counted.

    Raises
    ------
    InputError
        Naming line and column of the first fault.
    """
    import pyarrow as arrow
    from pyarrow import csv as arrow_csv

    dialect = csv_dialect(path)
    _check_header(path.name, dialect)
    try:
        table = arrow_csv.read_csv(path, **_options(dialect))
    except arrow.ArrowInvalid:
        # Arrow is fast and strict; the slow way tells where the fault is, or forgives it.
        return _read_slowly(path, dialect, repair)
    if table.num_rows == 0:
        raise InputError(f"{path.name}: a header and no samples; rows of numbers were expected below it")
    return _raw(path.name, dialect, table, 0)


def csv_blocks(path: Path, rows: int) -> Iterator[RawTable]:
    """The table of a CSV file in blocks of rows; no repair.

    Raises
    ------
    InputError
        Naming line and column of the first fault.
    """
    import pyarrow as arrow
    from pyarrow import csv as arrow_csv

    dialect = csv_dialect(path)
    _check_header(path.name, dialect)
    start = 0
    try:
        with arrow_csv.open_csv(path, **_options(dialect, block_bytes=1 << 24)) as reader:
            for table in _regrouped(reader, rows):
                yield _raw(path.name, dialect, table, start)
                start += table.num_rows
    except arrow.ArrowInvalid as error:
        _read_slowly(path, dialect, repair=False)
        raise InputError(f"{path.name}: cannot be read as CSV: {error}") from None
    if start == 0:
        raise InputError(f"{path.name}: a header and no samples; rows of numbers were expected below it")


def _regrouped(batches: Iterable[RecordBatch], rows: int) -> Iterator[Table]:
    """Batches put together to tables of `rows` rows, the last one shorter."""
    import pyarrow as arrow

    held: list[RecordBatch] = []
    for batch in batches:
        held.append(batch)
        table = arrow.Table.from_batches(held)
        while table.num_rows >= rows:
            yield table.slice(0, rows)
            table = table.slice(rows)
        held = table.to_batches()
    if sum(batch.num_rows for batch in held):
        yield arrow.Table.from_batches(held)


def _options(dialect: CsvDialect, block_bytes: int | None = None) -> dict[str, Any]:
    import pyarrow as arrow
    from pyarrow import csv as arrow_csv

    names = [str(i) for i in range(len(dialect.cells))]
    known = [n for n, cell in zip(names, dialect.cells, strict=True) if column_spec(parse_header(cell)[0])]
    missing = [spelling for word in _MISSING for spelling in {word, word.upper(), word.capitalize(), "NaN"}]
    return {
        "read_options": arrow_csv.ReadOptions(
            skip_rows=dialect.header_line,
            column_names=names,
            encoding=dialect.encoding.removesuffix("-sig"),
            block_size=block_bytes,
        ),
        "parse_options": arrow_csv.ParseOptions(delimiter=dialect.separator),
        "convert_options": arrow_csv.ConvertOptions(
            column_types=dict.fromkeys(known, arrow.float64()),
            decimal_point=dialect.decimal,
            null_values=missing,
        ),
    }


def _check_header(file: str, dialect: CsvDialect) -> None:
    numbers = sum(_is_number(cell) for cell in dialect.cells)
    if numbers and numbers >= len(dialect.cells) / 2:
        raise InputError(
            f"{file}, line {dialect.header_line}: no header, the first line holds numbers; "
            "write a header such as 'time [s],gyro [deg/h],T [degC]'"
        )


def _raw(file: str, dialect: CsvDialect, table: Table, start: int) -> RawTable:
    import pyarrow.types as types

    columns, findings = {}, []
    for cell, values in zip(dialect.cells, table.columns, strict=True):
        kind = values.type
        if not (types.is_floating(kind) or types.is_integer(kind) or types.is_null(kind)):
            findings.append(text_column(parse_header(cell)[0]))
            continue
        columns[cell] = values.to_numpy().astype(np.float64, copy=False)
    first = dialect.header_line + 1 + start
    return RawTable(
        file, dialect.cells, columns, row_name=lambda i: f"line {first + i}", findings=tuple(findings)
    )


@dataclass(frozen=True)
class _Fault:
    line: int
    message: str


def _read_slowly(path: Path, dialect: CsvDialect, repair: bool) -> RawTable:
    """Line by line, for files with faults: names the first one, or drops the bad rows."""
    rows, lines, faults = [], [], []
    text = _text_columns(path, dialect)
    for line, fields in _records(path, dialect):
        values, fault = _values(fields, line, dialect, text)
        if fault is None:
            rows.append(values)
            lines.append(line)
        elif not repair:
            raise InputError(f"{path.name}, {fault.message}; correct the line, or --repair drops such rows")
        else:
            faults.append(fault)
    if not rows:
        if faults:
            raise InputError(f"{path.name}, {faults[0].message}; no row of the file can be read")
        raise InputError(f"{path.name}: a header and no samples; rows of numbers were expected below it")
    findings = [text_column(parse_header(dialect.cells[i])[0]) for i in sorted(text)]
    if faults:
        message = f"{len(faults)} rows that can't be read dropped, the first: {faults[0].message}"
        findings.append(Finding("repaired_rows", message, row=faults[0].line, count=len(faults)))
    table = np.array(rows, dtype=np.float64)
    columns = {
        cell: np.ascontiguousarray(table[:, i]) for i, cell in enumerate(dialect.cells) if i not in text
    }
    return RawTable(
        path.name, dialect.cells, columns, row_name=lambda i: f"line {lines[i]}", findings=tuple(findings)
    )


def _records(path: Path, dialect: CsvDialect) -> Iterator[tuple[int, list[str]]]:
    with path.open("r", encoding=dialect.encoding, errors="replace", newline="") as file:
        for _ in range(dialect.header_line):
            file.readline()
        reader = csv.reader(_without_zero_bytes(file), delimiter=dialect.separator)
        try:
            for fields in reader:
                if fields and any(field.strip() for field in fields):
                    yield dialect.header_line + reader.line_num, fields
        except csv.Error as error:
            line = dialect.header_line + reader.line_num
            raise InputError(f"{path.name}, line {line}: not readable as CSV ({error})") from None


def _without_zero_bytes(file: io.TextIOBase | Any) -> Iterator[str]:
    return (line.replace("\x00", "\ufffd") for line in file)


def _text_columns(path: Path, dialect: CsvDialect) -> set[int]:
    """Columns unknown to the run format that hold text in the first rows."""
    unknown = {i for i, cell in enumerate(dialect.cells) if column_spec(parse_header(cell)[0]) is None}
    text: set[int] = set()
    for count, (_, fields) in enumerate(_records(path, dialect)):
        if count >= 1000 or not unknown:
            break
        text |= {i for i in unknown if i < len(fields) and _number(fields[i], dialect.decimal) is None}
    return text


def _values(
    fields: Sequence[str], line: int, dialect: CsvDialect, text: set[int]
) -> tuple[list[float], _Fault | None]:
    width = len(dialect.cells)
    trailing = [field for field in fields[width:] if field.strip()]
    if len(fields) < width or trailing:
        kind = "cut short" if len(fields) < width else "too long"
        return [], _Fault(
            line, f"line {line}: {len(fields)} fields where the header has {width} (row {kind})"
        )
    values = []
    for i, field in enumerate(fields[:width]):
        number = np.nan if i in text else _number(field, dialect.decimal)
        if number is None:
            name = parse_header(dialect.cells[i])[0]
            message = f"line {line}, column '{name}': '{field.strip()[:40]}' is not a number"
            return [], _Fault(line, message)
        values.append(number)
    return values, None


def _number(field: str, decimal: str) -> float | None:
    field = field.strip()
    if field.lower() in _MISSING:
        return np.nan
    try:
        return float(field.replace(",", ".") if decimal == "," else field)
    except ValueError:
        return None


def _is_number(cell: str) -> bool:
    return bool(cell) and _number(cell, ",") is not None
