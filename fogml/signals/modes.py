"""Linear systems as sums of decaying modes: exact at any step for inputs linear between samples.

::

    dz/dt = -rates * z + gains @ inputs(t) + source_gains * source(t)

`source` is nonzero in windows only: a steady part and a part that fades from each window's start.
A constant of the system may change at a sample; the states then go over in full.
"""

from __future__ import annotations

import math

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.signals.compiled import kernel

_CHUNK = 512
_INVERSE_FACTORIALS = np.array([1.0 / math.factorial(k) for k in range(11)])


@kernel()
def phi_functions(x: float) -> tuple[float, float, float]:
    """exp(-x), phi_1 = (1 - exp(-x)) / x and phi_2 = (1 - phi_1) / x, exact to rounding for x >= 0.

    phi_1 is the response of a mode to a constant input of 1 over one step, phi_2 to an input that
    ramps from 0 to 1, both per step.
    """
    if x > 0.05:
        fall = math.expm1(-x)
        return 1.0 + fall, -fall / x, (1.0 + fall / x) / x
    # The closed forms cancel here: phi_2 = 1/2! - x/3! + x^2/4! - ...
    phi_2 = _INVERSE_FACTORIALS[10]
    for k in range(9, 1, -1):
        phi_2 = _INVERSE_FACTORIALS[k] - x * phi_2
    phi_1 = 1.0 - x * phi_2
    return 1.0 - x * phi_1, phi_1, phi_2


@kernel()
def held(rate: float, step: float) -> float:
    """Response after `step` to a constant input of 1: (1 - exp(-rate step)) / rate."""
    return step * phi_functions(rate * step)[1]


@kernel()
def faded(rate: float, fade_rate: float, step: float) -> float:
    """Response after `step` to exp(-fade_rate t); no cancellation where the two rates meet."""
    slow, apart = min(rate, fade_rate), abs(rate - fade_rate)
    return math.exp(-slow * step) * held(apart, step)


@kernel()
def windowed(
    rate: float, start: float, stop: float, on: float, off: float, source: tuple[float, float, float]
) -> float:
    """Response at `stop` to the source's window [on, off], as far as it lies after `start`.

    `source` is (steady, fading, fade_rate): steady + fading exp(-fade_rate (t - on)).
    """
    begin, end = max(on, start), min(off, stop)
    if not end > begin:
        return 0.0
    steady, fading, fade_rate = source
    if math.isinf(begin):
        response = steady / rate
    else:
        response = steady * held(rate, end - begin)
        if fading != 0.0 and not math.isinf(on):
            response += fading * math.exp(-fade_rate * (begin - on)) * faded(rate, fade_rate, end - begin)
    return response * math.exp(-rate * (stop - end))


@kernel()
def _same(this: float, step: float, time: float) -> bool:
    """Whether two steps differ by the clock's rounding at most."""
    return abs(this - step) <= 1e-15 * abs(time)


@kernel()
def _product(matrix: FloatArray, x: FloatArray, out: FloatArray) -> None:
    for i in range(len(out)):
        out[i] = 0.0
        for j in range(len(x)):
            out[i] += matrix[i, j] * x[j]


