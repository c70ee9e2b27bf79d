"""Recurrences over samples without a loop over samples: lags, play operators, paths between turns."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray

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
