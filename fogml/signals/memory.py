"""Operators that take samples in order: a lag and a play.

Each is an object that takes samples in order by `push`: a whole recording, blocks of it or one sample at a
time give the same numbers, because the state goes on between calls. Beside its values it tells where it is
*settled*: where what was before the first sample no longer matters.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.signals.clock import EXPONENTIAL_SPAN, check_window, gap_starts, longest_gap_s, needed_s


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
