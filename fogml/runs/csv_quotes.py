"""Quotation marks of a CSV file: whether the fast parser and the exact one read them alike.

A mark that is not closed makes a parser take the lines below it for one text; Arrow then leaves them out
without a word, and joins what stands before and after a closing mark to one number.
"""

from __future__ import annotations

import numpy as np

from fogml.runs.csv_source import CsvSource

_PART_BYTES = 1 << 24
_MARK, _NEWLINE, _RETURN = b'"\n\r'
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def quotes_are_plain(source: CsvSource, separator: str) -> bool:
    """Whether every quoted field is closed on its line and stands between separators (RFC 4180)."""
    rest = b"\n"
    with source.open() as file:
        begin = file.read(_PART_BYTES).removeprefix(_BYTE_ORDER_MARK)
        while part := begin or file.read(_PART_BYTES):
            begin = b""
            part = rest + part
            if b'"' not in part:
                rest = part[-1:]
                continue
            cut = max(part.rfind(b"\n"), part.rfind(b"\r"))
            if cut > 0 and not _plain(part[: cut + 1], separator):
                return False
            # The line's end stays, as what stands before the next field.
            rest = part[max(cut, 0) :]
    return _plain(rest + b"\n", separator)


def _plain(text: bytes, separator: str) -> bool:
    """The same of whole lines, with a byte before and after every mark."""
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
