"""Curves as rows of Braille characters, for terminals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_BLANK = 0x2800


def braille(values: FloatArray, width: int = 60, height: int = 3) -> list[str]:
    """A curve as lines of text, highest values first.

    Each column of dots spans from the least to the greatest value of its part of the curve.

    Parameters
    ----------
    values
        Shape (n,), finite.
    width, height
        In characters, of 2 by 4 dots each.
    """
    columns, rows = 2 * width, 4 * height
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    scale = (rows - 1) / (high - low) if high > low else 0.0
    cells = np.full((height, width), _BLANK, dtype=np.int64)
    if len(values) == 0:
        return ["".join(map(chr, row)) for row in cells]
    edges = np.linspace(0, len(values), columns + 1)
    for column in range(columns):
        start = min(int(edges[column]), len(values) - 1)
        part = values[start : max(start + 1, int(np.ceil(edges[column + 1])))]
        top = round((high - float(part.max())) * scale)
        bottom = round((high - float(part.min())) * scale)
        for row in range(top, bottom + 1):
            cells[row // 4, column // 2] |= _DOTS[row % 4, column % 2]
    return ["".join(map(chr, row)) for row in cells.tolist()]
