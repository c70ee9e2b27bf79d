"""Where the header of a CSV file is: below title lines, above a row of units, behind a comment mark.

The header of a LabVIEW measurement file (.lvm): two blocks of keys above a row of names.

National Instruments, "LabVIEW Measurement File (*.lvm) Specification": separators part keys from values,
each block ends with a mark, and ``Y_Unit_Label`` holds the channels' units.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from fogml.errors import InputError, quoted
from fogml.runs.columns import parse_header
from fogml.runs.header_spelling import DATE_NAMES, canonical_cells, uncommented, with_units_below
from fogml.runs.stamp_forms import stamp_form

_BEGINS = "LabVIEW Measurement"
_END_OF_BLOCK = "***End_of_Header***"
_SEPARATORS = {"Comma": ",", "Tab": "\t"}


class LabviewHeader(NamedTuple):
    """Where the names stand among the lines, what is between fields, and the cells with their units."""

    line: int
    separator: str
    cells: list[str]


def labview_header(lines: Sequence[str]) -> LabviewHeader | None:
    """The header of a LabVIEW measurement file; None of another, or where the first lines hold no names.

    The first column of X values is the time where its dimension is one. Comments are no column: rows without
    one end before it.

    Examples
    --------
    >>> lines = ["LabVIEW Measurement", "Separator\\tTab", "***End_of_Header***", "Y_Unit_Label\\tdeg/h"]
    >>> lines += ["X_Dimension\\tTime", "***End_of_Header***", "X_Value\\tgyro\\tComment"]
    >>> labview_header(lines).cells
    ['time [s]', 'gyro [deg/h]']
    """
    filled = [i for i, line in enumerate(lines) if line.strip()]
    ends = [i for i in filled if lines[i].startswith(_END_OF_BLOCK)]
    if not filled or not lines[filled[0]].startswith(_BEGINS) or len(ends) < 2 or filled[-1] == ends[1]:
        return None
    above = "\n".join(lines[: ends[0]])
    separator = next((mark for name, mark in _SEPARATORS.items() if f"Separator{mark}{name}" in above), "\t")
    keys = {fields[0]: fields[1:] for fields in (line.split(separator) for line in lines[: ends[1]])}
    place = next(i for i in filled if i > ends[1])
    names = [name.strip() for name in lines[place].split(separator)]
    if names[-1] in ("Comment", ""):
        names.pop()
    is_time = keys.get("X_Columns", ["One"])[0] != "No" and keys.get("X_Dimension", ["Time"])[0] == "Time"
    labels = keys.get("Y_Unit_Label", [])
    # With a column of X values for each channel, keys stand above the latter.
    has_pairs = names.count("X_Value") > 1 and not any(label.strip() for label in labels[1::2])
    units, cells = iter(labels[:: 2 if has_pairs else 1]), []
    for i, name in enumerate(names):
        if name == "X_Value":
            cells.append("time [s]" if i == 0 and is_time else f"X_Value {i}" + " [s]" * is_time)
        else:
            unit = next(units, "").strip()
            cells.append(f"{name} [{unit}]" if unit else name)
    return LabviewHeader(place, separator, cells)


def campbell_header(lines: Sequence[str]) -> LabviewHeader | None:
    """The header of a table of Campbell Scientific's loggers (TOA5); None of another.

    Names stand in its second line, units in the third, and how values were processed in the fourth.
    """
    rows = [next(csv.reader([line]), []) for line in lines[:4]]
    if len(rows) < 4 or rows[0][:1] != ["TOA5"] or len(rows[1]) != len(rows[2]):
        return None
    stated = zip(rows[1], rows[2], strict=True)
    # TS and RN are times and numbers of records.
    cells = [f"{name} [{unit}]" if unit not in ("", "TS", "RN") else name for name, unit in stated]
    return LabviewHeader(3, ",", cells)


SEPARATORS = (",", ";", "\t")
_MOST_TITLE_LINES = 100
_LINES_BELOW = 5
"""Looked at below a header for numbers, and that its cells may go on over: a row of units, blank ones."""
_SEPARATOR_LINE = re.compile(r'\s*"?sep\s*=\s*(\S|\t)"?\s*\Z', re.IGNORECASE)
_NUMBER_LIKE = re.compile(r"\s*[+-]?[\d.,' ]*\d[\d.,' ]*([eE][+-]?\d+)?\s*\Z")


@dataclass(frozen=True)
class Header:
    """A header found among a file's first lines.

    Attributes
    ----------
    line
        Its index among the lines.
    data
        Index of the first line below it that may hold data: behind a row of units.
    separator
        Between fields.
    cells
        Header cells, spelled as in the run format.
    """

    line: int
    data: int
    separator: str
    cells: tuple[str, ...]

    @property
    def is_sure(self) -> bool:
        """Whether it names a time and a gyro."""
        names = {parse_header(cell)[0] for cell in self.cells}
        is_gyro = any(name == "gyro" or name.startswith("gyro_") for name in names)
        return is_gyro and ("time" in names or any(name.lower() in DATE_NAMES for name in names))


_LEAST_MERGED = 2
"""Texts in a row of a header; a row of one is a title."""


def find_header(lines: Sequence[str]) -> Header | None:
    """The header among a file's first lines; None where all of them are blank.

    It is the first line that names a time and a gyro and has numbers below, else the first that names them,
    else the last line of text above the first numbers that has as many fields as these, else the first line.
    """
    filled = [i for i, line in enumerate(lines) if line.strip()]
    stated = None
    if filled and (match := _SEPARATOR_LINE.match(lines[filled[0]])):
        stated = match[1]
        filled = filled[1:]
    if not filled:
        return None
    if (stated_by_format := labview_header(lines) or campbell_header(lines)) is not None:
        place, separator, cells = stated_by_format
        return Header(place, place + 1, separator, canonical_cells(cells))
    plain = []
    for i in filled[:_MOST_TITLE_LINES]:
        found = _header(lines, i, stated)
        if found.is_sure and _has_numbers(lines, found):
            return found
        plain.append(found)
    if sure := next((found for found in plain if found.is_sure), None):
        return sure
    above = _above_numbers(lines, filled[:_MOST_TITLE_LINES], plain, stated)
    return above or plain[0]


def header_over_lines(lines: Sequence[str]) -> Header | None:
    """As `find_header`, also where its cells hold line ends, as in a spreadsheet, within quotation marks."""
    found = find_header(lines)
    if found is None or (found.is_sure and lines[found.line].count('"') % 2 == 0):
        return found
    whole, begins = [], []
    at = 0
    while at < len(lines):
        ends = range(at + 1, min(at + 1 + _LINES_BELOW, len(lines)) + 1)
        end = next((end for end in ends if "".join(lines[at:end]).count('"') % 2 == 0), at + 1)
        whole.append(" ".join(lines[at:end]))
        begins.append(at)
        at = end
    joined = find_header(whole)
    if joined is None or not joined.is_sure:
        return found
    begins.append(len(lines))
    return replace(joined, line=begins[joined.line], data=begins[joined.data])


def names_others(fields: Sequence[str], cells: Sequence[str]) -> bool:
    """Whether a line among data is a header of other columns or units than a file's cells."""
    if any(is_number_like(field) for field in fields) or not all(map(str.strip, fields)):
        return False
    found = Header(0, 1, "", canonical_cells([field.strip(' "') for field in fields]))
    own = [parse_header(cell) for cell in canonical_cells(cells)]
    if not found.is_sure and not {name for name, _ in own} <= {parse_header(cell)[0] for cell in found.cells}:
        return False
    told = [parse_header(cell) for cell in found.cells]
    return len(told) != len(own) or any(
        name != other or (unit and known and unit != known)
        for (name, unit), (other, known) in zip(told, own, strict=True)
    )


