"""Compiled loops of the window operators, for times off a regular grid.

Each fills `values`, `full` and `counts`, which come in zeroed. `span_s` is what a window reaches over,
`edge_s` the noise forgiven at its edges, `needed_s` the time from a restart until it is full, `gap_s` the
longest interval that may be spanned, all in seconds, and `least` the share of its span from which on a
window that fills counts; `fogml.signals.windows` tells the rules. They are arguments, not constants,
because compiled code is kept on disk and would not notice a change of another module.
"""

from __future__ import annotations

import math

from numba import boolean, float64, types

from fogml.arrays import BoolArray, FloatArray
from fogml.signals.clock import told_share
from fogml.signals.compiled import kernel

# Declared read-only, the inputs take both the frozen columns of a run and ordinary arrays.
_INPUT = types.Array(float64, 1, "C", readonly=True)
_KERNEL = types.void(
    _INPUT,
    _INPUT,
    float64,
    float64,
    float64,
    float64,
    float64,
    float64,
    float64,
    types.Array(float64, 1, "C"),
    types.Array(boolean, 1, "C"),
    types.Array(boolean, 1, "C"),
)
_FEWEST_STEPS = 32
told = kernel("float64(float64, float64)")(told_share)


@kernel(_KERNEL)
def block_kernel(
    time: FloatArray,
    x: FloatArray,
    window_s: float,
    span_s: float,
    edge_s: float,
    needed_s: float,
    gap_s: float,
    least: float,
    unit_s: float,
    values: FloatArray,
    full: BoolArray,
    counts: BoolArray,
) -> None:
    """Newest mean less the mean before; divided by their time distance where unit_s > 0.

    While the windows fill, each is half of what is there, and a difference is the rate times their length.
    """
    start = newest = before = afresh = 0
    time_0 = x_0 = 0.0
    newest_t = newest_x = before_t = before_x = 0.0
    for i in range(len(time)):
        if i > 0 and time[i] - time[i - 1] > gap_s:
            start = newest = before = afresh = i
        if i >= afresh:
            # Summing afresh once per window, about the newest sample, keeps running sums exact.
            time_0, x_0 = time[i], x[i]
            newest_t = newest_x = before_t = before_x = 0.0
            for j in range(before, newest):
                before_t += time[j] - time_0
                before_x += x[j] - x_0
            for j in range(newest, i):
                newest_t += time[j] - time_0
                newest_x += x[j] - x_0
            afresh = i + max(i - before, _FEWEST_STEPS)
        newest_t += time[i] - time_0
        newest_x += x[i] - x_0
        known = time[i] - time[start]
        half = window_s if known >= needed_s else 0.5 * known
        while newest > before and time[i] - time[newest - 1] < half - edge_s:
            newest -= 1
            newest_t += time[newest] - time_0
            newest_x += x[newest] - x_0
            before_t -= time[newest] - time_0
            before_x -= x[newest] - x_0
        while time[i] - time[newest] >= half - edge_s and newest < i:
            newest_t -= time[newest] - time_0
            newest_x -= x[newest] - x_0
            before_t += time[newest] - time_0
            before_x += x[newest] - x_0
            newest += 1
        while time[i] - time[before] >= 2.0 * window_s - edge_s:
            before_t -= time[before] - time_0
            before_x -= x[before] - x_0
            before += 1
        if newest > before:
            in_newest, in_before = i - newest + 1, newest - before
            difference = newest_x / in_newest - before_x / in_before
            full[i] = known >= needed_s
            if unit_s > 0.0 or not full[i]:
                unit = unit_s if unit_s > 0.0 else window_s
                difference *= unit / (newest_t / in_newest - before_t / in_before)
            if full[i]:
                values[i], counts[i] = difference, True
            else:
                share = known / span_s
                values[i], counts[i] = told(share, least) * difference, known >= least * span_s - edge_s


@kernel(_KERNEL)
def slope_kernel(
    time: FloatArray,
    x: FloatArray,
    window_s: float,
    span_s: float,
    edge_s: float,
    needed_s: float,
    gap_s: float,
    least: float,
    unit_s: float,
    values: FloatArray,
    full: BoolArray,
    counts: BoolArray,
) -> None:
    """Least-squares slope over the window, times unit_s."""
    start = oldest = afresh = 0
    time_0 = x_0 = 0.0
    sum_t = sum_tt = sum_x = sum_tx = 0.0
    for i in range(len(time)):
        if i > 0 and time[i] - time[i - 1] > gap_s:
            start = oldest = afresh = i
        if i >= afresh:
            time_0, x_0 = time[i], x[i]
            sum_t = sum_tt = sum_x = sum_tx = 0.0
            for j in range(oldest, i):
                t, v = time[j] - time_0, x[j] - x_0
                sum_t += t
                sum_tt += t * t
                sum_x += v
                sum_tx += t * v
            afresh = i + max(i - oldest, _FEWEST_STEPS)
        t, v = time[i] - time_0, x[i] - x_0
        sum_t += t
        sum_tt += t * t
        sum_x += v
        sum_tx += t * v
        while time[i] - time[oldest] >= window_s - edge_s:
            t, v = time[oldest] - time_0, x[oldest] - x_0
            sum_t -= t
            sum_tt -= t * t
            sum_x -= v
            sum_tx -= t * v
            oldest += 1
        count = i - oldest + 1
        if count > 1:
            known = time[i] - time[start]
            mean_t = sum_t / count
            slope = unit_s * (sum_tx - mean_t * sum_x) / (sum_tt - mean_t * sum_t)
            full[i] = known >= needed_s
            if full[i]:
                values[i], counts[i] = slope, True
            else:
                share = known / span_s
                values[i], counts[i] = told(share, least) * slope, known >= least * span_s - edge_s


@kernel(_KERNEL)
def exponential_kernel(
    time: FloatArray,
    x: FloatArray,
    window_s: float,
    span_s: float,
    edge_s: float,
    needed_s: float,
    gap_s: float,
    least: float,
    unit_s: float,
    values: FloatArray,
    full: BoolArray,
    counts: BoolArray,
) -> None:
    """Exponentially remembered rate with time constant window_s, times unit_s."""
    start = 0
    rate = 0.0
    last_interval = weight = 0.0
    for i in range(1, len(time)):
        interval = time[i] - time[i - 1]
        if interval > gap_s:
            start = i
            rate = 0.0
            continue
        if interval != last_interval:
            last_interval = interval
            weight = -math.expm1(-interval / window_s)
        rate += weight * ((x[i] - x[i - 1]) / interval - rate)
        known = time[i] - time[start]
        values[i], full[i] = unit_s * rate, known >= needed_s
        counts[i] = known >= least * span_s - edge_s


__all__ = ["block_kernel", "exponential_kernel", "slope_kernel"]
