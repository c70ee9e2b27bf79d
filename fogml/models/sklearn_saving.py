"""Scikit-learn regressors as bytes, without pickle: only scikit-learn's own types are read back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import RegressorMixin

from fogml.errors import InputError

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