def another_header(file: str, line: int, text: str) -> InputError:
    """What to say of such a line."""
    return InputError(
        f"{file}, line {line}: another header, {quoted(text.strip())}, of other columns or units than the "
        "first; save the rows from there on as a file of their own"
    )


def fields_of(line: str, separator: str | None) -> list[str]:
    """The fields of one line; no separator stands for blanks."""
    if separator is None:
        return line.split()
    if line and '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator), [])


def with_cells_above(fields: list[str], above: Sequence[str]) -> list[str]:
    """The fields of a line; where one has no text, that above, as of cells merged over two rows."""
    if len(above) != len(fields) or sum(bool(cell.strip()) for cell in above) < _LEAST_MERGED:
        return fields
    return [field if field.strip() else upper for field, upper in zip(fields, above, strict=True)]


def is_number_like(field: str) -> bool:
    """Whether a field is a number with any marks, or a date or a time of day, perhaps in quotation marks."""
    field = field.strip(' "')
    return bool(_NUMBER_LIKE.match(field)) or stamp_form([field]) is not None


def _header(lines: Sequence[str], i: int, separator: str | None) -> Header:
    text = uncommented(lines[i])
    separator = separator or _separator(text, lines[i + 1 : i + 1 + _LINES_BELOW])
    above = fields_of(uncommented(lines[i - 1]), separator) if i else []
    cells = _cells(with_cells_above(fields_of(text, separator), above))
    below = next((j for j in range(i + 1, len(lines)) if lines[j].strip()), None)
    if below is not None:
        units = with_units_below(cells, fields_of(uncommented(lines[below]), separator))
        if units is not None:
            return Header(i, below + 1, separator, units)
    return Header(i, i + 1, separator, canonical_cells(cells))


