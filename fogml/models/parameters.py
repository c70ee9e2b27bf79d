"""Parameters of regressors checked against the table on their class, before anything is read or fitted.

The table is scikit-learn's own, ``_parameter_constraints``: parameter to what it may be, e.g.
``{"ridge": [Interval(Real, 0.0, None, closed="left"), StrOptions({"auto"})]}``. Scikit-learn's
regressors have one each, and fogml's have one of the same form.

And arrays of saved models: to bytes in safetensors' form and back, of stated type and shape, finite.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator, Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from fogml.errors import InputError, known_are, quoted
from fogml.models.scikit_learn import make_constraint


class WholeNumbers:
    """Several whole numbers, none below a least one: a constraint in scikit-learn's form."""

    hidden = False

    def __init__(self, least: int, few: int = 0) -> None:
        self.least = least
        self.few = few

    def is_satisfied_by(self, value: Any) -> bool:
        """Whether a value is of this kind."""
        listed = list(value) if isinstance(value, list | tuple | np.ndarray) else None
        return (
            listed is not None
            and len(listed) >= self.few
            and all(
                isinstance(item, Integral) and not isinstance(item, bool) and int(item) >= self.least
                for item in listed
            )
        )

    def __str__(self) -> str:
        return f"a list of whole numbers from {self.least}"


class Device:
    """Where torch computes: a constraint in scikit-learn's form."""

    hidden = False

    def is_satisfied_by(self, value: Any) -> bool:
        """Whether a value names a device."""
        kind, colon, number = value.partition(":") if isinstance(value, str) else ("", "", "")
        return value == "cpu" or (kind == "cuda" and (number.isdecimal() if colon else not number))

    def __str__(self) -> str:
        return "'cpu', 'cuda' or 'cuda:N'"


def check_parameters(kind: type, given: Mapping[str, Any], name: str | None = None) -> None:
    """Check parameters that are stated for an estimator of a class, called by `name` if that is given."""
    name = name or kind.__name__
    stated = inspect.signature(kind).parameters
    known = list(stated)
    constraints: Mapping[str, Any] = getattr(kind, "_parameter_constraints", {})
    for parameter, value in given.items():
        if parameter not in known:
            told = known_are(str(parameter), known, "parameters")
            raise InputError(f"{name}: no parameter {quoted(str(parameter))}; {told}")
        allowed = constraints.get(parameter, "no_validation")
        accepted = [] if isinstance(allowed, str) else [_constraint(one) for one in allowed]
        fits = not accepted or any(_satisfied(one, value) for one in accepted)
        # Infinity is taken where it is the default: for "as many as there are".
        odd = [number for number in _numbers(value) if not math.isfinite(number)]
        if not fits or (odd and odd != [stated[parameter].default]):
            told = " or ".join(_told(one) for one in accepted if not one.hidden) or "any finite value"
            raise InputError(f"{name}: parameter '{parameter}' is {quoted(value)}; it must be {told}")


def _told(constraint: Any) -> str:
    options = getattr(constraint, "options", None)
    if options is not None:
        return " or ".join(sorted(map(repr, options)))
    return str(constraint).replace("inf]", "inf)")


def _constraint(stated: Any) -> Any:
    return stated if isinstance(stated, WholeNumbers | Device) else make_constraint(stated)


def _satisfied(constraint: Any, value: Any) -> bool:
    # Python's bool is a whole number too; a parameter that is one says so.
    if isinstance(value, bool | np.bool_) and "bool" not in str(constraint):
        return False
    return bool(constraint.is_satisfied_by(value))


def _numbers(value: Any) -> Iterator[float]:
    """The real numbers in a value, which may be a list of them."""
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        yield from value.ravel().tolist()
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, Real) and not isinstance(value, Integral):
        yield float(value)


_TYPES = {"F64": np.float64, "F32": np.float32, "U8": np.uint8}
"""Types that saved models consist of, by safetensors' names."""


def arrays_to_bytes(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Arrays in safetensors' form."""
    from safetensors.numpy import save

    return bytes(save({name: np.asarray(array, order="C") for name, array in arrays.items()}))


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
