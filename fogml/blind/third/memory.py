"""What remembers here: Duhem's loops, plays with a dead zone, creep by Eyring's law, fractional strain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.blind.frame.record import FloatArray


def duhem(x: FloatArray, quickness: float, knee: float, past: Sequence[float] = ()) -> FloatArray:
    """Coleman and Hodgdon's loop: dz = a |dx| (tanh(x / knee) - z) about the path's middle; shape (n,).

    Exact for each step with the anhysteretic curve taken at its middle.
    """
    path = [*past, *x.tolist()]
    about = 20.0
    out, last = np.empty(len(path)), path[0]
    z = float(np.tanh((last - about) / knee))
    for k, value in enumerate(path):
        curve = float(np.tanh((0.5 * (value + last) - about) / knee))
        z = curve + (z - curve) * float(np.exp(-quickness * abs(value - last)))
        out[k], last = z, value
    return out[len(past) :]


def dead_zone_plays(
    x: FloatArray, half_widths: FloatArray, weights: FloatArray, dead: float, past: Sequence[float] = ()
) -> FloatArray:
    """Plays whose sum is felt above a threshold alone: loops of unlike sides (Kuhnen); shape (n,)."""
    path = np.concatenate([np.asarray(past, dtype=np.float64), x])
    held = np.full(len(half_widths), path[0])
    total = np.empty(len(path))
    for k, value in enumerate(path.tolist()):
        held = np.minimum(np.maximum(held, value - half_widths), value + half_widths)
        total[k] = weights @ held
    mixed = total - 20.0
    return (mixed + 0.7 * np.maximum(mixed - dead, 0.0))[len(past) :]


def eyring(time: FloatArray, x: FloatArray, time_constant_s: float, stress: float) -> FloatArray:
    """Strain q with dq/dt = dx/dt - (s / tau) sinh(q / s), from 0; shape (n,).

    Each step lets q decay exactly by the law's own solution, then adds the change of x.
    """
    step = float(time[1] - time[0]) / time_constant_s
    kept, change = float(np.exp(-step)), np.diff(x, prepend=x[0])
    out, q = np.empty(len(x)), 0.0
    for k, added in enumerate(change.tolist()):
        # tanh(q / 2 s) decays exponentially under this law.
        half = np.tanh(np.clip(0.5 * q / stress, -15.0, 15.0)) * kept
        q = 2.0 * stress * float(np.arctanh(half)) + added
        out[k] = q
    return out
