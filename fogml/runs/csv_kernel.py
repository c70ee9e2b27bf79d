"""Compiled reading of plain CSV: decimal numbers only, in every line as many. Loads numba.

Whatever else stands in a file (quotes, missing values, spaces, more digits than a float64 holds) is
left to the strict parser: it says what is wrong, and takes some of it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate, pairwise
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fogml.runs.csv_dialect import LINE_END, CsvDialect

FloatArray = NDArray[np.float64]
Text = NDArray[np.uint8]
_HEAD_BYTES = 1 << 16
_PIECE_BYTES = 1 << 20
_MOST_DIGITS = 18
"""So many digits fit into an integer of 64 bits."""
_LARGEST_EXACT = 1 << 53
_POWERS: FloatArray = np.array([float(10**power) for power in range(23)])
"""The powers of ten that float64 holds exactly: a product or quotient with them is rounded once."""
_LINE_FEED, _RETURN, _QUOTE, _PLUS, _MINUS, _ZERO, _LARGE_E, _SMALL_E = 10, 13, 34, 43, 45, 48, 69, 101


def plain_columns(path: Path, dialect: CsvDialect, threads: int) -> list[FloatArray] | None:
    """Columns at the positions `dialect.read`, right to the last digit; None if the file isn't plain."""
    if dialect.blanks:
        return None
    text = np.fromfile(path, dtype=np.uint8)
    begin = _end_of_header(text, dialect.header_line)
    if begin is None or begin == len(text):
        return None
    if text[-1] != _LINE_FEED:
        text = np.append(text, np.uint8(_LINE_FEED))
    places = np.full(len(dialect.cells), -1)
    places[list(dialect.read)] = np.arange(len(dialect.read))
    marks = ord(dialect.separator), ord(dialect.decimal)
    borders = [_line_from(text, place) for place in np.linspace(begin, len(text), threads + 1).astype(int)]
    parts = [text[start:stop] for start, stop in pairwise(borders)]
    with ThreadPoolExecutor(threads) as pool:
        lines = list(accumulate(pool.map(_count_lines, parts), initial=0))
        columns = np.empty((len(dialect.read), lines[-1]))
        slices = [columns[:, start:stop] for start, stop in pairwise(lines)]
        done = pool.map(lambda part, out: parse_lines(part, *marks, places, out, _POWERS), parts, slices)
        return list(columns) if all(list(done)) else None


def _end_of_header(text: Text, lines: int) -> int | None:
    """Where the first line of numbers begins, if a line feed ends the header."""
    head = text[:_HEAD_BYTES].tobytes()
    ends = [match.end() for match in LINE_END.finditer(head.decode("latin-1"))]
    if len(ends) < lines or head[ends[lines - 1] - 1] != _LINE_FEED:
        return None
    return ends[lines - 1]


def _line_from(text: Text, place: int) -> int:
    """Where a line begins, at a place or next after it."""
    while place < len(text) and text[place - 1] != _LINE_FEED:
        place += 1
    return place


def _count_lines(text: Text) -> int:
    """Line feeds, counted within the processor's cache."""
    starts = range(0, len(text), _PIECE_BYTES)
    return sum(int(np.count_nonzero(text[i : i + _PIECE_BYTES] == _LINE_FEED)) for i in starts)


@njit(cache=True, nogil=True)
def parse_lines(
    text: Text,
    separator: int,
    decimal: int,
    places: NDArray[np.intp],
    columns: FloatArray,
    powers: FloatArray,
) -> bool:
    """Fill `columns` (c, lines) from text of as many lines; False at anything that isn't plain.

    ``places[field]`` is the row of `columns` that a field goes to, negative where it is not read.
    The end of the text is not looked for within a line, as it is a line feed. One function does it
    all: counting references to an array that is handed on takes longer than reading a number.
    """
    i = 0
    for line in range(columns.shape[1]):
        for field in range(len(places)):
            if field > 0:
                if text[i] != separator:
                    return False
                i += 1
            if places[field] < 0:
                while text[i] != separator and text[i] != _LINE_FEED and text[i] != _RETURN:
                    if text[i] == _QUOTE:
                        return False
                    i += 1
                continue
            negative = text[i] == _MINUS
            i += negative
            number, digits, whole_digits = 0, 0, -1
            while True:
                if _ZERO <= text[i] <= _ZERO + 9:
                    number = 10 * number + (text[i] - _ZERO)
                    digits += 1
                elif text[i] == decimal and whole_digits < 0:
                    whole_digits = digits
                else:
                    break
                i += 1
            if digits == 0 or digits > _MOST_DIGITS or number > _LARGEST_EXACT:
                return False
            power = whole_digits - digits if whole_digits >= 0 else 0
            if text[i] == _SMALL_E or text[i] == _LARGE_E:
                falls = text[i + 1] == _MINUS
                i += 2 if falls or text[i + 1] == _PLUS else 1
                start, exponent = i, 0
                while _ZERO <= text[i] <= _ZERO + 9:
                    exponent = 10 * exponent + (text[i] - _ZERO)
                    i += 1
                if i == start or i - start > _MOST_DIGITS:
                    return False
                power += -exponent if falls else exponent
            if abs(power) >= len(powers):
                return False
            value = number * powers[power] if power >= 0 else number / powers[-power]
            columns[places[field], line] = -value if negative else value
        i += text[i] == _RETURN
        if text[i] != _LINE_FEED:
            return False
        i += 1
    return True
