"""Differences and rates over causal time windows, with true times and gaps.

Every operator looks back from each sample, the newest sample included, and gives one value per
sample, and masks of the samples whose window was full and whose value counts.

The rules, shared by all:

- A window of w seconds at time t holds the samples in (t - w, t]. Its edges forgive float noise
  of 1e-6 sample intervals.
- A *gap* is an interval longer than three sample intervals. A gap longer than a quarter of the
  window restarts the operator, a shorter one is spanned with true times.
- A window is full once the time since the start, or since the last restart, reaches its span less
  one sample interval: 2w for `block_difference`, w for `slope`, three time constants for
  `exponential`, one earlier sample for `first_difference`.
- From the second sample on a window that is not full gives what is there: `block_difference` halves it,
  `slope` draws its line through it, both times `told_share` of the share that is there; `exponential`
  begins at rate 0. It counts from an eighth of its span on (`LEAST_SHARE`).

Each operator gives a difference (``unit_s=None``, in the unit of x), or a rate per ``unit_s``
seconds (60: per minute).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.signals.clock import (
    EDGE_TOLERANCE,
    EXPONENTIAL_SPAN,
    LEAST_SHARE,
    Clock,
    check_window,
    counting_s,
    longest_gap_s,
    needed_s,
    told_share,
)

_CHUNK = 1 << 15


class Windowed(NamedTuple):
    """What a window operator gives at n samples.

    Attributes
    ----------
    values
        Differences or rates, shape (n,); 0 at the first sample, and after a gap.
    full
        Where the window is full, shape (n,).
    counts
        Where what the window holds counts, shape (n,).
    """

    values: FloatArray
    full: BoolArray
    counts: BoolArray


def block_difference(
    time: ArrayLike | Clock,
    x: ArrayLike,
    window_s: float,
    sample_s: float | None = None,
    *,
    unit_s: float | None = None,
    out: FloatArray | None = None,
) -> Windowed:
    """Mean of the newest window less the mean of the window before it.

    The newest is (t - w, t], the one before is (t - 2w, t - w]. As a rate, the difference is
    divided by the difference of the two windows' mean sample times.

    Parameters
    ----------
    time
        Sample times [s], shape (n,), strictly increasing; or a `Clock`.
    x
        Values, shape (n,).
    window_s
        Length w of each of the two windows [s].
    sample_s
        Nominal sample interval [s]; the median interval if None. A `Clock` brings its own.
    unit_s
        None for the difference itself, or the length [s] of the time unit of a rate.
    out
        Where the values are put, shape (n,), contiguous; a new array if None.

    Raises
    ------
    InputError
        If the window is shorter than the sample interval.

    Notes
    -----
    On a regular grid sums are made of sums of half as many samples each, so the error stays at a
    few units in the last place however long the recording. Elsewhere running sums are taken afresh
    once per window.
    """
    clock, x = _prepared(time, x, sample_s)
    check_window(window_s, clock.sample_s, 1, "a block window")
    grid = clock.grid_s
    if grid is not None:
        return _block_on_grid(x, grid, clock.sample_s, window_s, unit_s, out)
    from fogml.signals.window_kernels import block_kernel

    return _run_kernel(block_kernel, clock, x, window_s, 2.0 * window_s, unit_s or 0.0, out)


def slope(
    time: ArrayLike | Clock,
    x: ArrayLike,
    window_s: float,
    sample_s: float | None = None,
    *,
    unit_s: float | None = None,
    out: FloatArray | None = None,
) -> Windowed:
    """Least-squares slope over the window (t - w, t].

    Parameters and results are those of `block_difference`. As a difference (``unit_s=None``) it
    is the change of the fitted line over the window's length.

    Raises
    ------
    InputError
        If the window is shorter than two sample intervals.
    """
    clock, x = _prepared(time, x, sample_s)
    check_window(window_s, clock.sample_s, 2, "a slope's window")
    from fogml.signals.window_kernels import slope_kernel

    return _run_kernel(slope_kernel, clock, x, window_s, window_s, unit_s or window_s, out)


def exponential(
    time: ArrayLike | Clock,
    x: ArrayLike,
    window_s: float,
    sample_s: float | None = None,
    *,
    unit_s: float | None = None,
    out: FloatArray | None = None,
) -> Windowed:
    r"""Rate with exponential memory: :math:`r(t) = (x - m)/\tau` with :math:`\dot m = (x - m)/\tau`.

    Parameters and results are those of `block_difference`; `window_s` is the time constant. As a
    difference (``unit_s=None``) it is x less its lagged mean m.

    Between samples x is taken as a straight line, for which the recurrence

    .. math:: r_i = e^{-h/\tau} r_{i-1} + (1 - e^{-h/\tau}) (x_i - x_{i-1})/h

    with the true interval h is exact: a steady ramp gives its rate, whatever the sampling. It
    begins at rate 0.

    Raises
    ------
    InputError
        If the time constant is shorter than the sample interval.
    """
    clock, x = _prepared(time, x, sample_s)
    check_window(window_s, clock.sample_s, 1, "a time constant")
    from fogml.signals.window_kernels import exponential_kernel

    return _run_kernel(
        exponential_kernel, clock, x, window_s, EXPONENTIAL_SPAN * window_s, unit_s or window_s, out
    )


def first_difference(
    time: ArrayLike | Clock,
    x: ArrayLike,
    sample_s: float | None = None,
    *,
    unit_s: float | None = None,
    out: FloatArray | None = None,
) -> Windowed:
    """Each sample less the one before it, never across a gap.

    Parameters and results are those of `block_difference`; there is no window.
    """
    clock, x = _prepared(time, x, sample_s)
    n = len(x)
    values, full = np.empty(n) if out is None else out, np.ones(n, dtype=np.bool_)
    values[:1], full[:1] = 0.0, False
    if n < 2:
        return Windowed(values, full, full)
    np.subtract(x[1:], x[:-1], out=values[1:])
    grid = clock.grid_s
    if grid is not None:
        if unit_s is not None:
            values *= unit_s / grid
        return Windowed(values, full, full)
    interval = np.diff(clock.time)
    np.less_equal(interval, longest_gap_s(0.0, clock.sample_s), out=full[1:])
    if unit_s is not None:
        values[1:] *= unit_s / interval
    values[~full] = 0.0
    return Windowed(values, full, full)


def _prepared(time: ArrayLike | Clock, x: ArrayLike, sample_s: float | None) -> tuple[Clock, FloatArray]:
    clock = time if isinstance(time, Clock) else Clock(time, sample_s)
    values = np.ascontiguousarray(x, dtype=np.float64)
    if values.shape != clock.time.shape:
        raise InputError(f"window operator: {values.shape} values for {clock.time.shape} sample times")
    return clock, values


def _run_kernel(
    kernel: Callable[..., None],
    clock: Clock,
    x: FloatArray,
    window_s: float,
    span_s: float,
    unit_s: float,
    out: FloatArray | None,
) -> Windowed:
    """What a compiled operator gives whose window is full after `span_s`."""
    values = np.zeros(len(x)) if out is None else out
    full, counts = np.zeros((2, len(x)), dtype=np.bool_)
    if out is not None:
        out[:] = 0.0
    sample_s = clock.sample_s
    rules = (EDGE_TOLERANCE * sample_s, needed_s(span_s, sample_s), longest_gap_s(window_s, sample_s))
    kernel(clock.time, x, window_s, span_s, *rules, LEAST_SHARE, unit_s, values, full, counts)
    return Windowed(values, full, counts)


def _filling_on_grid(
    x: FloatArray, grid_s: float, span_s: float, unit_s: float
) -> tuple[FloatArray, BoolArray]:
    """Block rates over the halves of what is there, at the first n samples, and where they count."""
    known = np.arange(len(x))
    newest = np.maximum((known + 1) // 2, 1)
    sums = np.append(0.0, np.cumsum(x - x[:1]))
    in_newest = sums[known + 1] - sums[known + 1 - newest]
    before = np.maximum(known + 1 - newest, 1)
    difference = in_newest / newest - (sums[known + 1] - in_newest) / before
    share = np.multiply(known, grid_s / span_s, dtype=np.float64)
    told = told_share(share, LEAST_SHARE) * difference * (unit_s / (0.5 * grid_s * (known + 1)))
    return np.where(known > 0, told, 0.0), known * grid_s >= counting_s(span_s, grid_s)


def _block_on_grid(
    x: FloatArray,
    grid_s: float,
    sample_s: float,
    window_s: float,
    unit_s: float | None,
    out: FloatArray | None,
) -> Windowed:
    """Block differences by index arithmetic, chunk by chunk in the processor's cache."""
    n = len(x)
    edge = EDGE_TOLERANCE * sample_s
    newest = int(np.ceil((window_s - edge) / grid_s))
    both = int(np.ceil((2.0 * window_s - edge) / grid_s))
    before = both - newest
    values = np.empty(n) if out is None else out
    full, counts = np.ones((2, n), dtype=np.bool_)
    filling = slice(0, both - 1)
    unit = window_s if unit_s is None else unit_s
    values[filling], counts[filling] = _filling_on_grid(x[filling], grid_s, 2.0 * window_s, unit)
    full[filling] = False
    # The two windows' mean times lie half of both counts apart.
    scale = 1.0 if unit_s is None else unit_s / (0.5 * both * grid_s)
    step = max(_CHUNK, 4 * both)
    part = np.empty(min(step + both, n))
    scratch = np.empty((3, len(part)))
    for low in range(both - 1, n, step):
        high = min(low + step, n)
        block, origin = values[low:high], low - both + 1
        if before == newest:
            # Differences first: sums are then small, and one of them is enough.
            size = len(block) + newest - 1
            apart = np.subtract(x[high - size : high], x[origin : origin + size], out=part[:size])
            np.multiply(_window_sums(apart, newest, scratch), scale / newest, out=block)
            continue
        # About the first sample, a steady signal gives 0 whatever its value.
        near = np.subtract(x[origin:high], x[origin], out=part[: high - origin])
        sums = _window_sums(near, newest, scratch)
        np.multiply(sums[before:], scale / newest, out=block)
        earlier = _window_sums(near, before, scratch)[: len(block)]
        earlier *= scale / before
        block -= earlier
    return Windowed(values, full, counts)


def _window_sums(x: FloatArray, count: int, scratch: FloatArray) -> FloatArray:
    """Sums of `count` neighbouring samples, shape (n - count + 1,), within `scratch` of shape (3, n).

    Sums of 1, 2, 4 ... samples are each made of two of half as many; those in the binary digits of
    `count` add up to the whole. That takes O(n log count) additions of which none waits for the one
    before it, as in cumulative sums, and rounding grows with log count only.
    """
    doubled, total, summed = x, scratch[2], 0
    for digit in range(count.bit_length()):
        width = 1 << digit
        if digit > 0:
            half, size = width // 2, len(doubled) - width // 2
            doubled = np.add(doubled[:size], doubled[half:], out=scratch[digit % 2, :size])
        if width == count:
            return doubled
        if count & width:
            size = len(doubled) - summed
            # Those that are summed already come first.
            total = total[:size]
            np.add(total if summed else 0.0, doubled[summed:], out=total)
            summed += width
    return total
