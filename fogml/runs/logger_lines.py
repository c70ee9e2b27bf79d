"""The lines of a logger's text file, found and chosen in one piece."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

IndexArray = NDArray[np.intp]

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
