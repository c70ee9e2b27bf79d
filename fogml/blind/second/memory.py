"""What remembers: relays of Preisach's plane, Maxwell's slip, Bouc and Wen's equation, fading memories.

Rate-independent ones are given the turning points before the run: they begin where the last run ended.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import FloatArray


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
        found = found - weight * _exponential(time, x, rate)
    return found


def _exponential(time: FloatArray, x: FloatArray, rate: float) -> FloatArray:
    step = float(time[1] - time[0])
    ratio = rate * step
    kept, mean = np.exp(-ratio), -np.expm1(-ratio) / ratio
    return np.asarray(lfilter([mean], [1.0, -kept], np.diff(x, prepend=x[0])))
