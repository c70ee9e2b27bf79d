"""Bases and memory over a course: bumps, relays, loops, lags, rates, decays, and its corners.

Compiled loops are loaded by what needs them: effects that are listed compute nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray


def sine(turns: ArrayLike) -> FloatArray:
    """sin(2 pi turns) to 5e-16, shape as given; NaN where an angle is not finite."""
    from fogml.signals.sine_kernel import sine_kernel

    given = np.ascontiguousarray(turns, dtype=np.float64)
    out = np.empty_like(given)
    sine_kernel(given.reshape(-1), out.reshape(-1))
    return out


def bumps(x: FloatArray, low: float, high: float, count: int) -> FloatArray:
    """Smooth bumps over a range that add to one within it, shape (n, count)."""
    centres = np.linspace(low, high, count)
    width = max((high - low) / max(count - 1, 1), 1e-9)
    near = np.exp(-0.5 * ((x[:, None] - centres) / (0.7 * width)) ** 2)
    return np.asarray(near / np.maximum(near.sum(axis=1, keepdims=True), 1e-12))


def relays(x: FloatArray, centres: FloatArray, half_width: float, first: int = 0) -> FloatArray:
    """State of relays within their loops, -1, 0 outside, or 1, shape (n, relays).

    A relay goes up at its centre and half width, down at its centre less that; outside of its loop both
    branches agree. One that nothing has set yet is as `x` came to it from below or above first. What reaches
    a threshold but for rounding reaches it, as the ends of a course do those of relays that span it.
    """
    reach = (1.0 - 1e-9) * half_width
    up, down = x[:, None] >= centres + reach, x[:, None] <= centres - reach
    code = up.astype(np.int8) - down.astype(np.int8)
    last = np.maximum.accumulate(np.where(code != 0, np.arange(len(x))[:, None], -1), axis=0)
    virgin = np.where(centres > x[0], -1, 1).astype(np.int8)
    state = np.where(last >= 0, np.take_along_axis(code, np.maximum(last, 0), axis=0), virgin)
    return np.where(code == 0, state, 0)[first:].astype(np.float64)


def preisach(
    x: FloatArray,
    low: float,
    high: float,
    half_width: float,
    first: int = 0,
    *,
    count: int = 48,
    wide: int = 5,
) -> FloatArray:
    """Loops of `count` relays of one half width, less the mean of their branches, shape (n, wide).

    Columns are `wide` smooth densities over the relays' centres. Reference: I. D. Mayergoyz, Mathematical
    Models of Hysteresis, Springer 1991.
    """
    centres = np.linspace(low - half_width, high + half_width, count)
    density = bumps(centres, low - half_width, high + half_width, wide) / count
    return relays(x, centres, half_width, first) @ density


def play(x: FloatArray, half_width: float) -> FloatArray:
    """What a play of a half width makes of a course, from its first value on, shape (n,)."""
    from fogml.signals.recursions import play_kernel

    return np.asarray(play_kernel(np.ascontiguousarray(x), half_width, np.nan)[0])


def lag(time: FloatArray, x: FloatArray, time_constant_s: float) -> FloatArray:
    """First-order lag from rest, shape (n,)."""
    if time_constant_s <= 0.0:
        return x
    from fogml.signals.recursions import lag_kernel

    return np.asarray(lag_kernel(time, x, np.array([time_constant_s]), np.nan, np.nan, np.nan)[0])


def rate(time: FloatArray, x: FloatArray) -> FloatArray:
    """Rate of a smooth course per minute, shape (n,)."""
    return np.asarray(60.0 * np.gradient(x, time)) if len(x) > 1 else np.zeros(len(x))


def decayed(time: FloatArray, kicks: FloatArray, time_constant_s: float) -> FloatArray:
    """What kicks leave behind while it decays, shape (n, k)."""
    out, state = np.zeros(kicks.shape), np.zeros(kicks.shape[1])
    keep = np.exp(-np.diff(time, prepend=time[0]) / time_constant_s)
    for i, (kick, share) in enumerate(zip(kicks, keep.tolist())):
        state = state * share + kick
        out[i] = state
    return out


def corners(time: FloatArray, x: FloatArray, within: float) -> list[int]:
    """Corners of a line that stays near a course (D. Douglas and T. Peucker, Cartographica 10 (1973) 112)."""
    kept: BoolArray = np.zeros(len(x), dtype=np.bool_)
    kept[[0, -1]] = True
    todo = [(0, len(x) - 1)]
    while todo:
        low, high = todo.pop()
        if high - low < 2:
            continue
        line = np.interp(time[low : high + 1], time[[low, high]], x[[low, high]])
        off = np.abs(x[low : high + 1] - line)
        far = int(np.argmax(off))
        if off[far] > within:
            kept[low + far] = True
            todo += [(low, low + far), (low + far, high)]
    return [int(i) for i in np.flatnonzero(kept)]
