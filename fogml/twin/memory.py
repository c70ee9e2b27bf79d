"""What effects remember of the past: lags, play operators, rates and sums that go on over blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from fogml.arrays import FloatArray

Kept = TypeVar("Kept")
_NAN = float("nan")


class Memory:
    """States of recursions by key. A fresh one for a whole run; the same one from block to block.

    Keys name the effect and the quantity, so that two effects never share a state.
    """

    def __init__(self) -> None:
        self._states: dict[str, tuple[float, ...]] = {}
        self._kept: dict[str, Any] = {}
        self._histories: dict[str, tuple[FloatArray, FloatArray]] = {}

    def lag(self, key: str, time: FloatArray, x: FloatArray, time_constant: float | FloatArray) -> FloatArray:
        """First-order lag of x with a time constant [s], at rest before the first sample; shape (n,)."""
        from fogml.signals.recursions import lag_kernel

        if len(x) == 0:
            return np.empty(0)
        tau = np.atleast_1d(np.asarray(time_constant, dtype=np.float64))
        before = self._states.get(key, (_NAN, _NAN, _NAN, -1.0))
        out, behind, step = lag_kernel(time, np.asarray(x, dtype=np.float64), tau, *before)
        self._states[key] = (float(time[-1]), float(x[-1]), float(behind), float(step))
        return np.asarray(out)

    def play(self, key: str, x: FloatArray, half_width: float) -> FloatArray:
        """Play operator of x with a half width in x's unit, centred at the first sample; shape (n,)."""
        from fogml.signals.recursions import play_kernel

        (state,) = self._states.get(key, (_NAN,))
        out, state = play_kernel(np.asarray(x, dtype=np.float64), half_width, state)
        self._states[key] = (float(state),)
        return np.asarray(out)

    def rate(self, key: str, time: FloatArray, x: FloatArray, window_s: float) -> FloatArray:
        """Rate of x per minute, shape (n,).

        The difference of `difference` over the distance of the two mean times. A window of 0 s
        takes neighbouring samples, and so does the first sample after a gap of two windows. The
        very first sample has rate 0.
        """
        step_x, step_t = self._steps(key, time, x, window_s)
        return np.divide(60.0 * step_x, step_t, out=np.zeros(len(step_x)), where=step_t > 0.0)

    def difference(
        self, key: str, time: FloatArray, x: FloatArray, window_s: float, *, whole: bool = False
    ) -> FloatArray:
        """Mean of x over the newest `window_s` less that over the window before, shape (n,).

        Means are over samples where those of the two windows lie a window apart. Where they do not, as at an
        interval that does not divide it, or about a gap, they are those of a course that is linear between
        samples. Windows cut by the start take what there is, halved; the first sample then has difference 0.

        With `whole` means are over samples throughout, and samples two windows apart have difference 0.
        """
        known_time, known_x = self._histories.get(key, (np.empty(0), np.empty(0)))
        step_x, step_t = self._steps(key, time, x, window_s)
        if whole:
            return np.where(step_t < 1.999999 * window_s, step_x, 0.0)
        apart = np.flatnonzero(np.abs(step_t - window_s) > 1e-8 * window_s)
        if len(apart):
            all_time, all_x = np.concatenate([known_time, time]), np.concatenate([known_x, x])
            past = time[apart] - all_time[0] >= (2.0 - 1e-8) * window_s
            cut, full = apart[~past], apart[past]
            step_x[cut] *= window_s / np.maximum(step_t[cut], window_s)
            if len(full):
                from fogml.signals.recursions import course_steps_kernel

                step_x[full] = course_steps_kernel(all_time, all_x, len(known_time) + full, window_s)
        return step_x

    def _steps(
        self, key: str, time: FloatArray, x: FloatArray, window_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Difference of the two windows' means, and of their mean times [s]."""
        old_time, old_x = self._histories.get(key, (np.empty(0), np.empty(0)))
        if len(time) == 0:
            return np.empty(0), np.empty(0)
        all_time = np.concatenate([old_time, time])
        all_x = np.concatenate([old_x, np.asarray(x, dtype=np.float64)])
        if window_s > 0.0:
            from fogml.signals.recursions import window_steps_kernel

            steps = window_steps_kernel(all_time, all_x, window_s, len(old_time))
        else:
            steps = _neighbours(all_time, all_x, len(old_time))
        past = int(np.searchsorted(all_time, all_time[-1] - 2.0 * window_s))
        # One sample more than the windows hold keeps the first rows after a border whole.
        keep = slice(max(0, min(past, len(all_time) - 1) - 1), None)
        self._histories[key] = (all_time[keep].copy(), all_x[keep].copy())
        return steps

    def total(self, key: str, increments: FloatArray) -> FloatArray:
        """Running sum of increments, shape (n,)."""
        (before,) = self._states.get(key, (0.0,))
        out = before + np.cumsum(increments)
        self._states[key] = (float(out[-1]) if len(out) else before,)
        return np.asarray(out)

    def previous(self, key: str, x: FloatArray, first: float | None = None) -> FloatArray:
        """x one sample earlier, shape (n,); before the first one it was `first`, or that sample if None."""
        if len(x) == 0:
            return np.empty(0)
        (before,) = self._states.get(key, (float(x[0]) if first is None else first,))
        self._states[key] = (float(x[-1]),)
        return np.concatenate([[before], x[:-1]])

    def least(self, key: str, x: FloatArray) -> FloatArray:
        """Smallest x so far, shape (n,)."""
        (before,) = self._states.get(key, (float("inf"),))
        out = np.minimum(before, np.minimum.accumulate(x))
        self._states[key] = (float(out[-1]) if len(out) else before,)
        return np.asarray(out)

    def recent(
        self, key: str, time: FloatArray, x: FloatArray, span_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Time and x of these samples and of those before them, back to `span_s` and one sample more."""
        old_time, old_x = self._histories.get(key, (np.empty(0), np.empty(0)))
        all_time, all_x = np.concatenate([old_time, time]), np.concatenate([old_x, x])
        if len(all_time):
            past = int(np.searchsorted(all_time, all_time[-1] - span_s)) - 1
            self._histories[key] = (all_time[max(past, 0) :].copy(), all_x[max(past, 0) :].copy())
        return all_time, all_x

    def generator(self, key: str, seed: int) -> np.random.Generator:
        """A generator of this name out of a seed's, which goes on from block to block."""
        from fogml.twin.noise import stream

        return self.kept(key, lambda: stream(seed, key))

    def kept(self, key: str, make: Callable[[], Kept]) -> Kept:
        """What `make` gave when this was first asked for, which goes on from block to block."""
        if key not in self._kept:
            self._kept[key] = make()
        found: Kept = self._kept[key]
        return found

    def slew(self, key: str, time: FloatArray, x: FloatArray, fastest: float) -> FloatArray:
        """What follows x no faster than `fastest` [per s], at the first sample with it; shape (n,)."""
        from fogml.signals.recursions import slew_kernel

        last_time, state = self._states.get(key, (_NAN, _NAN))
        if len(x) == 0:
            return np.empty(0)
        out = slew_kernel(time, np.asarray(x, dtype=np.float64), fastest, last_time, state)
        self._states[key] = (float(time[-1]), float(out[-1]))
        return np.asarray(out)

    def first(self, key: str, x: FloatArray) -> float:
        """The very first sample of x, of all blocks; NaN before there is one."""
        if len(x) and key not in self._states:
            self._states[key] = (float(x[0]),)
        return self._states.get(key, (_NAN,))[0]


def _neighbours(time: FloatArray, x: FloatArray, first: int) -> tuple[FloatArray, FloatArray]:
    before = slice(max(first - 1, 0), -1)
    steps = (x[max(first, 1) :] - x[before], time[max(first, 1) :] - time[before])
    return steps if first else (np.concatenate([[0.0], steps[0]]), np.concatenate([[0.0], steps[1]]))
