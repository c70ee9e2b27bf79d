"""How a text file is written that nobody has described, as the keys of an import profile, and its fields."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from fogml.errors import InputError
from fogml.readers.beside import interval_in
from fogml.runs.columns import parse_header
from fogml.runs.csv_dialect import decoded_head
from fogml.runs.csv_header import (
    Header,
    campbell_header,
    fields_of,
    is_number_like,
    labview_header,
    with_cells_above,
)
from fogml.runs.csv_source import LINE_END, PLAIN, CsvSource, Marks, marks_of, number
from fogml.runs.header_spelling import canonical_cells, uncommented, with_units_below
from fogml.runs.logger_lines import is_frame, mark_of_line_stamps, plain_lines
from fogml.runs.profile_parts import SEPARATORS
from fogml.yaml_text import parse_yaml

MOST_ROWS = 200
_LEAST_ROWS = 8
"""Lines of as many numbers as the data have: facts above them are fewer on end."""
_TAIL_BYTES = 1 << 12


@dataclass
class Field:
    """A field of the file: how a profile names it, its name and unit, and its first values as text."""

    source: str | int
    name: str
    unit: str | None
    first: list[str] = field(default_factory=list)
    marks: Marks = PLAIN

    @property
    def numbers(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """The first values, NaN where they are no numbers."""
        found = (number(t.strip(' "'), self.marks.decimal, self.marks.grouped) for t in self.first)
        return np.array([np.nan if value is None else value for value in found])


def text_layout(path: Path) -> tuple[list[str], list[Field], tuple[str, float] | None]:
    """The layout's keys, the fields of a text file, and what is said above them of the interval [s]."""
    head, encoding, source = decoded_head(path)
    last = head.splitlines()[-MOST_ROWS:]
    stamp, has_sums = mark_of_line_stamps(last), 2 * sum(map(is_frame, last)) > len(last)
    name, lines, data, is_broken = _table_of(head, stamp, has_sums)
    mark = SEPARATORS[name]
    if data is None:
        raise InputError(f"{path.name}: no rows of numbers in its first lines; a draft needs some")
    rows = [fields_of(line, mark) for line in lines[data : data + MOST_ROWS] if not _is_blank(line, mark)]
    width = len(rows[0])
    numeric = _numeric(rows, width)
    rows = [row for row in rows if _is_data(row, width, numeric)]
    marks = marks_of(source, rows, mark or " ")
    layout = [f"line_stamp: {as_yaml(stamp)}"] if stamp is not None else []
    doubt = f"    # GUESS: {marks.doubt.partition(';')[0]}" if marks.doubt else ""
    is_stated = marks.decimal != "." or doubt
    layout += [f"separator: {name}"] + ([f'decimal: "{marks.decimal}"{doubt}'] if is_stated else [])
    layout += ["checksum: true"] if has_sums else []
    if encoding not in ("utf-8-sig", "utf-8"):
        doubt = "    # GUESS: are the names right? else cp1251, koi8-r, shift_jis, big5 ..."
        layout.append(f"encoding: {encoding}{'' if encoding.startswith('utf') else doubt}")
    header = _Header.above(lines, data, width, mark)
    if header is None:
        # Facts have names; without any, every line of as many numbers is one of the data.
        begin = next(i for i, line in enumerate(lines) if _is_data(fields_of(line, mark), width, numeric))
        data, is_broken = begin, is_broken or begin < data
    if header is None or header.is_by_place:
        # A name would be of none of its columns, or of several.
        cells = [f"column {i}" for i in range(width)]
        if header is not None:
            cells = [right for _, right in header.cells]
        layout += [f"skip_lines: {data}"] if data else []
        layout += ["header: false", f"fields: {width}"]
        fields = [Field(i, *parse_header(cell)) for i, cell in enumerate(cells)]
        if header is not None:
            layout.append(f"# Fields: {', '.join(f'{f.source} {f.name}' for f in fields)}")
    else:
        if next(i for i, text in enumerate(lines) if text.strip()) < header.line:
            told = as_yaml(lines[header.line].strip()[:60])
            layout.append(f"header_text: {told}    # the header is the first line that holds this")
        fields = [Field(cell.strip(' "'), *parse_header(right)) for cell, right in header.cells]
    below = is_broken or _are_below(source, mark, rows, stamp, has_sums)
    with_units = header is not None and header.with_units and not header.is_by_place
    if with_units or below:
        keys = ["not_numbers: true", *(["wrong_field_count: true"] if below else [])]
        what = ["the row of units below the header"] * with_units + ["lines within or below the data"] * below
        layout.append(f"reject: {{{', '.join(keys)}}}    # {' and '.join(what)}: left out")
    for place, one in enumerate(fields):
        one.first, one.marks = [row[place] for row in rows], marks
    return layout, fields, interval_in(lines[:data])


