"""Values of Arrow's columns as arrays, by their buffers: its own conversion loads pandas for its dates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import FloatArray

if TYPE_CHECKING:
    from pyarrow import Array, ChunkedArray


def float_values(column: ChunkedArray) -> FloatArray:
    """A column of numbers, NaN where there is none, shape (n,)."""
    numbers = column if str(column.type) == "double" else column.cast("float64")
    return np.concatenate([np.empty(0), *map(_of_chunk, numbers.chunks)])


def _of_chunk(chunk: Array) -> FloatArray:
    present, held = chunk.buffers()
    stop = chunk.offset + len(chunk)
    values = np.frombuffer(held, dtype=np.float64, count=stop)[chunk.offset :] if len(chunk) else np.empty(0)
    if chunk.null_count:
        bits = np.frombuffer(present, dtype=np.uint8)
        values = np.where(np.unpackbits(bits, count=stop, bitorder="little")[chunk.offset :], values, np.nan)
    return np.asarray(values)
