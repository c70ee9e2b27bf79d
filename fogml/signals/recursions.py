"""Recursions with a memory: lag, play operator and sliding windows, at true times, in one pass.

Each kernel takes the state that the samples before left and returns the one that it leaves, so
that a series may be worked block by block with the same numbers.

Operators that take samples in order: a lag and a play.

Each is an object that takes samples in order by `push`: a whole recording, blocks of it or one sample at a
time give the same numbers, because the state goes on between calls. Beside its values it tells where it is
*settled*: where what was before the first sample no longer matters.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.signals.clock import EXPONENTIAL_SPAN, check_window, gap_starts, longest_gap_s, needed_s
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
    state: float,
    last_step: float = -1.0,
) -> tuple[FloatArray, float, float]:
    """First-order lag of x, exact for x linear between samples; the last state and step [s] as well.

    ``tau dy/dt = x - y``; `tau` [s] has shape (n,) or (1,) for a constant. `last_time`, `last_x`, `state`
    and `last_step` belong to the sample before the first one; a NaN `last_time` starts at rest.
    """
    n = len(x)
    out = np.empty(n)
    constant = len(tau) == 1
    before_t, before_x, y = last_time, last_x, state
    step_known, decay, weight = last_step, math.nan, 0.0
    for i in range(n):
        if math.isnan(before_t):
            y = x[i]
        else:
            step = time[i] - before_t
            # Steps that differ by the rounding of their times are one.
            if abs(step - step_known) > _ROUNDED * abs(time[i]):
                step_known, decay = step, math.nan
            if not constant or math.isnan(decay):
                ratio = step_known / (tau[0] if constant else tau[i])
                decay = math.exp(-ratio)
                # Share of the newest input in the ramp-invariant step.
                weight = 1.0 + math.expm1(-ratio) / ratio if ratio > 1e-9 else 0.5 * ratio
            # In differences, so that a constant x at rest stays exactly that.
            y = before_x + decay * (y - before_x) + weight * (x[i] - before_x)
        out[i] = y
        before_t, before_x = time[i], x[i]
    return out, y, step_known


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


class MemoryOperator(Protocol):
    """An operator with a state that goes on from sample to sample."""

    def push(self, time: FloatArray, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Values at the next samples, and where they are settled; both of shape (n,)."""
        ...


class Lag:
    r"""First-order lag, :math:`\tau \dot y = x - y`, exact for x linear between samples.

    It begins at rest at the first sample, and again after a gap that a window of its time constant may
    not span (`fogml.signals.windows`). It is settled three time constants later.

    Parameters
    ----------
    time_constant_s
        Time constant [s].
    sample_s
        Nominal sample interval [s].

    Raises
    ------
    InputError
        If the time constant is shorter than the sample interval.
    """

    def __init__(self, time_constant_s: float, sample_s: float) -> None:
        check_window(time_constant_s, sample_s, 1, "a lag's time constant")
        self._tau = np.array([time_constant_s])
        self._sample_s = sample_s
        self._gap_s = longest_gap_s(time_constant_s, sample_s)
        self._needed_s = needed_s(EXPONENTIAL_SPAN * time_constant_s, sample_s)
        self._start = self._last_time = self._last_x = self._state = float("nan")
        self._last_step = -1.0

    def push(self, time: FloatArray, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Values at the next samples, and where they are settled; both of shape (n,)."""
        from fogml.signals.recursions import lag_kernel

        values, settled = np.empty(len(x)), np.empty(len(x), dtype=np.bool_)
        if len(x) == 0:
            return values, settled
        starts = gap_starts(time, self._sample_s, self._gap_s).tolist()
        if not time[0] - self._last_time <= self._gap_s:
            self._start, self._last_time = time[0], float("nan")
        for low, high in zip([0, *starts], [*starts, len(x)]):
            if low:
                self._start, self._last_time = time[low], float("nan")
            part = slice(low, high)
            before = (self._last_time, self._last_x, self._state, self._last_step)
            values[part], self._state, self._last_step = lag_kernel(time[part], x[part], self._tau, *before)
            settled[part] = time[part] - self._start >= self._needed_s
            self._last_time, self._last_x = time[high - 1], x[high - 1]
        return values, settled


class Play:
    """Play operator, s = min(max(s, x - w), x + w): hysteresis that knows no time.

    It begins in the middle of its play at the first sample, and keeps its state over gaps. It is settled
    once x has been through twice the half width: then s no longer depends on where it began.

    Parameters
    ----------
    half_width
        Half width w, in the unit of x.

    Raises
    ------
    InputError
        If the half width is not a positive number.
    """

    def __init__(self, half_width: float) -> None:
        if not 0.0 < half_width < float("inf"):
            raise InputError(f"a play of half width {half_width:g}: a positive number was expected")
        self._half_width = half_width
        self._state, self._low, self._high = float("nan"), float("inf"), float("-inf")

    def push(self, time: FloatArray, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Values at the next samples, and where they are settled; both of shape (n,)."""
        from fogml.signals.recursions import play_kernel

        values, self._state = play_kernel(x, self._half_width, self._state)
        low = np.minimum(np.minimum.accumulate(x), self._low)
        high = np.maximum(np.maximum.accumulate(x), self._high)
        if len(x):
            self._low, self._high = low[-1], high[-1]
        return values, np.asarray(high - low >= 2.0 * self._half_width)
