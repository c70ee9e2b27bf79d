"""Compiled writing of CSV lines of plain decimal numbers. Loads numba.

A decimal of up to 15 digits that reads back as a float64 is the only one, so it is the shortest text
that keeps every digit. It is looked for at the number of decimals that the column had last; numbers
that have none, very small and very large ones are left to a writer that knows them all.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
LONGEST_FIELD = 24
"""No number, with its sign, point and comma, takes more bytes."""
_POWERS: FloatArray = np.array([float(10**power) for power in range(16)])
_WHOLE_POWERS = np.array([10**power for power in range(16)])
_MOST_DIGITS_BELOW = 1e15
_LEAST, _LIMIT = 1e-5, 1e10
"""Beyond these an exponent is written."""
_LINE_FEED, _COMMA, _MINUS, _POINT, _ZERO = 10, 44, 45, 46, 48


def plain_lines(columns: FloatArray, decimals: NDArray[np.intp]) -> memoryview | None:
    """Lines of comma-separated numbers; None if one of them is not plain.

    Parameters
    ----------
    columns
        Shape (c, n).
    decimals
        Decimals to begin with in each column, shape (c,); brought up to date.
    """
    text = np.empty(columns.size * LONGEST_FIELD, dtype=np.uint8)
    size = fill_lines(columns, decimals, text, _POWERS, _WHOLE_POWERS)
    return None if size < 0 else text[:size].data


@njit(cache=True, nogil=True)
def fill_lines(
    columns: FloatArray,
    decimals: NDArray[np.intp],
    text: NDArray[np.uint8],
    powers: FloatArray,
    whole_powers: NDArray[np.intp],
) -> int:
    """Write the lines into `text`; how many bytes, or -1 where a number is not plain."""
    at = 0
    for line in range(columns.shape[1]):
        for column in range(columns.shape[0]):
            value = columns[column, line]
            size = abs(value)
            if not (value == 0.0 or _LEAST <= size < _LIMIT):
                return -1
            places = decimals[column]
            digits = np.rint(size * powers[places])
            if not (digits < _MOST_DIGITS_BELOW and digits / powers[places] == size):
                places = 0
                while places < len(powers):
                    digits = np.rint(size * powers[places])
                    if not digits < _MOST_DIGITS_BELOW:
                        return -1
                    if digits / powers[places] == size:
                        break
                    places += 1
                if places == len(powers):
                    return -1
                decimals[column] = places
            number = int(digits)
            while places > 0 and number % 10 == 0:
                number //= 10
                places -= 1
            if math.copysign(1.0, value) < 0.0:
                text[at] = _MINUS
                at += 1
            whole = number // whole_powers[places]
            width = 1
            while width < 11 and whole >= whole_powers[width]:
                width += 1
            end = at + width + (places + 1 if places > 0 else 0)
            at = end
            for _ in range(places):
                at -= 1
                text[at] = _ZERO + number % 10
                number //= 10
            if places > 0:
                at -= 1
                text[at] = _POINT
            for _ in range(width):
                at -= 1
                text[at] = _ZERO + number % 10
                number //= 10
            text[end] = _COMMA
            at = end + 1
        text[at - 1] = _LINE_FEED
    return at
