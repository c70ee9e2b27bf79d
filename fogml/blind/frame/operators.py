"""Linear memories that realities build on: a lag, and any fading one."""

from __future__ import annotations

from collections.abc import Callable

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
