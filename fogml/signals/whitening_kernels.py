"""The Kalman recursions behind `fogml.signals.whitening`: gains once, then any number of columns.

States x are Gauss-Markov processes and, last, a random walk and the rounding of the angle before.
A sample is a mean over its averaging time, so that its noise and that of the states belong together::

    y[i] = c[i] @ x[i-1] + noise,   x[i] = f[i] * x[i-1] + noise
"""

from __future__ import annotations

import math

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.signals.compiled import kernel
from fogml.signals.modes import phi_functions

_TILE = 128


@kernel()
def _step_terms(
    step: float,
    averaging: float,
    time_constants: FloatArray,
    variance: float,
    white: float,
    walk: float,
    rounding: float,
    adjoining: bool,
    decay: FloatArray,
    reading: FloatArray,
    process: FloatArray,
    cross: FloatArray,
) -> float:
    """Variance of the sample that the states before do not explain.

    Fills decay, reading, the states' noise variances and their covariances with the sample's noise, shape
    (m + 2,) each. A step [s] shorter than what samples are means over bounds the mean; `adjoining` says that
    the angle was read where this mean begins.
    """
    m = len(time_constants)
    a = min(step, averaging)
    gap = step - a
    own = white / averaging
    for j in range(m):
        tau = time_constants[j]
        fall, phi_1, phi_2 = phi_functions(a / tau)
        waited = math.exp(-gap / tau)
        fresh = -variance * math.expm1(-2.0 * gap / tau)
        decay[j] = waited * fall
        reading[j] = waited * phi_1
        process[j] = -variance * math.expm1(-2.0 * step / tau)
        cross[j] = fall * phi_1 * fresh + variance * phi_1 * phi_1 * a / tau
        own += phi_1 * phi_1 * fresh + variance * (2.0 * phi_2 - phi_1 * phi_1)
    decay[m] = 1.0
    reading[m] = 1.0
    process[m] = walk * step
    cross[m] = walk * (gap + 0.5 * a)
    own += walk * (gap + a / 3.0)
    # The rounding in units of its share of a sample: this one's is in, the one before's is out.
    decay[m + 1] = 0.0
    reading[m + 1] = -1.0 if adjoining else 0.0
    process[m + 1] = rounding
    cross[m + 1] = rounding
    own += rounding if adjoining else 2.0 * rounding
    return own


@kernel()
def gains_kernel(
    kind: IntArray,
    steps: FloatArray,
    averaging: FloatArray,
    time_constants: FloatArray,
    variance: float,
    white: float,
    walk: float,
    quantum: float,
    adjoining: float,
    size: int,
    decay: FloatArray,
    reading: FloatArray,
    gains: FloatArray,
    deviation: FloatArray,
) -> None:
    """Gains and standard deviations of the innovations of n samples, exact from the first one on.

    Parameters
    ----------
    kind
        Which of u pairs of step and averaging time a sample has, shape (n,).
    steps, averaging
        Those pairs [s], shape (u,).
    time_constants, variance, white, walk
        As in `_step_terms`.
    quantum
        Rounding of the angle times 3600 s/h: its share in a sample is over the averaging time.
    adjoining
        Longest step, in averaging times, that counts as adjoining.
    size
        States in use, s: m + 1 without rounding, m + 2 with it, m where there is no walk either.
    decay, reading
        Overwritten with f and c, shape (u, s).
    gains, deviation
        Overwritten, shapes (n, s) and (n,).
    """
    m = len(time_constants)
    f, c = np.zeros(m + 2), np.zeros(m + 2)
    process, cross = np.zeros(m + 2), np.zeros(m + 2)
    seen = np.zeros(size)
    spread = np.zeros((size, size))
    for j in range(m):
        spread[j, j] = variance
    if size == m + 2:
        first = quantum / averaging[kind[0]]
        spread[m + 1, m + 1] = first * first
    now, own = -1, 0.0
    for i in range(len(kind)):
        if kind[i] != now:
            now = kind[i]
            step, a = steps[now], averaging[now]
            own = _step_terms(
                step, a, time_constants, variance, white, walk,
                (quantum / a) ** 2, step <= adjoining * a, f, c, process, cross,
            )  # fmt: skip
            for j in range(size):
                decay[now, j] = f[j]
                reading[now, j] = c[j]
        total = own
        for j in range(size):
            seen[j] = 0.0
            for k in range(size):
                seen[j] += spread[j, k] * c[k]
            total += c[j] * seen[j]
        gain = gains[i]
        for j in range(size):
            gain[j] = (f[j] * seen[j] + cross[j]) / total
        for j in range(size):
            for k in range(j + 1):
                value = f[j] * spread[j, k] * f[k] - gain[j] * gain[k] * total
                spread[j, k] = value
                spread[k, j] = value
            spread[j, j] += process[j]
        deviation[i] = math.sqrt(total)


