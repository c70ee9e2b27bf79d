"""scikit-learn regressors as constant, linear part and Gaussians; as bytes without pickle, and their size."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import Any, NamedTuple
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.models.compact import affine
from fogml.models.rbf.network import Network
from fogml.models.scikit_learn import BaseEstimator, is_regressor

_PROBES = 64
_AFFINE = 1e-9
"""Departure from a straight line up to which a regressor counts as linear, as a share of its values."""


class _Machine(NamedTuple):
    """A kernel machine over standardised columns: ``constant + linear . u + sum_j weights_j exp(...)``."""

    centres: FloatArray
    widths: FloatArray
    weights: FloatArray
    linear: FloatArray
    constant: float


def network_of_sklearn(regressor: Any) -> Network | None:
    """The network that computes what a scaled regressor of `SklearnModel` computes; None if there is none.

    Linear regressors are told by their values, whatever they are called; of kernel machines those with a
    Gaussian kernel are taken: SVR, NuSVR, KernelRidge, and Gaussian processes whose kernel is a sum of
    Gaussians, linear parts, constants and white noise.
    """
    pipeline: Any = getattr(regressor, "regressor_", None)
    if not hasattr(pipeline, "steps"):
        return None
    inputs, fitted, output = pipeline[0], pipeline[-1], regressor.transformer_
    machine = _kernel_machine(fitted) or _linear(fitted, len(inputs.mean_))
    if machine is None:
        return None
    shift, scale = inputs.mean_, inputs.scale_
    size, level = float(output.scale_[0]), float(output.mean_[0])
    linear = size * machine.linear / scale
    constant = level + size * machine.constant - float(linear @ shift)
    if not len(machine.weights):
        return affine(linear, constant)
    columns = np.arange(len(shift))
    centres, widths = shift + scale * machine.centres, scale * machine.widths
    return Network(columns, centres, widths, size * machine.weights, linear, constant)


def _linear(fitted: Any, width: int) -> _Machine | None:
    points = np.vstack([np.zeros(width), np.eye(width)])
    values = np.asarray(fitted.predict(points), dtype=np.float64).reshape(-1)
    linear, constant = values[1:] - values[0], float(values[0])
    probes = 4.0 * np.random.default_rng(0).standard_normal((_PROBES, width))
    off = np.asarray(fitted.predict(probes)).reshape(-1) - probes @ linear - constant
    if not np.abs(off).max() <= _AFFINE * (1.0 + np.abs(values).max()):
        return None
    none = np.empty((0, width))
    return _Machine(none, none, np.empty(0), linear, constant)


def _kernel_machine(fitted: Any) -> _Machine | None:
    name = type(fitted).__name__
    if name in ("SVR", "NuSVR") and fitted.kernel == "rbf":
        # What `gamma` came to is told by no public attribute; the columns are standardised.
        gamma = float(fitted._gamma)
        return _gaussians(
            fitted.support_vectors_, gamma, fitted.dual_coef_.reshape(-1), float(fitted.intercept_[0])
        )
    if name == "KernelRidge" and fitted.kernel == "rbf":
        gamma = 1.0 / fitted.X_fit_.shape[1] if fitted.gamma is None else float(fitted.gamma)
        return _gaussians(fitted.X_fit_, gamma, fitted.dual_coef_.reshape(-1), 0.0)
    if name == "GaussianProcessRegressor":
        return _process(fitted)
    return None


def _gaussians(centres: FloatArray, gamma: float, weights: FloatArray, constant: float) -> _Machine:
    widths = np.full(centres.shape, gamma**-0.5)
    return _Machine(np.asarray(centres), widths, weights, np.zeros(centres.shape[1]), constant)


def _process(fitted: Any) -> _Machine | None:
    """Mean of a Gaussian process: its kernel's parts, each times the weights of the training rows."""
    rows, alpha = fitted.X_train_, np.asarray(fitted.alpha_).reshape(-1)
    parts = _parts(fitted.kernel_, 1.0)
    if parts is None:
        return None
    centres, widths, weights = [np.empty((0, rows.shape[1]))], [np.empty((0, rows.shape[1]))], [np.empty(0)]
    linear, constant = np.zeros(rows.shape[1]), 0.0
    for kernel, factor in parts:
        name = type(kernel).__name__
        if name == "RBF":
            centres.append(rows)
            lengths = np.broadcast_to(np.sqrt(2.0) * np.asarray(kernel.length_scale), rows.shape)
            widths.append(lengths)
            weights.append(factor * alpha)
        elif name == "DotProduct":
            linear = linear + factor * (alpha @ rows)
            constant += factor * float(kernel.sigma_0) ** 2 * float(alpha.sum())
        else:
            constant += factor * float(kernel.constant_value) * float(alpha.sum())
    level, size = np.reshape(fitted._y_train_mean, -1)[0], np.reshape(fitted._y_train_std, -1)[0]
    return _Machine(
        np.concatenate(centres),
        np.concatenate(widths),
        size * np.concatenate(weights),
        size * linear,
        float(level + size * constant),
    )


def _parts(kernel: Any, factor: float) -> list[tuple[Any, float]] | None:
    """A kernel as a sum of its parts with their factors; None where it is no such sum."""
    name = type(kernel).__name__
    if name in ("RBF", "DotProduct", "ConstantKernel"):
        return [(kernel, factor)]
    if name == "WhiteKernel":
        return []  # of other rows it says nothing
    if name == "Sum":
        both = [_parts(part, factor) for part in (kernel.k1, kernel.k2)]
        return None if None in both else [part for parts in both for part in parts or ()]
    if name == "Product":
        for one, other in ((kernel.k1, kernel.k2), (kernel.k2, kernel.k1)):
            if type(one).__name__ == "ConstantKernel":
                return _parts(other, factor * float(one.constant_value))
    return None


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
        raise InputError(f"the saved scikit-learn regressor cannot be read ({error})") from None
    if not is_regressor(regressor):
        raise InputError(f"the saved {type(regressor).__name__} is not a regressor; it is not used")
    return regressor


def _trusted(data: bytes) -> list[str]:
    """The types that skops itself does not vouch for, all of them of `TYPES`."""
    import skops.io

    try:
        with ZipFile(BytesIO(data)) as archive:
            # skops packs nothing, and what is packed may unpack to any size.
            if sum(held.file_size for held in archive.infolist()) > len(data):
                raise ValueError("it unpacks to more than it is")
        named = skops.io.get_untrusted_types(data=data)
    except Exception as error:  # as above
        raise InputError(f"the saved scikit-learn regressor cannot be read ({error})") from None
    foreign = sorted(set(named) - TYPES)
    if foreign:
        raise InputError(
            f"the saved regressor holds what none of scikit-learn's regressors needs ({foreign[0][:100]}); "
            "it is not loaded"
        )
    return list(named)