@dataclass(frozen=True)
class _Header:
    """The names above the data.

    Attributes
    ----------
    line
        Its index among the lines.
    cells
        Names as they stand, each with its header cell as the run format spells it.
    with_units
        Whether the row below holds the units.
    is_by_place
        Whether the names tell no columns apart.
    """

    line: int
    cells: list[tuple[str, str]]
    with_units: bool = False
    is_by_place: bool = False

    @classmethod
    def above(cls, lines: Sequence[str], data: int, width: int, mark: str | None) -> _Header | None:
        """That of the lines above the first one of data; None where they hold none."""
        if stated := labview_header(lines) or campbell_header(lines):
            spelled = canonical_cells(stated.cells)
            return cls(stated.line, list(zip(stated.cells, spelled)), is_by_place=True)
        split = [(i, fields_of(lines[i], mark)) for i in range(data) if lines[i].strip()]
        # A mark of comments between blanks is a field too many.
        is_marked = [
            len(cells) == width + 1 and (cells[0] == ";" or not uncommented(cells[0])) for _, cells in split
        ]
        split = [(i, cells[marked:]) for (i, cells), marked in zip(split, is_marked, strict=True)]
        names = [(i, cells) for i, cells in split if len(cells) == width and _are_names(cells)]
        if not names:
            return None
        line, own = names[-1]
        if len(names) > 1 and (units := with_units_below([c.strip() for c in names[-2][1]], own)):
            (line, own), known = names[-2], units
            return cls(line, list(zip(own, known)), with_units=True, is_by_place=any(is_marked))
        cells = [c.strip().strip('"') for c in with_cells_above(own, names[-2][1] if len(names) > 1 else [])]
        times = Counter(cell for cell in cells if cell)
        is_by_place = (
            any(is_marked)
            or max(times.values(), default=0) > 1
            or any(cell != raw.strip().strip('"') for cell, raw in zip(cells, own))
        )
        return cls(line, list(zip(own, canonical_cells(cells))), is_by_place=is_by_place)


def _are_names(cells: Sequence[str]) -> bool:
    """Whether the cells of a line are names, numbers beside those of a time and a gyro apart."""
    if re.search(r"[\0-\x08\x0e-\x1f]", "".join(cells)):
        return False
    if not any(is_number_like(cell) for cell in cells):
        return True
    return Header(0, 1, "", canonical_cells([cell.strip(' "') for cell in cells])).is_sure