@kernel()
def modes_kernel(
    time: FloatArray,
    inputs: FloatArray,
    level: IntArray,
    rates: FloatArray,
    gains: FloatArray,
    source_gains: FloatArray,
    source: tuple[float, float, float],
    windows: FloatArray,
    to_modes: FloatArray,
    to_states: FloatArray,
    readings: FloatArray,
    feed: FloatArray,
    states: FloatArray,
    last_time: float,
    last_inputs: FloatArray,
    last_level: int,
    last_step: float,
    out: FloatArray,
) -> float:
    """Readings of a system of m modes over n samples, k inputs, p readings and l levels.

    Parameters
    ----------
    time, inputs
        Time [s], shape (n,), and inputs, shape (k, n).
    level
        Which constants hold from a sample on, shape (n,) or (1,) for the same throughout.
    rates, gains, source_gains
        Constants of the modes [1/s], shapes (l, m), (l, m, k) and (l, m).
    source, windows
        Steady part, fading part and fade rate; windows [on, off] in time order, shape (w, 2).
    to_modes, to_states
        From states to modes and back, shape (l, m, m).
    readings, feed
        Readings from the modes, shape (l, m, p), and straight from the inputs, shape (k, p).
    states
        States at `last_time`, shape (m,); overwritten by those at the last sample.
    last_time, last_inputs, last_level, last_step
        The sample before the first one. Where `last_time` is NaN the states are those at the
        first sample.
    out
        Takes the readings, shape (p, n).

    Returns
    -------
    float
        The step in use at the end [s], for `last_step` of the next block.
    """
    n, k, m, p = len(time), inputs.shape[0], rates.shape[1], readings.shape[2]
    steady, fading, fade_rate = source
    now = last_level
    z = np.empty(m)
    _product(to_modes[now], states, z)
    before_t, before = last_time, last_inputs.copy()
    decay, whole, fade = np.empty(m), np.empty(m), np.zeros(m)
    old, new = np.empty((k, m)), np.empty((k, m))
    modes, source_now = np.empty((m, _CHUNK)), np.empty(_CHUNK)
    step, known = last_step, False
    window, i = 0, 0
    while i < n:
        stop = i + 1
        if math.isnan(before_t):
            for j in range(m):
                modes[j, 0] = z[j]
        else:
            if not _same(time[i] - before_t, step, time[i]):
                step, known = time[i] - before_t, False
            if not known:
                for j in range(m):
                    decay[j], phi_1, phi_2 = phi_functions(rates[now, j] * step)
                    whole[j] = source_gains[now, j] * step * phi_1
                    if fading != 0.0:
                        fade[j] = source_gains[now, j] * faded(rates[now, j], fade_rate, step)
                    for c in range(k):
                        old[c, j] = gains[now, j, c] * step * (phi_1 - phi_2)
                        new[c, j] = gains[now, j, c] * step * phi_2
                known = True
            while window < len(windows) and windows[window, 1] <= before_t:
                window += 1
            # Samples that can go together: same step, same constants, source on or off throughout.
            until, lit = math.inf, False
            if window < len(windows):
                lit = windows[window, 0] <= before_t
                until = windows[window, 1] if lit else windows[window, 0]
            switching = until < time[i]
            if not switching:
                last = min(n, i + _CHUNK)
                while (
                    stop < last
                    and time[stop] <= until
                    and (len(level) == 1 or level[stop - 1] == now)
                    and _same(time[stop] - time[stop - 1], step, time[stop])
                ):
                    stop += 1
            if lit and not switching:
                left = fading * math.exp(-fade_rate * (before_t - windows[window, 0]))
                fades = math.exp(-fade_rate * step)
                for s in range(stop - i):
                    source_now[s] = left
                    left *= fades
            for j in range(m):
                mode = modes[j]
                mode[: stop - i] = 0.0
                for c in range(k):
                    mode[0] += old[c, j] * before[c] + new[c, j] * inputs[c, i]
                    for s in range(1, stop - i):
                        mode[s] += old[c, j] * inputs[c, i + s - 1] + new[c, j] * inputs[c, i + s]
                if switching:
                    for w in range(window, len(windows)):
                        on, off = windows[w, 0], windows[w, 1]
                        reached = windowed(rates[now, j], before_t, time[i], on, off, source)
                        mode[0] += source_gains[now, j] * reached
                elif lit:
                    for s in range(stop - i):
                        mode[s] += steady * whole[j] + source_now[s] * fade[j]
                value = z[j]
                for s in range(stop - i):
                    value = decay[j] * value + mode[s]
                    mode[s] = value
                z[j] = value
        for a in range(p):
            row = out[a, i:stop]
            row[:] = 0.0
            for j in range(m):
                weight = readings[now, j, a]
                for s in range(stop - i):
                    row[s] += weight * modes[j, s]
            for c in range(k):
                if feed[c, a] != 0.0:
                    for s in range(stop - i):
                        row[s] += feed[c, a] * inputs[c, i + s]
        before_t = time[stop - 1]
        for c in range(k):
            before[c] = inputs[c, stop - 1]
        following = level[min(stop, len(level)) - 1]
        if following != now:
            _product(to_states[now], z, states)
            _product(to_modes[following], states, z)
            now, known = following, False
        i = stop
    _product(to_states[now], z, states)
    return step
