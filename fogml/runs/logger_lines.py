"""The lines of a logger's text file, read in parts, found and chosen in one piece, and their fields."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray, IndexArray
from fogml.arrow_arrays import takes_threads, values_of
from fogml.errors import InputError, counted, quoted
from fogml.runs.csv_source import CsvSource, is_binary
from fogml.runs.profile_parts import TextLayout
from fogml.runs.raw_table import empty_file, no_text, unreadable
from fogml.runs.stamp_forms import stamp_form

PART_BYTES = 1 << 23
"""Bytes of a text that are looked into at once; a part takes some ten times as much memory."""


def text_parts(path: Path, encoding: str, part_bytes: int) -> Iterator[tuple[bytes, bool]]:
    """Parts of a text, and whether each is the last one."""
    ready = begun = b""
    only_returns = None
    try:
        with CsvSource(path, encoding, is_strict=True).open() as file:
            while content := file.read(part_bytes):
                if only_returns is None:
                    if is_binary(content[:4096].decode(errors="ignore")):
                        raise no_text(path.name)
                    only_returns = b"\r" in content and b"\n" not in content
                content = content.replace(b"\r", b"\n") if only_returns else content
                content = begun + content.replace(b"\0", b" ")
                end = content.rfind(b"\n") + 1
                if end and ready.strip():
                    yield ready, False
                    ready = b""
                ready, begun = ready + content[:end], content[end:]
    except OSError as error:
        raise unreadable(path, error) from None
    except UnicodeError as error:
        place = f"byte {error.start}" if isinstance(error, UnicodeDecodeError) else "it"
        raise InputError(
            f"{path.name}: {place} is no {encoding} text; "
            "give the file's encoding in the profile (key 'encoding')"
        ) from None
    ready += begun
    if not ready.strip():
        raise empty_file(path.name)
    yield ready, True


_LINE_STAMP = r"(?m)^[\[(<]?((?:[\d/.\-]+[ T])?\d{1,2}:\d\d:\d\d(?:[.:]\d+)?)"
_AFTER_STAMP = re.compile(
    _LINE_STAMP + r"(\] ?|(?: \[?[RT]X\]?)?(?: ?->?|:) | \[[RT]X\] | (?![A-Z]{2,4}[,;])(?=[^ ]*[,;]))"
)
"""No sign is part of it: a blank or a bracket ends it, and no zone's name is a device's text."""


_FRAME = re.compile(rb"\$([^$*\n]*)\*([0-9A-Fa-f]{2})[ \t\r]*\Z")
"""A frame of text with its sum, as NMEA 0183 has them: ``$PGYRO,1,9.6*5B``."""


def is_frame(line: str) -> bool:
    """Whether a line ends as a frame of NMEA 0183 does: a ``$``, what is told, a ``*`` and its sum."""
    return "$" in line and frames_checked(line.encode()) != b"*"


def frames_checked(content: bytes) -> bytes:
    """Lines with a ``$`` without the sum at their end; those whose sum is wrong or lost as ``*`` alone.

    It is the exclusive or of all bytes between ``$`` and ``*`` (NMEA 0183).
    """
    sums = np.bitwise_xor.accumulate(np.frombuffer(content, dtype=np.uint8))

    def checked(line: re.Match[bytes]) -> bytes:
        found = _FRAME.search(line[0])
        if found is None:
            return b"*"
        before, last = (line.start() + place - 1 for place in found.span(1))
        return line[0][: found.end(1)] if sums[before] ^ sums[last] == int(found[2], 16) else b"*"

    return re.sub(rb"(?m)^.*\$.*$", checked, content)


def plain_lines(content: bytes, stamp: str | None, separator: str | None, has_sums: bool) -> bytes:
    """Lines with their stamps, which end before the mark `stamp`, as fields of their own, sums checked."""
    if stamp is not None:
        form, apart = _LINE_STAMP + re.escape(stamp), separator or "\t"
        content = re.sub(form, lambda found: found[1] + apart, content.decode()).encode()
    return frames_checked(content) if has_sums else content


def mark_of_line_stamps(lines: Sequence[str]) -> str | None:
    """What stands between a stamp and the rest of most lines, where a terminal program wrote them."""
    # A first cell that is a date as a whole, with AM or a zone after it, has no text of a device in it.
    logged = [line for line in lines if stamp_form([re.split("[,;\t]", line)[0].strip(' "')]) is None]
    marks = Counter(found[2] for line in logged if (found := _AFTER_STAMP.match(line)))
    mark, count = max(marks.items(), key=lambda one: one[1], default=("", 0))
    return mark if 2 * count > len(lines) else None


_NEWLINE, _RETURN, _BLANK, _TAB, _STRAY = 10, 13, 32, 9, 31


@dataclass(frozen=True)
class Lines:
    """The bytes of a file and where its lines are."""

    text: NDArray[np.uint8]
    starts: IndexArray
    ends: IndexArray  # without the line's end mark

    @classmethod
    def of(cls, content: bytes) -> Lines:
        text = np.frombuffer(content, dtype=np.uint8)
        breaks = np.flatnonzero(text == _NEWLINE)
        starts = np.concatenate([[0], breaks + 1])
        ends = np.concatenate([breaks, [len(text)]])
        if starts[-1] == len(text):
            starts, ends = starts[:-1], ends[:-1]
        returns = (ends > starts) & (text[np.maximum(ends - 1, 0)] == _RETURN)
        ends = ends - returns
        # A carriage return within a line is no line's end: it is a fault of the field that it stands in.
        stray = text == _RETURN
        stray[ends[returns]] = False
        return cls(np.where(stray, _STRAY, text).astype(np.uint8), starts, ends)

    def line(self, number: int) -> str:
        return self.text[self.starts[number] : self.ends[number]].tobytes().decode()

    def first_bytes(self) -> NDArray[np.uint8]:
        """The first byte of each line that is no blank or tab; 0 for a blank line."""
        visible = np.flatnonzero((self.text != _BLANK) & (self.text != _TAB))
        if len(visible) == 0:
            return np.zeros(len(self.starts), dtype=np.uint8)
        at = np.searchsorted(visible, self.starts)
        place = visible[np.minimum(at, len(visible) - 1)]
        return np.where((at < len(visible)) & (place < self.ends), self.text[place], 0).astype(np.uint8)

    def field_counts(self, separator: str | None) -> IndexArray:
        """Fields of each line, shape (lines,)."""
        if separator is not None:
            marks = np.flatnonzero(self.text == ord(separator))
            return np.searchsorted(marks, self.ends) - np.searchsorted(marks, self.starts) + 1
        visible = (self.text != _BLANK) & (self.text != _TAB) & (self.text != _RETURN)
        visible &= self.text != _NEWLINE
        before = np.concatenate([[False], visible[:-1]])
        field_starts = np.flatnonzero(visible & ~before)
        return np.searchsorted(field_starts, self.ends) - np.searchsorted(field_starts, self.starts)

    def keep(self, numbers: IndexArray) -> bytes:
        """The chosen lines, in order, each closed by a newline."""
        spans = np.zeros(len(self.text) + 1, dtype=np.int8)
        spans[self.starts[numbers]] += 1
        spans[np.minimum(self.ends[numbers] + 1, len(self.text))] -= 1
        inside = np.cumsum(spans[:-1], dtype=np.int8) > 0
        chosen = self.text[inside]
        # The end mark of a line may be a carriage return and a newline: the return stays as the mark.
        return np.where(chosen == _RETURN, _NEWLINE, chosen).astype(np.uint8).tobytes()


def single_blanks(content: bytes) -> bytes:
    """The lines with every run of blanks and tabs between fields made one blank."""
    text = np.frombuffer(content, dtype=np.uint8)
    blank = (text == _BLANK) | (text == _TAB)
    places = np.flatnonzero(~blank)
    kept = text[places]
    # A blank stays where something was left out between two characters of the same line.
    gap = (np.diff(places) > 1) & (kept[:-1] != _NEWLINE) & (kept[1:] != _NEWLINE)
    return np.insert(kept, np.flatnonzero(gap) + 1, _BLANK).tobytes()


HIDDEN = "\x1a"
"""Stands for a separator within quotation marks while a line's fields are told apart."""
_QUOTED = re.compile(rb'"[^"\n]*"')


