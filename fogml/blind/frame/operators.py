"""Memories that realities build on: lags, play, relays, slips, and any fading one.

Rate-independent ones are given the turning points before the run: they begin where the last run ended.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import FloatArray


def late(x: FloatArray, time_constant_s: float, step_s: float) -> FloatArray:
    """First-order lag of x, straight between samples and at rest before the first; shape (n,)."""
    if time_constant_s <= 1e-9 * step_s:
        return x
    ratio = step_s / time_constant_s
    kept = np.exp(-ratio)
    mean = -np.expm1(-ratio) / ratio
    y, _ = lfilter([1.0 - mean, mean - kept], [1.0, -kept], x, zi=[mean * x[0]])
    return np.asarray(y)


def faded(
    time: FloatArray,
    x: FloatArray,
    kernel: Callable[[FloatArray], FloatArray],
    hastened: FloatArray | None = None,
) -> FloatArray:
    """Integral of kernel(xi(t) - xi(s)) dx(s), at rest before the run; shape (n,).

    Parameters
    ----------
    kernel
        Of the material's own time [s], 1 at 0.
    hastened
        How many times faster that time runs than the clock's, shape (n,); 1 if None.
    """
    step = np.diff(time, prepend=2.0 * time[0] - time[1])
    own = np.cumsum(step * (np.ones_like(time) if hastened is None else hastened))
    grid = np.linspace(own[0], own[-1], 2 * len(time))
    change = np.diff(np.interp(grid, own, x), prepend=x[0])
    length = 2 * len(grid)
    answer = np.fft.rfft(change, length) * np.fft.rfft(kernel(grid - grid[0]), length)
    return np.interp(own, grid, np.fft.irfft(answer, length)[: len(grid)])


_DEEPEST = 300.0
"""Largest decay within a block, as an exponent; e to this still is a float."""


def recurrence(decay: FloatArray, drive: FloatArray, start: float) -> FloatArray:
    """x_k = exp(-decay_k) x_(k-1) + drive_k from x_(-1) = start, shape (n,).

    Parameters
    ----------
    decay
        Exponents, not negative, shape (n,).
    drive
        What each step adds, shape (n,).
    start
        The value before the first sample.
    """
    decay = np.minimum(decay, _DEEPEST)
    out = np.empty(len(drive))
    total = np.cumsum(decay)
    first = 0
    while first < len(drive):
        before = total[first - 1] if first else 0.0
        stop = max(int(np.searchsorted(total, before + _DEEPEST, side="right")), first + 1)
        depth = total[first:stop] - before
        out[first:stop] = np.exp(-depth) * (start + np.cumsum(np.exp(depth) * drive[first:stop]))
        start = float(out[stop - 1])
        first = stop
    return out


def lag(step_s: float, x: FloatArray, time_constant_s: float | FloatArray) -> FloatArray:
    """First-order lag of x, at rest at the first sample, exact for x linear between samples; shape (n,)."""
    tau = np.broadcast_to(np.asarray(time_constant_s, dtype=np.float64), x.shape)
    ratio = step_s / np.maximum(tau, 1e-9)
    kept = np.exp(-ratio)
    change = np.diff(x, prepend=x[:1])
    # With the departure q = x - y: dq/dt = -q / tau + dx/dt.
    departure = recurrence(ratio, change * (1.0 - kept) / ratio, 0.0)
    return np.asarray(x - departure)


def play(x: FloatArray, half_widths: FloatArray) -> FloatArray:
    """Play operators of x, centred at the first sample; shape (len(half_widths), n).

    A play is a running clip; clips compose into clips, so log2(n) doublings do it.
    """
    w = np.asarray(half_widths, dtype=np.float64)[:, None]
    low, high = x[None, :] - w, x[None, :] + w
    shift = 1
    while shift < x.size:
        # The later clip (low, high) after the earlier one: clip both bounds of the earlier.
        early_low, early_high = low[:, :-shift].copy(), high[:, :-shift].copy()
        late_low, late_high = low[:, shift:], high[:, shift:]
        low = np.concatenate([low[:, :shift], np.clip(early_low, late_low, late_high)], axis=1)
        high = np.concatenate([high[:, :shift], np.clip(early_high, late_low, late_high)], axis=1)
        shift *= 2
    return np.clip(np.broadcast_to(x[0], low.shape), low, high)


def bouc_wen(x: FloatArray, length: float) -> FloatArray:
    """Bouc-Wen's z with exponent 2 and beta = gamma, from 0 and within -1 to 1; shape (n,).

    ``dz/dx = 1 / length`` while z and the motion differ in sign, ``(1 - z**2) / length`` after: a line,
    then a hyperbolic tangent of the path. Solved in closed form from turn to turn of x.
    """
    change = np.diff(x, prepend=x[:1])
    direction = np.sign(change)
    # Samples at rest go on in the direction of the last motion.
    last = np.maximum.accumulate(np.where(direction != 0.0, np.arange(len(x)), 0))
    direction = direction[last]
    turns = np.flatnonzero(np.diff(direction)) + 1
    out = np.empty(len(x))
    z = 0.0
    for first, stop in zip([0, *turns.tolist()], [*turns.tolist(), len(x)]):
        sign = float(direction[first])
        start = z * sign
        # The path, measured from where z changes sign.
        at = start if start < 0.0 else float(np.arctanh(min(start, 1.0 - 1e-12)))
        path = at + np.cumsum(np.abs(change[first:stop])) / length
        out[first:stop] = sign * np.where(path < 0.0, path, np.tanh(path))
        z = float(out[stop - 1])
    return out


def preisach(
    x: FloatArray,
    centres: FloatArray,
    half_widths: FloatArray,
    weights: FloatArray,
    past: Sequence[float] = (),
) -> FloatArray:
    """Weighted sum of relays that go up at centre + half width and down at centre - half width; shape (n,).

    A relay that has met neither is down.
    """
    path = np.concatenate([np.asarray(past, dtype=np.float64), x])
    total = np.zeros(len(path))
    number = np.arange(len(path))
    for centre, half, weight in zip(centres.tolist(), half_widths.tolist(), weights.tolist()):
        up = np.maximum.accumulate(np.where(path >= centre + half, number, -1))
        down = np.maximum.accumulate(np.where(path <= centre - half, number, -1))
        total += weight * np.where(up > down, 1.0, -1.0)
    return total[len(past) :]


def maxwell_slip(
    x: FloatArray, stiffness: FloatArray, reach: Callable[[float], FloatArray], past: Sequence[float] = ()
) -> FloatArray:
    """Force of springs in parallel, each of which slips beyond a reach that depends on x itself; shape (n,).

    Parameters
    ----------
    stiffness
        Of each spring, shape (m,).
    reach
        Largest stretch of each spring at a value of x, shape (m,).
    """
    stretch = np.zeros(len(stiffness))
    path = [*past, *x.tolist()]
    out, last = np.empty(len(path)), path[0]
    for k, value in enumerate(path):
        most = reach(value)
        stretch = np.clip(stretch + (value - last), -most, most)
        out[k], last = stiffness @ stretch, value
    return out[len(past) :]


def bouc_wen_general(
    x: FloatArray, length: float, exponent: float, asymmetry: float, past: Sequence[float] = ()
) -> FloatArray:
    """dz/dx = (1 - |z|^n (1 - a + a sgn(dx z))) / length from 0, shape (n,).

    By Heun's rule in steps of x under a twentieth of the length.
    """
    path = [*past, *x.tolist()]
    out, z, last = np.empty(len(path)), 0.0, path[0]

    def slope(z: float, sign: float) -> float:
        toward = 1.0 if sign * z >= 0.0 else -1.0
        return (1.0 - min(abs(z), 1.5) ** exponent * (1.0 - asymmetry + asymmetry * toward)) / length

    for k, value in enumerate(path):
        change = value - last
        steps = max(int(np.ceil(20.0 * abs(change) / length)), 1)
        h, sign = change / steps, 1.0 if change >= 0.0 else -1.0
        for _ in range(steps if change else 0):
            first = slope(z, sign)
            z += 0.5 * h * (first + slope(z + h * first, sign))
        out[k], last = z, value
    return out[len(past) :]


def backlash(x: FloatArray, half_width: float, past: Sequence[float] = ()) -> FloatArray:
    """What is dragged along by x with a play of half a width either way; shape (n,)."""
    path = [*past, *x.tolist()]
    out, held = np.empty(len(path)), path[0]
    for k, value in enumerate(path):
        held = min(max(held, value - half_width), value + half_width)
        out[k] = held
    return out[len(past) :]


def slab_lag(time: FloatArray, x: FloatArray, time_constant_s: float, modes: int = 12) -> FloatArray:
    """The far, insulated face of a slab whose near face follows x; `time_constant_s` is L^2 / D."""
    found = x.copy()
    for k in range(modes):
        order = (k + 0.5) * np.pi
        rate = order**2 / time_constant_s
        weight = 2.0 * (-1.0) ** k / order
        # Each mode falls behind by what it has not yet taken up of each change.
        step = float(time[1] - time[0])
        ratio = rate * step
        kept, mean = np.exp(-ratio), -np.expm1(-ratio) / ratio
        found = found - weight * np.asarray(lfilter([mean], [1.0, -kept], np.diff(x, prepend=x[0])))
    return found
