"""Recursions with a memory: lag, play operator and sliding windows, at true times, in one pass.

Each kernel takes the state that the samples before left and returns the one that it leaves, so
that a series may be worked block by block with the same numbers.
"""

from __future__ import annotations

import math

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.signals.compiled import kernel

_ROUNDED = 2.0 * float(np.finfo(np.float64).eps)
"""What rounding may make of a difference of two times, of the time."""


@kernel()
def lag_kernel(
    time: FloatArray,
    x: FloatArray,
    tau: FloatArray,
    last_time: float,
    last_x: float,
    behind: float,
    last_step: float = -1.0,
) -> tuple[FloatArray, float, float]:
    """First-order lag y of x, exact for x linear between samples; the last y - x and step [s] as well.

    ``tau dy/dt = x - y``; `tau` [s] has shape (n,) or (1,) for a constant. `last_time`, `last_x`, `behind`
    (y - x) and `last_step` belong to the sample before the first one; a NaN `last_time` starts at rest.
    """
    n = len(x)
    out = np.empty(n)
    if n == 0:
        return out, behind, last_step
    constant = len(tau) == 1
    rests = math.isnan(last_time)
    before_t, before_x = (time[0], x[0]) if rests else (last_time, last_x)
    step_known, decay, weight = last_step, math.nan, 0.0
    if rests:
        # In differences, a constant x at rest stays exactly that.
        out[0], behind = x[0], 0.0
    for i in range(1 if rests else 0, n):
        step = time[i] - before_t
        # Steps that differ by the rounding of their times are one.
        if abs(step - step_known) > _ROUNDED * abs(time[i]):
            step_known, decay = step, math.nan
        if not constant or math.isnan(decay):
            ratio = step_known / (tau[0] if constant else tau[i])
            decay = math.exp(-ratio)
            # Share of the newest input that the ramp-invariant step leaves behind.
            weight = -math.expm1(-ratio) / ratio if ratio > 1e-9 else 1.0 - 0.5 * ratio
        behind = decay * behind - weight * (x[i] - before_x)
        out[i] = x[i] + behind
        before_t, before_x = time[i], x[i]
    return out, behind, step_known


@kernel()
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


@kernel()
def slew_kernel(
    time: FloatArray, x: FloatArray, fastest: float, last_time: float, state: float
) -> FloatArray:
    """What follows x no faster than `fastest` [per s]; a NaN `last_time` starts with x."""
    n = len(x)
    out = np.empty(n)
    y, before = state, last_time
    for i in range(n):
        # In differences, so that what keeps up is x exactly.
        if math.isnan(before):
            y = x[i]
        else:
            most = fastest * (time[i] - before)
            if x[i] - y > most:
                y = y + most
            elif y - x[i] > most:
                y = y - most
            else:
                y = x[i]
        out[i] = y
        before = time[i]
    return out


@kernel()
def window_steps_kernel(
    time: FloatArray, x: FloatArray, window: float, first: int
) -> tuple[FloatArray, FloatArray]:
    """Means over the newest window (t - w, t] less those over the window before, of x and of time.

    For the samples from number `first` on; those before are history. Where the window before holds
    nothing, the newest one is halved; where that holds one sample alone, after a gap of two windows
    or more, the steps are those from the sample before. The very first sample has steps 0.
    """
    n = len(time)
    step_x, step_t = np.zeros(n - first), np.zeros(n - first)
    # Sampling on a regular grid must not fall on either side of a window's edge by rounding.
    tolerance = 1e-8 * window
    start, middle, fresh = 0, 0, 0
    base_x, base_t = 0.0, 0.0
    new_x, new_t, old_x, old_t = 0.0, 0.0, 0.0, 0.0
    for i in range(first, n):
        edge = time[i] - window + tolerance
        # Sums are taken anew about the latest sample after each window's length: rounding can't
        # build up, and blocks agree with the whole.
        anew = i == first or fresh >= max(64, i - start)
        if anew:
            fresh = 0
            base_x, base_t = x[i], time[i]
            while time[middle] <= edge:
                middle += 1
            while time[start] <= edge - window:
                start += 1
            new_x, new_t, old_x, old_t = 0.0, 0.0, 0.0, 0.0
            for j in range(start, middle):
                old_x += x[j] - base_x
                old_t += time[j] - base_t
            for j in range(middle, i + 1):
                new_x += x[j] - base_x
                new_t += time[j] - base_t
        else:
            fresh += 1
            new_x += x[i] - base_x
            new_t += time[i] - base_t
            while time[middle] <= edge:
                dx, dt = x[middle] - base_x, time[middle] - base_t
                new_x -= dx
                new_t -= dt
                old_x += dx
                old_t += dt
                middle += 1
            while time[start] <= edge - window:
                old_x -= x[start] - base_x
                old_t -= time[start] - base_t
                start += 1
        before, newest = middle - start, i + 1 - middle
        if before > 0:
            step_x[i - first] = new_x / newest - old_x / before
            step_t[i - first] = new_t / newest - old_t / before
        elif newest > 1:
            half = (start + i + 1) // 2
            sum_x, sum_t = 0.0, 0.0
            for j in range(start, half):
                sum_x += x[j] - base_x
                sum_t += time[j] - base_t
            before, newest = half - start, i + 1 - half
            step_x[i - first] = (new_x - sum_x) / newest - sum_x / before
            step_t[i - first] = (new_t - sum_t) / newest - sum_t / before
        elif i > 0:
            step_x[i - first] = x[i] - x[i - 1]
            step_t[i - first] = time[i] - time[i - 1]
    return step_x, step_t


@kernel()
def course_steps_kernel(time: FloatArray, x: FloatArray, rows: IndexArray, window: float) -> FloatArray:
    """Means over the newest window less those over the one before, of a course linear between samples.

    For the samples of rising numbers `rows`, two windows or more after the first; shape (len(rows),).
    """
    n = len(time)
    # About the first sample, a constant x has means of exactly 0.
    total = np.zeros(n)
    for i in range(1, n):
        total[i] = total[i - 1] + 0.5 * (x[i] + x[i - 1] - 2.0 * x[0]) * (time[i] - time[i - 1])
    out = np.empty(len(rows))
    before = np.zeros(2, dtype=np.int64)
    for k in range(len(rows)):
        row = rows[k]
        means = total[row]
        for back in range(2):
            at = time[row] - (back + 1.0) * window
            i = before[back]
            while i < n - 2 and time[i + 1] <= at:
                i += 1
            before[back] = i
            since, step = at - time[i], time[i + 1] - time[i]
            slope = (x[i + 1] - x[i]) / step if step > 0.0 else 0.0
            integral = total[i] + since * (x[i] - x[0] + 0.5 * since * slope)
            means += -2.0 * integral if back == 0 else integral
        out[k] = means / window
    return out
