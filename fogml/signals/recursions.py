"""Recursions with a memory: first-order lag and play operator, at true times, in one pass.

Each kernel takes the state that the samples before left and returns the one that it leaves, so
that a series may be worked block by block with the same numbers.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@njit(cache=True, nogil=True)
def lag_kernel(
    time: FloatArray, x: FloatArray, tau: FloatArray, last_time: float, last_x: float, state: float
) -> tuple[FloatArray, float]:
    """First-order lag of x, exact for x linear between samples.

    ``tau dy/dt = x - y``; `tau` [s] has shape (n,) or (1,) for a constant. `last_time`, `last_x`
    and `state` belong to the sample before the first one; a NaN `last_time` starts at rest.
    """
    n = len(x)
    out = np.empty(n)
    constant = len(tau) == 1
    before_t, before_x, y = last_time, last_x, state
    step_known, decay, weight = -1.0, 0.0, 0.0
    for i in range(n):
        if math.isnan(before_t):
            y = x[i]
        else:
            step = time[i] - before_t
            if not constant or step != step_known:
                tau_i = tau[0] if constant else tau[i]
                ratio = step / tau_i
                decay = math.exp(-ratio)
                # Share of the newest input in the ramp-invariant step.
                weight = 1.0 + math.expm1(-ratio) / ratio if ratio > 1e-9 else 0.5 * ratio
                step_known = step
            y = decay * y + (1.0 - decay - weight) * before_x + weight * x[i]
        out[i] = y
        before_t, before_x = time[i], x[i]
    return out, y


@njit(cache=True, nogil=True)
def play_kernel(x: FloatArray, half_width: float, state: float) -> tuple[FloatArray, float]:
    """Play operator: s = min(max(s, x - w), x + w); a NaN state starts in the middle."""
    n = len(x)
    out = np.empty(n)
    s = state
    for i in range(n):
        if math.isnan(s):
            s = x[i]
        low, high = x[i] - half_width, x[i] + half_width
        if s < low:
            s = low
        elif s > high:
            s = high
        out[i] = s
    return out, s