def _separator(header: str, below: Sequence[str]) -> str:
    """The mark between a header's fields: that of the numbers below it, where the header holds several."""
    counts = {mark: re.sub(r'"[^"]*"', "", header).count(mark) for mark in SEPARATORS}
    found = [mark for mark in SEPARATORS if counts[mark]]
    if len(found) < 2:
        return found[0] if found else SEPARATORS[0]

    def numbers(mark: str) -> int:
        return sum(is_number_like(field) for line in below for field in fields_of(line, mark))

    return max(found, key=lambda mark: (numbers(mark), counts[mark]))


def _has_numbers(lines: Sequence[str], header: Header) -> bool:
    """Whether the first line below a header is one of numbers, or there is none."""
    line = next((line for line in lines[header.data :] if line.strip()), "")
    fields = [field for field in fields_of(line, header.separator) if field.strip()]
    return 2 * sum(is_number_like(field) for field in fields) >= len(fields)


def _cells(fields: Sequence[str]) -> tuple[str, ...]:
    """Header cells; a column without a name is called by its place."""
    cells = [field.strip() for field in fields]
    while cells and not cells[-1]:
        cells.pop()
    return tuple(cell or f"column {i}" for i, cell in enumerate(cells, start=1))


def _above_numbers(
    lines: Sequence[str], filled: Sequence[int], found: Sequence[Header], stated: str | None
) -> Header | None:
    """The last header-like line before the first line of numbers."""
    for place, i in enumerate(filled):
        separator = stated or found[place].separator
        fields = fields_of(lines[i], separator)
        while fields and not fields[-1].strip():
            fields.pop()
        numbers = sum(is_number_like(field) for field in fields)
        if not fields or 2 * numbers < len(fields):
            continue
        above = [h for h in found[:place] if len(h.cells) == len(fields) and h.separator == separator]
        texts = [h for h in above if not any(is_number_like(cell) for cell in h.cells)]
        with_units = [h for h in texts if h.data - 1 > h.line and h.data <= i]
        return (with_units or texts or [None])[-1]  # type: ignore[list-item]
    return None
