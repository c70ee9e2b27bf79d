"""The window operators sample by sample, in bounded memory.

Each has ``step(time_s, x) -> (value, full)`` and gives what its namesake in
`fogml.signals.windows` gives for the whole recording; the rules are told there.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

from fogml.signals.clock import (
    EDGE_TOLERANCE,
    EXPONENTIAL_SPAN,
    GAP_INTERVALS,
    check_window,
    longest_gap_s,
    needed_s,
)

_FEWEST_STEPS = 32


class WindowStream(Protocol):
    """A window operator that is fed one sample at a time."""

    def step(self, time_s: float, x: float) -> tuple[float, bool]:
        """Value after this sample, and whether its window is full (else the value is 0)."""
        ...


class BlockDifferenceStream:
    """`fogml.signals.windows.block_difference` sample by sample; parameters as there."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float | None = None) -> None:
        check_window(window_s, sample_s, 1, "a block window")
        self._window_s, self._unit_s = window_s, unit_s
        self._edge = EDGE_TOLERANCE * sample_s
        self._needed = needed_s(2.0 * window_s, sample_s)
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

    def step(self, time_s: float, x: float) -> tuple[float, bool]:
        """Value after this sample, and whether both windows are full."""
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
        while time_s - newest[0][0] >= self._window_s - self._edge:
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
        if not before or time_s - self._start < self._needed:
            return 0.0, False
        difference = self._newest_x / len(newest) - self._before_x / len(before)
        if self._unit_s is not None:
            difference *= self._unit_s / (self._newest_t / len(newest) - self._before_t / len(before))
        return difference, True


class SlopeStream:
    """`fogml.signals.windows.slope` sample by sample; parameters as there."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float | None = None) -> None:
        check_window(window_s, sample_s, 2, "a slope's window")
        self._window_s, self._unit_s = window_s, window_s if unit_s is None else unit_s
        self._edge = EDGE_TOLERANCE * sample_s
        self._needed = needed_s(window_s, sample_s)
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

    def step(self, time_s: float, x: float) -> tuple[float, bool]:
        """Value after this sample, and whether the window is full."""
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
        if len(held) < 2 or time_s - self._start < self._needed:
            return 0.0, False
        mean_t = self._sum_t / len(held)
        slope = (self._sum_tx - mean_t * self._sum_x) / (self._sum_tt - mean_t * self._sum_t)
        return self._unit_s * slope, True


class ExponentialStream:
    """`fogml.signals.windows.exponential` sample by sample; parameters as there."""

    def __init__(self, window_s: float, sample_s: float, unit_s: float | None = None) -> None:
        check_window(window_s, sample_s, 1, "a time constant")
        self._window_s, self._unit_s = window_s, window_s if unit_s is None else unit_s
        self._needed = needed_s(EXPONENTIAL_SPAN * window_s, sample_s)
        self._gap_s = longest_gap_s(window_s, sample_s)
        self._start = self._last = -math.inf
        self._x = self._rate = 0.0

    def step(self, time_s: float, x: float) -> tuple[float, bool]:
        """Value after this sample, and whether the window is full."""
        interval = time_s - self._last
        if interval > self._gap_s:
            self._start, self._rate = time_s, 0.0
        else:
            weight = -math.expm1(-interval / self._window_s)
            self._rate += weight * ((x - self._x) / interval - self._rate)
        self._last, self._x = time_s, x
        if interval > self._gap_s or time_s - self._start < self._needed:
            return 0.0, False
        return self._unit_s * self._rate, True


class FirstDifferenceStream:
    """`fogml.signals.windows.first_difference` sample by sample; parameters as there."""

    def __init__(self, sample_s: float, unit_s: float | None = None) -> None:
        self._longest_s, self._unit_s = GAP_INTERVALS * sample_s, unit_s
        self._last = -math.inf
        self._x = 0.0

    def step(self, time_s: float, x: float) -> tuple[float, bool]:
        """Value after this sample, and whether there is one to compare with."""
        interval, difference = time_s - self._last, x - self._x
        self._last, self._x = time_s, x
        if interval > self._longest_s:
            return 0.0, False
        return difference if self._unit_s is None else difference * self._unit_s / interval, True
