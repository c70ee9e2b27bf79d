"""The play operator as it is defined, value by value: what hysteresis is compared with."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray


def play(course: FloatArray, half_width: float) -> FloatArray:
    """What follows a course, shape (n,), at `half_width` of it at most."""
    out, last = np.empty_like(course), course[0]
    for i, value in enumerate(course):
        out[i] = last = min(max(last, value - half_width), value + half_width)
    return out