def hide_quoted(content: bytes, separator: str | None) -> bytes:
    """Lines whose separators within quotation marks are hidden, where one character separates."""
    if separator is None or b'"' not in content:
        return content
    mark = separator.encode()
    return _QUOTED.sub(lambda found: found[0].replace(mark, HIDDEN.encode()), content)


class FaultyFields(InputError):
    """Rows of a column hold no number or no date.

    Attributes
    ----------
    column
        The column's source.
    filled, rows
        How many rows hold one, of how many.
    """

    def __init__(self, place: str, column: str, what: str, count: int, rows: int, hint: str) -> None:
        super().__init__(
            f"{place}, column {quoted(column)}: {what} ({counted(count, 'such row')}); correct it, or leave "
            f"such rows out by 'reject: {{not_numbers: true}}' in the profile; {hint}"
        )
        self.column, self.filled, self.rows = column, rows - count, rows


_HEXADECIMAL = re.compile(r"(0[xX])?(?=.*[A-Fa-f])(?=.*\d)[0-9A-Fa-f]{2,16}")


def hex_numbers(texts: NDArray[np.str_], bits: int) -> FloatArray:
    """Numbers in hexadecimal of so many bits, two's complement, shape (n,); NaN where there is none."""
    form = re.compile(r"(0[xX])?[0-9A-Fa-f]{1,16}")
    values = [int(text, 16) if form.fullmatch(text) else -1 for text in texts.tolist()]
    half = 1 << (bits - 1)
    return np.array([v - 2 * half * (v >= half) if 0 <= v < 2 * half else np.nan for v in values])


