"""Operators that take samples in order, in bounded memory: a lag, a play and the window operators.

The lag and the play take samples by `push`: a whole recording, blocks of it or one sample at a time give the
same numbers, because the state goes on between calls. Beside its values each tells where it is *settled*:
where what was before the first sample no longer matters.

The window operators have ``step(time_s, x) -> (value, full, counts)`` and give what their namesakes in
`fogml.signals.windows` give for the whole recording; the rules are told there.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.signals.clock import (
    EDGE_TOLERANCE,
    EXPONENTIAL_SPAN,
    LEAST_SHARE,
    check_window,
    counting_s,
    gap_starts,
    longest_gap_s,
    needed_s,
    told_share,
)


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
        self._start = self._last_time = self._last_x = self._behind = float("nan")
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
            before = (self._last_time, self._last_x, self._behind, self._last_step)
            values[part], self._behind, self._last_step = lag_kernel(time[part], x[part], self._tau, *before)
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


_FEWEST_STEPS = 32
Step = tuple[float, bool, bool]
_NOTHING: Step = (0.0, False, False)


class WindowStream(Protocol):
    """A window operator that is fed one sample at a time."""

    def step(self, time_s: float, x: float) -> Step:
        """Value after this sample, whether the window is full, and whether the value counts."""
        ...


class BlockDifferenceStream:
    """`fogml.signals.windows.block_difference` sample by sample; parameters as there."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float | None = None) -> None:
        check_window(window_s, sample_s, 1, "a block window")
        self._window_s, self._unit_s = window_s, unit_s
        self._edge = EDGE_TOLERANCE * sample_s
        self._needed = needed_s(2.0 * window_s, sample_s)
        self._counting = counting_s(2.0 * window_s, sample_s)
        self._gap_s = longest_gap_s(window_s, sample_s)
        self._start = self._last = -math.inf
        self._restart(0.0)

    def _restart(self, time_s: float) -> None:
        self._start = time_s
        self._newest: deque[tuple[float, float]] = deque()
        self._before: deque[tuple[float, float]] = deque()
        self._steps_left = 0

    def _sum_afresh(self, time_s: float, x: float) -> None:
        # Summing afresh once per window, about the newest sample, keeps running sums exact.
        self._time_0, self._x_0 = time_s, x
        self._newest_t = sum((t - time_s for t, _ in self._newest), 0.0)
        self._newest_x = sum((v - x for _, v in self._newest), 0.0)
        self._before_t = sum((t - time_s for t, _ in self._before), 0.0)
        self._before_x = sum((v - x for _, v in self._before), 0.0)
        self._steps_left = max(len(self._newest) + len(self._before), _FEWEST_STEPS)

    def step(self, time_s: float, x: float) -> Step:
        """Value after this sample, whether the window is full, and whether the value counts."""
        if time_s - self._last > self._gap_s:
            self._restart(time_s)
        self._last = time_s
        if self._steps_left == 0:
            self._sum_afresh(time_s, x)
        self._steps_left -= 1
        newest, before = self._newest, self._before
        newest.append((time_s, x))
        self._newest_t += time_s - self._time_0
        self._newest_x += x - self._x_0
        known = time_s - self._start
        filling = known < self._needed
        half = 0.5 * known if filling else self._window_s
        while before and time_s - before[-1][0] < half - self._edge:
            newest.appendleft(before.pop())
            t, v = newest[0][0] - self._time_0, newest[0][1] - self._x_0
            self._newest_t += t
            self._newest_x += v
            self._before_t -= t
            self._before_x -= v
        while len(newest) > 1 and time_s - newest[0][0] >= half - self._edge:
            t, v = newest.popleft()
            before.append((t, v))
            t, v = t - self._time_0, v - self._x_0
            self._newest_t -= t
            self._newest_x -= v
            self._before_t += t
            self._before_x += v
        while before and time_s - before[0][0] >= 2.0 * self._window_s - self._edge:
            t, v = before.popleft()
            self._before_t -= t - self._time_0
            self._before_x -= v - self._x_0
        if not before:
            return _NOTHING
        difference = self._newest_x / len(newest) - self._before_x / len(before)
        if self._unit_s is not None or filling:
            unit_s = self._window_s if self._unit_s is None else self._unit_s
            difference *= unit_s / (self._newest_t / len(newest) - self._before_t / len(before))
        return _told(difference, known, self._needed, self._counting, 2.0 * self._window_s)


