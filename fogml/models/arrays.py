"""Arrays of saved models: to bytes in safetensors' form and back, of stated type and shape, finite."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from fogml.errors import InputError

_TYPES = {"F64": np.float64, "F32": np.float32, "U8": np.uint8}
"""Types that saved models consist of, by safetensors' names."""


def arrays_to_bytes(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Arrays in safetensors' form."""
    from safetensors.numpy import save

    return bytes(save({name: np.ascontiguousarray(array) for name, array in arrays.items()}))


def arrays_from_bytes(data: bytes) -> dict[str, NDArray[Any]]:
    """The arrays that `arrays_to_bytes` gave.

    Raises
    ------
    InputError
        If the bytes are no such arrays, of another type, or not finite.
    """
    from safetensors import SafetensorError, deserialize

    try:
        found = deserialize(data)
    except SafetensorError as error:
        raise InputError(f"damaged ({error})") from None
    arrays = {}
    for name, tensor in found:
        if tensor["dtype"] not in _TYPES:
            raise InputError(f"array '{name}' is of type {tensor['dtype']}; known are {', '.join(_TYPES)}")
        values = np.frombuffer(tensor["data"], dtype=_TYPES[tensor["dtype"]]).reshape(tensor["shape"])
        if not np.isfinite(values).all():
            raise InputError(f"array '{name}' holds a number that is not finite")
        arrays[name] = values.copy()
    return arrays


def expect_arrays(
    arrays: Mapping[str, NDArray[Any]], expected: Mapping[str, tuple[DTypeLike, tuple[int, ...]]]
) -> None:
    """Hold that arrays are exactly those expected, by name, type and shape."""
    for name in {**expected, **arrays}:
        if name not in expected:
            raise InputError(f"array '{name}' does not belong to this model")
        kind, shape = np.dtype(expected[name][0]), expected[name][1]
        if name not in arrays:
            raise InputError(f"array '{name}' is missing")
        if arrays[name].dtype != kind or arrays[name].shape != shape:
            found = f"{arrays[name].dtype} of shape {arrays[name].shape}"
            raise InputError(f"array '{name}' is {found}; {kind} of shape {shape} was expected")
