"""The end of a CSV file: lines after the data, and whether a recording was cut off within its last number."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from fogml.errors import InputError, counted, quoted
from fogml.runs.csv_dialect import CsvDialect
from fogml.runs.csv_header import fields_of
from fogml.runs.csv_numbers import number
from fogml.runs.csv_source import CsvSource
from fogml.runs.findings import Finding

_TAIL_BYTES = 1 << 15
_LEAST_LINES = 20
_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+\Z")


def without_footer(dialect: CsvDialect) -> tuple[CsvDialect, list[Finding]]:
    """The dialect for reading a file's table alone, and a note of the lines of text below it, if any.

    Such a line has neither a time nor a gyro's number in their places, or words in that of the time.
    """
    text = dialect.source.tail(_TAIL_BYTES).decode(dialect.encoding, errors="replace")
    lines = _LINE.findall(text)[1:]  # the first of them may be a part of one
    places = [i for i in dialect.known if dialect.name(i) == "time" or dialect.name(i).startswith("gyro")]
    forms = dict(dialect.stamps.columns) if dialect.stamps else {}
    clock = {*forms, *(i for i in places if dialect.name(i) == "time")}

    def is_value(field: str) -> bool:
        return dialect.value(field) is not None

    def is_sample(line: str) -> bool:
        fields = fields_of(line, dialect.separator)
        held = {i: fields[i] for i in {*places, *forms} if i < len(fields) and fields[i].strip()}
        found = {i: forms[i].matches(f) if i in forms else is_value(f) for i, f in held.items()}
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

    Parameters
    ----------
    source
        The file.
    separator
        Between fields; None for blanks.
    decimal
        Decimal mark.

    Notes
    -----
    It has no end, and its last number has fewer decimals (or, for whole numbers, fewer digits)
    than that of every one of at least 20 lines before it: what wrote these was stopped there.
    """
    tail = source.tail(_TAIL_BYTES)
    if tail.endswith((b"\r", b"\n")):
        return None
    # The first line of the tail may be a part of one.
    lines = [line for line in re.split(r"[\r\n]+", tail.decode("latin-1"))[1:] if line.strip()]
    fields = [line.rsplit(separator, 1)[-1].strip(' "') for line in lines]
    if len(fields) <= _LEAST_LINES or any(number(field, decimal) is None for field in fields):
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