class SlopeStream:
    """`fogml.signals.windows.slope` sample by sample; parameters as there."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float | None = None) -> None:
        check_window(window_s, sample_s, 2, "a slope's window")
        self._window_s, self._unit_s = window_s, window_s if unit_s is None else unit_s
        self._edge = EDGE_TOLERANCE * sample_s
        self._needed, self._counting = needed_s(window_s, sample_s), counting_s(window_s, sample_s)
        self._gap_s = longest_gap_s(window_s, sample_s)
        self._start = self._last = -math.inf
        self._restart(0.0)

    def _restart(self, time_s: float) -> None:
        self._start = time_s
        self._held: deque[tuple[float, float]] = deque()
        self._steps_left = 0

    def _sum_afresh(self, time_s: float, x: float) -> None:
        self._time_0, self._x_0 = time_s, x
        self._sum_t = self._sum_tt = self._sum_x = self._sum_tx = 0.0
        for held in self._held:
            self._add(held, 1.0)
        self._steps_left = max(len(self._held), _FEWEST_STEPS)

    def _add(self, sample: tuple[float, float], sign: float) -> None:
        t, v = sample[0] - self._time_0, sample[1] - self._x_0
        self._sum_t += sign * t
        self._sum_tt += sign * t * t
        self._sum_x += sign * v
        self._sum_tx += sign * t * v

    def step(self, time_s: float, x: float) -> Step:
        """Value after this sample, whether the window is full, and whether the value counts."""
        if time_s - self._last > self._gap_s:
            self._restart(time_s)
        self._last = time_s
        if self._steps_left == 0:
            self._sum_afresh(time_s, x)
        self._steps_left -= 1
        held = self._held
        held.append((time_s, x))
        self._add(held[-1], 1.0)
        while time_s - held[0][0] >= self._window_s - self._edge:
            self._add(held.popleft(), -1.0)
        if len(held) < 2:
            return _NOTHING
        mean_t = self._sum_t / len(held)
        slope = (self._sum_tx - mean_t * self._sum_x) / (self._sum_tt - mean_t * self._sum_t)
        known = time_s - self._start
        return _told(self._unit_s * slope, known, self._needed, self._counting, self._window_s)


class ExponentialStream:
    """`fogml.signals.windows.exponential` sample by sample; parameters as there."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float | None = None) -> None:
        check_window(window_s, sample_s, 1, "a time constant")
        self._window_s, self._unit_s = window_s, window_s if unit_s is None else unit_s
        self._needed = needed_s(EXPONENTIAL_SPAN * window_s, sample_s)
        self._counting = counting_s(EXPONENTIAL_SPAN * window_s, sample_s)
        self._gap_s = longest_gap_s(window_s, sample_s)
        self._start = self._last = -math.inf
        self._x = self._rate = 0.0

    def step(self, time_s: float, x: float) -> Step:
        """Value after this sample, whether the window is full, and whether the value counts."""
        interval = time_s - self._last
        if interval > self._gap_s:
            self._start, self._rate = time_s, 0.0
        else:
            weight = -math.expm1(-interval / self._window_s)
            self._rate += weight * ((x - self._x) / interval - self._rate)
        self._last, self._x = time_s, x
        if interval > self._gap_s:
            return _NOTHING
        known = time_s - self._start
        return self._unit_s * self._rate, known >= self._needed, known >= self._counting


class FirstDifferenceStream:
    """`fogml.signals.windows.first_difference` sample by sample; parameters as there."""

    def __init__(self, sample_s: float, unit_s: float | None = None) -> None:
        self._longest_s, self._unit_s = longest_gap_s(0.0, sample_s), unit_s
        self._last = -math.inf
        self._x = 0.0

    def step(self, time_s: float, x: float) -> Step:
        """Value after this sample, whether the window is full, and whether the value counts."""
        interval, difference = time_s - self._last, x - self._x
        self._last, self._x = time_s, x
        if interval > self._longest_s:
            return _NOTHING
        return difference if self._unit_s is None else difference * self._unit_s / interval, True, True


def _told(value: float, known: float, needed: float, counting: float, span: float) -> Step:
    """A value of a window that is full, or fills: what it tells there, and whether it counts."""
    if known >= needed:
        return value, True, True
    return told_share(known / span, LEAST_SHARE) * value, False, known >= counting
