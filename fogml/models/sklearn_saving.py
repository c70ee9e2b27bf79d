"""Scikit-learn regressors as bytes, without pickle: only scikit-learn's own types come back; their size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.models.scikit_learn import BaseEstimator, RegressorMixin


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


_KERNELS = (
    "CompoundKernel",
    "ConstantKernel",
    "DotProduct",
    "Exponentiation",
    "ExpSineSquared",
    "Matern",
    "PairwiseKernel",
    "Product",
    "RationalQuadratic",
    "RBF",
    "Sum",
    "WhiteKernel",
)
_LOSSES = (
    "HalfTweedieLossIdentity",
    "HalfTweedieLoss",
    "HalfGammaLoss",
    "HalfPoissonLoss",
    "HalfSquaredError",
)
_DISTANCES = ("EuclideanDistance64", "ManhattanDistance64", "MinkowskiDistance64", "ChebyshevDistance64")
TYPES = frozenset(
    [
        *(f"sklearn.gaussian_process.kernels.{name}" for name in _KERNELS),
        *(f"sklearn._loss.loss.{name}" for name in _LOSSES),
        *(f"sklearn.metrics._dist_metrics.{name}" for name in _DISTANCES),
        "sklearn.ensemble._hist_gradient_boosting.predictor.TreePredictor",
        "sklearn.neighbors._ball_tree.BallTree",
        "sklearn.neighbors._kd_tree.KDTree",
        "sklearn.neural_network._stochastic_optimizers.AdamOptimizer",
        "sklearn.neural_network._stochastic_optimizers.SGDOptimizer",
        "sklearn.tree._tree.Tree",
    ]
)
"""What scikit-learn's regressors are made of beside what skops vouches for; no function is among them."""


def dump_sklearn(regressor: Any) -> NDArray[np.uint8]:
    """A fitted scikit-learn regressor in skops' form, as bytes of shape (n,).

    Raises
    ------
    InputError
        If it holds objects that are not scikit-learn's and so could not be loaded again.
    """
    import skops.io

    data = skops.io.dumps(regressor)
    _trusted(data)
    return np.frombuffer(data, dtype=np.uint8)


def load_sklearn(stored: NDArray[Any]) -> Any:
    """The regressor that `dump_sklearn` gave.

    Raises
    ------
    InputError
        If the bytes are damaged, or name a type that is not scikit-learn's.
    """
    import skops.io

    data = np.asarray(stored, dtype=np.uint8).tobytes()
    trusted = _trusted(data)
    try:
        regressor = skops.io.loads(data, trusted=trusted)
    except Exception as error:  # skops raises whatever a damaged archive leads it to
        raise InputError(
            f"the saved scikit-learn regressor cannot be read ({error}); train it again"
        ) from None
    if not isinstance(regressor, RegressorMixin):
        raise InputError(f"the saved {type(regressor).__name__} is not a regressor; it is not used")
    return regressor


def _trusted(data: bytes) -> list[str]:
    """The types that skops itself does not vouch for, all of them of `TYPES`."""
    import skops.io

    try:
        named = skops.io.get_untrusted_types(data=data)
    except Exception as error:  # as above
        raise InputError(
            f"the saved scikit-learn regressor cannot be read ({error}); train it again"
        ) from None
    foreign = sorted(set(named) - TYPES)
    if foreign:
        raise InputError(
            f"the saved regressor holds what none of scikit-learn's regressors needs ({foreign[0][:100]}); "
            "it is not loaded"
        )
    return list(named)
