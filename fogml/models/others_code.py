"""What regressors of others give when they are asked, held to their contract with one message."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.errors import FogmlError, InputError, first_line
from fogml.json_files import json_text

if TYPE_CHECKING:
    from fogml.models.rbf.network import Network


@contextmanager
def asked(regressor: Any, otherwise: str) -> Iterator[None]:
    """Whatever others' code raises becomes an InputError that names it.

    Raises
    ------
    InputError
        ``Name: otherwise: what it said``.
    """
    try:
        yield
    except (FogmlError, MemoryError):
        raise
    except Exception as error:  # others' code raises whatever it likes
        kind = regressor if isinstance(regressor, type) else type(regressor)
        told = isinstance(error, ValueError)
        if kind.__module__.startswith("fogml.") and not told:
            raise
        said = first_line(error) if told else f"{type(error).__name__} ({first_line(error)})"
        raise InputError(f"{kind.__name__}: {otherwise}: {said}") from None


def fitted_to(regressor: Any, X: FloatArray, y: FloatArray, told: dict[str, Any]) -> Any:
    """The regressor, fitted to a table that it can't write to; its columns are counted where it does not.

    Raises
    ------
    InputError
        If it can't be fitted, or its fit gives another thing than itself.
    """
    with asked(regressor, "can't be fitted to these runs"):
        found = regressor.fit(read_only(X), read_only(y), **told)
    if not hasattr(found, "predict"):
        raise InputError(
            f"{type(regressor).__name__}: its fit has to give itself, with a predict, not {found!r}"
        )
    if not hasattr(found, "n_features_in_"):
        found.n_features_in_ = X.shape[1]
    return found


def predicted(regressor: Any, columns: FloatArray) -> FloatArray:
    """Values for some rows that it can't write to, shape (n,).

    Raises
    ------
    InputError
        If it can't be applied to them, or gives no number for each; infinite ones are told where used.
    """
    with asked(regressor, "can't be applied to these runs"):
        found = np.asarray(regressor.predict(read_only(columns)))
        real = found.dtype.kind != "c"
        values = found.astype(np.float64, copy=False) if real else np.empty(0)
    rows = len(columns)
    if values.shape not in ((rows,), (rows, 1)):
        given = f"shape {found.shape}" if real else "complex numbers"
        raise InputError(
            f"{type(regressor).__name__}: a number for each of {rows} rows was expected, not {given}"
        )
    if np.isnan(values).any():
        raise InputError(f"{type(regressor).__name__}: it predicts nan from finite columns")
    return values.reshape(-1)


def saved_by(regressor: Any) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """What its `to_saved` gives: values for JSON, and arrays of numbers.

    Raises
    ------
    InputError
        If it gives another thing.
    """
    name = type(regressor).__name__
    with asked(regressor, "its to_saved does not give values and arrays"):
        values, arrays = regressor.to_saved()
        arrays = {str(key): np.asarray(array, order="C") for key, array in dict(arrays).items()}
        values = dict(values)
    with asked(regressor, "its to_saved gives values that JSON does not hold"):
        json_text(values, f"{name}.to_saved")
    if "form" in values:
        raise InputError(f"{name}: its to_saved gives a value 'form', a name that fogml keeps for itself")
    for key, array in arrays.items():
        if array.dtype.kind not in "fiub":
            raise InputError(f"{name}: its to_saved gives array '{key}' of {array.dtype}, not of numbers")
    return values, arrays


def compact_by(regressor: Any) -> Network:
    """Its compact form, of as many columns as it was fitted to.

    Raises
    ------
    InputError
        If its `compact` gives another thing.
    """
    from fogml.models.rbf.network import Network

    name = type(regressor).__name__
    with asked(regressor, "its compact gives nothing"):
        found = regressor.compact()
    if not isinstance(found, Network):
        raise InputError(
            f"{name}: its compact gives {found!r}; fogml.models.compact.affine makes what is needed"
        )
    columns = getattr(regressor, "n_features_in_", len(found.linear))
    if len(found.linear) != columns:
        raise InputError(
            f"{name}: its compact is of {len(found.linear)} columns, and it was fitted to {columns}"
        )
    return found


def read_only(values: FloatArray) -> FloatArray:
    """The same numbers, which can't be written to."""
    view = values.view()
    view.flags.writeable = False
    return view
