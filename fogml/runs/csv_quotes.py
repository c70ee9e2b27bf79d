"""Quotation marks of a CSV file: whether the fast parser and the exact one read them alike.

A mark that is not closed makes a parser take the lines below it for one text; Arrow then leaves them out
without a word, and joins what stands before and after a closing mark to one number.
"""

from __future__ import annotations

import numpy as np

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
