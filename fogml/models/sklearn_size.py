"""What a scikit-learn regressor predicts from, in numbers and in bytes: its archive and its past left out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator


def numbers_of(regressor: Any) -> int:
    """How many floating-point numbers it predicts from; a node of a tree is one, its value aside another."""
    return sum(array.size for array in _predicting(regressor) if array.dtype.kind in "fV")


def bytes_of(regressor: Any) -> int:
    """Bytes of the arrays that it predicts from, indices among them."""
    return sum(array.nbytes for array in _predicting(regressor))


def _predicting(regressor: Any) -> Iterator[NDArray[Any]]:
    """The arrays that an estimator's ``predict`` reads, of those that it is made of too.

    Which these are is watched, not listed: an estimator also keeps what its fit went through.
    """
    read: set[str] = set()

    class Watched(type(regressor)):  # type: ignore[misc]
        def __getattribute__(self, name: str) -> Any:
            read.add(name)
            return super().__getattribute__(name)

    watched = object.__new__(Watched)
    watched.__dict__.update(vars(regressor))
    watched.predict(np.zeros((1, regressor.n_features_in_)))
    settings = regressor.get_params(deep=False).keys()
    for name in sorted(read & vars(regressor).keys()):
        value = vars(regressor)[name]
        # Settings predict nothing, but what a pipeline is made of is fitted in its place.
        yield from _arrays(value) if name not in settings else _fitted_steps(value)


def _fitted_steps(value: Any) -> Iterator[NDArray[Any]]:
    """The arrays of the estimators in a list of named ones."""
    for step in value if isinstance(value, list) else []:
        if isinstance(step, tuple) and isinstance(step[-1], BaseEstimator):
            yield from _arrays(step[-1])


def _arrays(value: Any) -> Iterator[NDArray[Any]]:
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        value = value.ravel().tolist()
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, float):
        yield np.array(value)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _arrays(item)
    elif isinstance(value, BaseEstimator):
        # One that is a template, or that readies columns for a fit, predicts nothing.
        if hasattr(value, "predict") and hasattr(value, "n_features_in_"):
            yield from _predicting(value)
    elif type(value).__module__.startswith("sklearn."):
        # Trees in compiled code, which have no attributes.
        state = value.__getstate__()
        yield from _arrays([*state.values()] if isinstance(state, dict) else state)
