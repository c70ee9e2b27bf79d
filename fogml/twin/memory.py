"""What effects remember of the past: lags, play operators, rates and sums that go on over blocks."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray

_NAN = float("nan")


class Memory:
    """States of recursions by key. A fresh one for a whole run; the same one from block to block.

    Keys name the effect and the quantity, so that two effects never share a state.
    """

    def __init__(self) -> None:
        self._states: dict[str, tuple[float, ...]] = {}
        self._histories: dict[str, tuple[FloatArray, FloatArray]] = {}

    def lag(self, key: str, time: FloatArray, x: FloatArray, time_constant: float | FloatArray) -> FloatArray:
        """First-order lag of x with a time constant [s], at rest before the first sample; shape (n,)."""
        from fogml.signals.recursions import lag_kernel

        if len(x) == 0:
            return np.empty(0)
        tau = np.atleast_1d(np.asarray(time_constant, dtype=np.float64))
        last_time, last_x, state = self._states.get(key, (_NAN, _NAN, _NAN))
        out, state = lag_kernel(time, np.asarray(x, dtype=np.float64), tau, last_time, last_x, state)
        self._states[key] = (float(time[-1]), float(x[-1]), float(state))
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
        takes neighbouring samples. The first sample has rate 0.
        """
        step_x, step_t = self._steps(key, time, x, window_s)
        return np.divide(60.0 * step_x, step_t, out=np.zeros(len(x)), where=step_t > 0.0)

    def difference(self, key: str, time: FloatArray, x: FloatArray, window_s: float) -> FloatArray:
        """Mean of x over the newest `window_s` less that over the window before, shape (n,).

        Windows cut by the start take what there is, halved; the first sample has difference 0.
        """
        return self._steps(key, time, x, window_s)[0]

    def _steps(
        self, key: str, time: FloatArray, x: FloatArray, window_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Difference of the two windows' means, and of their mean times [s]."""
        old_time, old_x = self._histories.get(key, (np.empty(0), np.empty(0)))
        all_time, all_x = np.concatenate([old_time, time]), np.concatenate([old_x, x])
        steps = _neighbours(all_time, all_x) if window_s <= 0.0 else _blocks(all_time, all_x, window_s)
        past = int(np.searchsorted(all_time, all_time[-1] - 2.0 * window_s)) if len(all_time) else 0
        # One sample more than the windows hold keeps the first rows after a border whole.
        keep = slice(max(0, min(past, len(all_time) - 1) - 1), None)
        self._histories[key] = (all_time[keep].copy(), all_x[keep].copy())
        return steps[0][len(old_time) :], steps[1][len(old_time) :]

    def total(self, key: str, increments: FloatArray) -> FloatArray:
        """Running sum of increments, shape (n,)."""
        (before,) = self._states.get(key, (0.0,))
        out = before + np.cumsum(increments)
        self._states[key] = (float(out[-1]) if len(out) else before,)
        return np.asarray(out)

    def previous(self, key: str, x: FloatArray) -> FloatArray:
        """x one sample earlier; the first sample stands in for the one before it; shape (n,)."""
        (before,) = self._states.get(key, (float(x[0]),))
        self._states[key] = (float(x[-1]),)
        return np.concatenate([[before], x[:-1]])


def _neighbours(time: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.diff(x, prepend=x[:1]), np.diff(time, prepend=time[:1])


def _blocks(time: FloatArray, x: FloatArray, window_s: float) -> tuple[FloatArray, FloatArray]:
    n = len(time)
    if n == 0:
        return np.empty(0), np.empty(0)
    tolerance = 1e-6 * (float(np.median(np.diff(time[:1000]))) if n > 1 else 1.0)
    shifted = time - time[0]
    sum_x = np.concatenate([[0.0], np.cumsum(x - x[0])])
    sum_t = np.concatenate([[0.0], np.cumsum(shifted)])
    stop = np.arange(1, n + 1)
    middle = np.searchsorted(shifted, shifted - window_s + tolerance, side="right")
    start = np.searchsorted(shifted, shifted - 2.0 * window_s + tolerance, side="right")
    middle = np.where(middle == start, (start + stop) // 2, middle)
    told = (stop > middle) & (middle > start)
    newest, before = np.maximum(stop - middle, 1), np.maximum(middle - start, 1)
    step_x = (sum_x[stop] - sum_x[middle]) / newest - (sum_x[middle] - sum_x[start]) / before
    step_t = (sum_t[stop] - sum_t[middle]) / newest - (sum_t[middle] - sum_t[start]) / before
    return np.where(told, step_x, 0.0), np.where(told, step_t, 0.0)