@kernel()
def _predict(c: FloatArray, z: FloatArray, predicted: FloatArray) -> None:
    """Add c @ z, in the order in which `whiten_kernel` does, so that blocks end where they may."""
    size, width = z.shape
    j = 0
    while j + 4 <= size:
        c0, c1, c2, c3 = c[j], c[j + 1], c[j + 2], c[j + 3]
        for q in range(width):
            predicted[q] += (c0 * z[j, q] + c1 * z[j + 1, q]) + (c2 * z[j + 2, q] + c3 * z[j + 3, q])
        j += 4
    while j < size:
        for q in range(width):
            predicted[q] += c[j] * z[j, q]
        j += 1


@kernel()
def whiten_kernel(
    values: FloatArray,
    kind: IntArray,
    decay: FloatArray,
    reading: FloatArray,
    gains: FloatArray,
    deviation: FloatArray,
    states: FloatArray,
    inverse: bool,
) -> None:
    """Turn columns (n, k) into innovations over their deviations, in place; or back with `inverse`.

    `states`, shape (s, k), are overwritten with those after the last sample. Columns go in tiles
    that stay in the fastest cache with their states. A pass over the states takes them to a sample and
    predicts the next one, four at a time: what it costs is to fetch and to store them.
    """
    n, columns = values.shape
    size = len(states)
    for left in range(0, columns, _TILE):
        right = min(left + _TILE, columns)
        width = right - left
        z = states[:, left:right].copy()
        error = np.empty(width)
        predicted = np.zeros(width)
        if n:
            _predict(reading[kind[0]], z, predicted)
        for i in range(n):
            row = values[i, left:right]
            f, g = decay[kind[i]], gains[i]
            c = reading[kind[min(i + 1, n - 1)]]
            if inverse:
                scale = deviation[i]
                for q in range(width):
                    error[q] = row[q] * scale
                    row[q] = predicted[q] + error[q]
                    predicted[q] = 0.0
            else:
                scale = 1.0 / deviation[i]
                for q in range(width):
                    error[q] = row[q] - predicted[q]
                    row[q] = error[q] * scale
                    predicted[q] = 0.0
            j = 0
            while j + 4 <= size:
                f0, f1, f2, f3 = f[j], f[j + 1], f[j + 2], f[j + 3]
                g0, g1, g2, g3 = g[j], g[j + 1], g[j + 2], g[j + 3]
                c0, c1, c2, c3 = c[j], c[j + 1], c[j + 2], c[j + 3]
                for q in range(width):
                    now = error[q]
                    z0 = f0 * z[j, q] + g0 * now
                    z1 = f1 * z[j + 1, q] + g1 * now
                    z2 = f2 * z[j + 2, q] + g2 * now
                    z3 = f3 * z[j + 3, q] + g3 * now
                    z[j, q], z[j + 1, q], z[j + 2, q], z[j + 3, q] = z0, z1, z2, z3
                    predicted[q] += (c0 * z0 + c1 * z1) + (c2 * z2 + c3 * z3)
                j += 4
            while j < size:
                kept, taken, weight = f[j], g[j], c[j]
                for q in range(width):
                    z[j, q] = kept * z[j, q] + taken * error[q]
                    predicted[q] += weight * z[j, q]
                j += 1
        for j in range(size):
            for q in range(width):
                states[j, left + q] = z[j, q]


@kernel()
def adjoint_kernel(
    values: FloatArray,
    kind: IntArray,
    decay: FloatArray,
    reading: FloatArray,
    gains: FloatArray,
    deviation: FloatArray,
    costates: FloatArray,
) -> None:
    """The transpose of the inverse of `whiten_kernel` on columns (n, k), in place, last sample first.

    `costates`, shape (s, k), are overwritten with those before the first sample.
    """
    n, columns = values.shape
    size = len(costates)
    fed = np.empty(columns)
    for i in range(n - 1, -1, -1):
        row = values[i]
        f, c, g = decay[kind[i]], reading[kind[i]], gains[i]
        for q in range(columns):
            fed[q] = row[q]
        for j in range(size):
            kept, taken, given = f[j], c[j], g[j]
            for q in range(columns):
                now = costates[j, q]
                fed[q] += given * now
                costates[j, q] = kept * now + taken * row[q]
        scale = deviation[i]
        for q in range(columns):
            row[q] = fed[q] * scale
