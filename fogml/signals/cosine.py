"""The orthonormal cosine transform (DCT-II), also of series longer than memory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.signals import large

ComplexArray = NDArray[np.complex128]


def cosine_transform(values: FloatArray) -> FloatArray:
    """Coefficients of the orthonormal DCT-II of a series, shape (n,).

    A long one, whose length has to be even, is transformed by the Fourier transform of its even values
    followed by its odd ones backwards (Makhoul 1980), and that as a table of rows and columns, some at a time
    (Bailey 1990): the result is that of one transform, to rounding.
    """
    from scipy.fft import dct

    n = len(values)
    if n <= large.HELD_VALUES:
        return np.asarray(dct(np.ascontiguousarray(values), norm="ortho"))
    half = n // 2
    shuffled = large.empty(n)
    for part in large.pieces(shuffled[:half]):
        shuffled[part] = values[2 * part.start : 2 * part.stop : 2]
        backwards = values[n - 2 * part.stop + 1 : n - 2 * part.start : 2]
        shuffled[half + part.start : half + part.stop] = backwards[::-1]
        large.release()
    spectrum = _fourier(shuffled.view(np.complex128))
    found = large.empty(n)
    step = max(large.PIECE // 8, 1)
    for first in range(0, half // 2 + 1, step):
        k = np.arange(first, min(first + step, half // 2 + 1))
        # Coefficient k of the real series from k and half - k of the complex one of pairs.
        a, b = spectrum[k % half], np.conj(spectrum[(half - k) % half])
        even, odd = 0.5 * (a + b), -0.5j * (a - b)
        turn = np.exp(-2j * np.pi * k / n)
        for at, value in ((k, even + turn * odd), (half - k, np.conj(even - turn * odd))):
            turned = value * np.exp(-0.5j * np.pi * at / n)
            found[at] = turned.real
            inside = at > 0
            found[n - at[inside]] = -turned.imag[inside]
        large.release()
    found *= np.sqrt(2.0 / n)
    found[0] *= np.sqrt(0.5)
    large.release()
    return found


def _fourier(values: ComplexArray) -> ComplexArray:
    """The Fourier transform of complex values, shape (n,); n has a divisor near its root."""
    rows, columns = _near_root(len(values))
    table, made = values.reshape(rows, columns), large.empty(len(values), np.complex128)
    for part in _bands(rows, columns):
        block = np.fft.fft(table[:, part], axis=0)
        k = np.arange(rows)[:, None] * np.arange(part.start, part.stop)
        block *= np.exp(-2j * np.pi * k / len(values))
        table[:, part] = block
        large.release()
    turned = made.reshape(columns, rows)
    for part in _bands(columns, rows):
        turned[:, part] = np.fft.fft(table[part], axis=1).T
        large.release()
    return made


def _bands(length: int, lines: int) -> Iterator[slice]:
    """Some lines at a time of a table whose lines have a length."""
    step = max(large.PIECE // length, 1)
    return (slice(first, min(first + step, lines)) for first in range(0, lines, step))


def _near_root(n: int) -> tuple[int, int]:
    """Two factors of a number, as near to each other as it has any."""
    first = next(divisor for divisor in range(int(np.sqrt(n)), 0, -1) if n % divisor == 0)
    return first, n // first
