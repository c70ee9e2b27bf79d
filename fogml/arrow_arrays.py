"""Arrow's arrays to NumPy's and back by their buffers: its own ways load pandas, a third of a second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pyarrow import Array, ChunkedArray, Table


BLOCK_BYTES = 1 << 20
"""What Arrow parses in one piece of a text, its default."""


def takes_threads(content: bytes | memoryview) -> bool:
    """Whether a text is to be read on all cores: one block of Arrow's has little to share among them.

    Threads that have only just done their part are a danger at a program's end, which a small file soon
    meets: at times Arrow's teardown aborts the process then (https://github.com/apache/arrow/issues/34314).
    """
    return len(content) > BLOCK_BYTES


def values_of(column: Array | ChunkedArray) -> np.ndarray[tuple[int], np.dtype[Any]]:
    """Numbers or truth values of an Arrow array, shape (n,), copied; a missing one is NaN.

    Examples
    --------
    >>> import pyarrow as arrow
    >>> values_of(arrow.array([1.5, None]))
    array([1.5, nan])
    >>> values_of(arrow.array([True, False]))
    array([ True, False])
    """
    return np.concatenate(
        [_of_chunk(chunk) for chunk in getattr(column, "chunks", [column])] or [np.empty(0)]
    )


def _of_chunk(chunk: Array) -> np.ndarray[tuple[int], np.dtype[Any]]:
    if str(chunk.type) == "bool":
        return _of_chunk(chunk.cast("uint8")).astype(np.bool_)
    kind, stop = np.dtype(chunk.type.to_pandas_dtype()), chunk.offset + len(chunk)
    present, held = chunk.buffers()
    values = np.frombuffer(held, kind, stop)[chunk.offset :] if len(chunk) else np.empty(0, kind)
    if chunk.null_count:
        bits = np.unpackbits(np.frombuffer(present, np.uint8), count=stop, bitorder="little")
        values = np.where(bits[chunk.offset :], values, np.nan)
    return values


def table_of(columns: Mapping[str, np.ndarray[Any, np.dtype[Any]]]) -> Table:
    """An Arrow table of columns of numbers, shape (n,) each, which share their memory where they can.

    Examples
    --------
    >>> table_of({"a": np.array([0.5, 1.5])}).to_pydict()
    {'a': [0.5, 1.5]}
    """
    import pyarrow as arrow

    arrays = []
    for values in columns.values():
        if values.dtype.kind in "iuf" and values.dtype.isnative:
            held = arrow.py_buffer(np.ascontiguousarray(values))
            kind = arrow.from_numpy_dtype(values.dtype)
            arrays.append(arrow.Array.from_buffers(kind, len(values), [None, held]))
        else:
            arrays.append(arrow.array(values))
    return arrow.Table.from_arrays(arrays, names=list(columns))
