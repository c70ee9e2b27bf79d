"""Arrays by what they hold."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]


def unmasked(values: Any) -> Any:
    """Values of any kind, of a masked array those that it hides as missing: NaN, of dates NaT."""
    if not np.ma.isMaskedArray(values):
        return values
    missing = np.array("NaT", values.dtype) if values.dtype.kind in "mM" else np.nan
    return np.where(np.ma.getmaskarray(values), missing, np.ma.getdata(values))
