"""The sine of many angles at once. Loads numba.

NumPy's sine of double numbers goes one by one. Here angles come in turns, so that whole ones are cut off
without rounding, and the series has no branch: a processor works on several at a time.
"""

from __future__ import annotations

import math

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.compiled import kernel

_SERIES = tuple((-1.0) ** k * (2.0 * math.pi) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(11))
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10 = _SERIES
"""Taylor's series about 0 in turns: the term after the last is below 1e-16 at a quarter turn."""


@kernel()
def sine_kernel(turns: FloatArray, out: FloatArray) -> None:
    """sin(2 pi turns) into `out`, both of shape (n,)."""
    for i in range(len(turns)):
        x = turns[i] - np.floor(turns[i] + 0.5)
        # The second and third quarter turn mirror the first and last.
        x = math.copysign(0.5, x) - x if abs(x) > 0.25 else x
        y = x * x
        tail = _C5 + y * (_C6 + y * (_C7 + y * (_C8 + y * (_C9 + y * _C10))))
        out[i] = x * (_C0 + y * (_C1 + y * (_C2 + y * (_C3 + y * (_C4 + y * tail)))))