def cell_words(cell: str, first: str, is_time: bool) -> str:
    """What is wrong with a field's text; of dates with that of the first row, else an empty one."""
    if first:
        return f"{quoted(cell)} is no date and time as in the first row, {quoted(first)}"
    if is_time and stamp_form([cell]) is not None:
        return f"{quoted(cell)} is a date or time of day, which 'unit: stamp' reads"
    if _HEXADECIMAL.fullmatch(cell):
        return f"{quoted(cell)} is no number; where it is hexadecimal, 'hex_bits: 16' in the column says so"
    return f"{quoted(cell)} is no number" if cell else "empty, a number was expected"


def shown(text: str, separator: str | None) -> str:
    """A text of hidden separators as it stands in the file."""
    return text if separator is None else text.replace(HIDDEN, separator)


def field_texts(content: bytes, profile: TextLayout, fields: int, position: int) -> NDArray[np.str_]:
    """A source column as texts without blanks and quotation marks about them, shape (rows,)."""
    import pyarrow as pa

    (column,) = _fields(content, profile, fields, [position], pa.string(), []).columns
    texts = np.char.strip(np.array(column.to_pylist(), dtype=np.str_), ' \t"')
    mark = profile.text_separator
    return texts if mark is None or b'"' not in content else np.char.replace(texts, HIDDEN, mark)


def _fields(
    content: bytes, profile: TextLayout, fields: int, positions: list[int], kind: Any, nulls: list[str] | None
) -> Any:
    """Fields by position, as Arrow reads them."""
    import pyarrow as pa
    from pyarrow import csv

    separator = profile.text_separator
    if separator is None:
        content, separator = single_blanks(content), " "
    names = [str(position) for position in range(fields)]
    wanted = [names[position] for position in positions]
    return csv.read_csv(
        pa.BufferReader(content),
        csv.ReadOptions(column_names=names, use_threads=takes_threads(content)),
        # A mark that is not closed must not swallow the lines below it.
        csv.ParseOptions(delimiter=separator, quote_char=False, ignore_empty_lines=False),
        csv.ConvertOptions(
            column_types=dict.fromkeys(wanted, kind),
            include_columns=sorted(set(wanted)),
            decimal_point=profile.decimal,
            null_values=nulls,
            strings_can_be_null=nulls is not None,
        ),
    )


def field_numbers(content: bytes, profile: TextLayout, fields: int, positions: list[int]) -> FloatArray:
    """The source columns as numbers, shape (columns, rows); NaN where there is none."""
    import pyarrow as pa

    if not positions:
        return np.empty((0, content.count(b"\n")))
    wanted = [str(position) for position in positions]
    try:
        columns = _fields(content, profile, fields, positions, pa.float64(), None)
    except pa.ArrowInvalid:
        # Some field is no plain number: read text, and let what is none become NaN.
        text = _fields(content, profile, fields, positions, pa.string(), [""])
        numbers = [_numbers(text[name], profile) for name in text.column_names]
        columns = pa.table(numbers, names=text.column_names)
    return np.stack([values_of(columns[name]) for name in wanted])


def _numbers(text: Any, profile: TextLayout) -> Any:
    """Text as float64, null where it is no number."""
    import pyarrow as pa
    import pyarrow.compute as compute

    text = compute.utf8_ltrim(compute.utf8_trim_whitespace(text), "\ufeff")
    plain = compute.replace_substring_regex(text, r'^"(.*)"$', r"\1")
    plain = compute.replace_substring(compute.utf8_trim_whitespace(plain), "\u2212", "-")
    decimal = profile.decimal
    if profile.text_separator == decimal:
        plain = compute.replace_substring(plain, HIDDEN, decimal)
    # The decimal mark is stated, so that another one before three digits is one of thousands.
    marks = f"[{'.' if decimal == ',' else ','}'{HIDDEN}\u00a0\u202f]"
    groups = rf"^[-+]?[1-9]\d{{0,2}}({marks}\d{{3}})+({re.escape(decimal)}\d*)?$"
    bare = compute.replace_substring_regex(plain, marks, "")
    grouped, with_decimals = (
        compute.match_substring_regex(plain, groups),
        compute.match_substring(plain, decimal),
    )
    if compute.any(with_decimals).as_py():
        # Beside decimals, 9.850 without any is another program's number.
        grouped = compute.and_(grouped, with_decimals)
    plain = compute.if_else(grouped, bare, plain)
    if decimal == ",":
        plain = compute.replace_substring(compute.replace_substring(plain, ".", HIDDEN), ",", ".")
    plain = compute.replace_substring_regex(plain, r"^\+", "")
    valid = compute.match_substring_regex(plain, r"^-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
    return compute.cast(compute.if_else(valid, plain, pa.scalar(None, pa.string())), pa.float64())