def _are_below(
    source: CsvSource, mark: str | None, rows: Sequence[Sequence[str]], stamp: str | None, has_sums: bool
) -> bool:
    """Whether lines other than of numbers stand below them, or such as lack one that every row has."""
    tail = source.tail(_TAIL_BYTES).decode(errors="replace")
    tail = plain_lines(tail.encode(), stamp, mark, has_sums).decode()
    lines = [fields_of(line, mark) for line in LINE_END.split(tail)[1:] if line.strip()]
    width = len(rows[0])
    # Of a short file the last of them are those that stand below.
    numeric = _numeric(rows, width)
    full = [row for row in rows[: len(rows) // 2 + 1] if _is_data(row, width, numeric)]
    held = [i for i in range(width) if all(is_number_like(row[i]) for row in full)]
    return any(len(f) != width or not all(is_number_like(f[i]) for i in held) for f in lines)


def _table_of(text: str, stamp: str | None, has_sums: bool) -> tuple[str, list[str], int | None, bool]:
    """The separator's name, the lines, the first line of numbers, and whether other lines stand below it."""
    best: tuple[tuple[float, float], str, list[str], int | None, bool]
    best = (0.0, 0.0), "comma", _lines(text), None, False
    labview = labview_header(_lines(text))
    for name, mark in SEPARATORS.items():
        if labview is not None and mark != labview.separator:
            continue
        lines = _lines(plain_lines(text.encode(), stamp, mark, has_sums).decode())
        rows = [fields_of(line, mark) for line in lines[-MOST_ROWS:] if line.strip()]
        counts = [len(row) for row in rows]
        width = max(set(counts), key=counts.count) if counts else 0
        numeric = _numeric(rows, width)
        is_data = [_is_blank(t, mark) or _is_data(fields_of(t, mark), width, numeric) for t in lines]
        first = _first_of_rows(is_data, [not _is_blank(t, mark) for t in lines])
        numbers = [sum(is_number_like(f) for f in row) for row in rows]
        # Of separators that make as many numbers one makes them alone: a decimal comma parts their digits.
        score = (
            (float(np.median(numbers)), float(np.median(np.subtract(numbers, counts))))
            if rows
            else (0.0, 0.0)
        )
        if first is not None and score[0] > 0.0 and (best[0][0] == 0.0 or score > best[0]):
            below = zip(is_data[first:], lines[first:], strict=True)
            is_broken = any(not sound or (t.strip() and _is_blank(t, mark)) for sound, t in below)
            best = (score, name, lines, first, is_broken)
    return best[1:]


def _is_blank(line: str, mark: str | None) -> bool:
    """Whether a line holds nothing, or nothing between its separators."""
    return not line.strip(f'{mark or ""} \t"')


def _lines(text: str) -> list[str]:
    """The lines of a text, but for the last one, which may be cut."""
    return text.split("\n")[:-1] or [text]


def _first_of_rows(is_data: Sequence[bool], is_filled: Sequence[bool]) -> int | None:
    """Where the first stretch of lines of numbers begins that is no block of facts above; None without any.

    It has `_LEAST_ROWS` lines or is the longest: a remark or a blank line within the data parts stretches.
    """
    ends = [-1, *(i for i, data in enumerate(is_data) if not data), len(is_data)]
    stretches = [[i for i in range(a + 1, b) if is_filled[i]] for a, b in pairwise(ends)]
    least = min(_LEAST_ROWS, max(map(len, stretches)))
    return next((found[0] for found in stretches if len(found) >= max(least, 1)), None)


def _numeric(rows: Sequence[Sequence[str]], width: int) -> list[int]:
    """Places at which most rows of a width hold numbers: a status or a code in hexadecimal does by chance."""
    full = [row for row in rows if len(row) == width]
    return [i for i in range(width) if 2 * sum(is_number_like(row[i]) for row in full) > len(full)]


def _is_data(fields: Sequence[str], width: int, numeric: Sequence[int]) -> bool:
    numbers = [is_number_like(fields[i]) for i in numeric] if len(fields) == width else []
    return bool(numbers) and 2 * sum(numbers) >= len(numbers)


def as_yaml(value: str | int) -> str:
    """A value for YAML."""
    if isinstance(value, int):
        return str(value)
    # Words such as 'no' and 'on' are truth values there.
    is_plain = re.fullmatch(r"[A-Za-z_][\w./]*", value) and parse_yaml(value, value) == value
    return value if is_plain else json.dumps(value, ensure_ascii=False)
