"""What a user would pick instead of fogml, each as a learner that is tuned with the same budget.

Every learner sees the same training rows and folds of time, and the same number of settings drawn
from its ranges. Inputs and drift are standardised with the rows fitted to. Where a learner cannot
take all rows, they are averaged over blocks of time down to the number it states, which serves
each of them better than a random part of the rows.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from experiments.benchmarks.gru import GRULearner
from fogml.arrays import FloatArray, IndexArray
from fogml.models.table import TrainingTable

Setting = Mapping[str, Any]
INPUTS = "T, dT, T*dT"
"""The features that every peer but the cubic gets, and fogml's network by default."""
_PREDICTED_ROWS = 4096


class Learner(Protocol):
    """A regressor that knows the order of its rows."""

    def fit(self, table: TrainingTable, rows: IndexArray) -> None:
        """Fit to some rows of a table."""

    def at_rows(self, table: TrainingTable, rows: IndexArray) -> FloatArray:
        """Drift at rows of a table [deg/h]."""

    def along(self, X: FloatArray, time_s: FloatArray) -> FloatArray:
        """Drift along a run [deg/h]: features (n, k) at times (n,)."""


class RowLearner:
    """A regressor with scikit-learn's interface, rows taken one by one."""

    def __init__(self, regressor: Any) -> None:
        self.regressor = regressor

    def fit(self, table: TrainingTable, rows: IndexArray) -> None:
        """Fit to some rows of a table, inputs and drift standardised."""
        X, y = table.X[rows], table.y[rows]
        self._shift, self._scale = X.mean(axis=0), _spread(X)
        self._level, self._size = float(y.mean()), float(_spread(y))
        with warnings.catch_warnings():
            # A search that stops at its limit of steps or at a bound is that peer's result.
            warnings.simplefilter("ignore")
            self.regressor.fit((X - self._shift) / self._scale, (y - self._level) / self._size)

    def at_rows(self, table: TrainingTable, rows: IndexArray) -> FloatArray:
        """Drift at rows of a table [deg/h]."""
        return self._values(table.X[rows])

    def along(self, X: FloatArray, time_s: FloatArray) -> FloatArray:
        """Drift along a run [deg/h]."""
        return self._values(X)

    def _values(self, X: FloatArray) -> FloatArray:
        scaled = (X - self._shift) / self._scale
        # Kernel methods hold a value for each row and each training row; so few rows at a time.
        starts = range(0, len(scaled), _PREDICTED_ROWS)
        parts = [np.ravel(self.regressor.predict(scaled[a : a + _PREDICTED_ROWS])) for a in starts]
        return np.concatenate(parts) * self._size + self._level


def _spread(values: FloatArray) -> Any:
    spread = values.std(axis=0)
    return np.where(spread > 0.0, spread, 1.0)


class _Interpolator:
    """scipy's RBFInterpolator with scikit-learn's two methods."""

    def __init__(self, **options: Any) -> None:
        self.options = options

    def fit(self, X: FloatArray, y: FloatArray) -> None:
        from scipy.interpolate import RBFInterpolator

        self._found = RBFInterpolator(X, y, **self.options)

    def predict(self, X: FloatArray) -> FloatArray:
        return np.asarray(self._found(X))


@dataclass(frozen=True)
class Peer:
    """A model that a user would pick instead.

    Attributes
    ----------
    name, title
        Short name, and what it is.
    make
        The learner of a setting and a seed.
    ranges
        Name of each setting to ("log" | "even" | "whole", least, greatest) or ("of", values).
    most_rows
        Training rows are averaged down to this many; None takes all.
    features
        Its inputs.
    """

    name: str
    title: str
    make: Callable[[Setting, int], Learner]
    ranges: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    most_rows: int | None = None
    features: str = INPUTS

    def settings(self, count: int) -> list[dict[str, Any]]:
        """So many settings, spread evenly over the ranges; one where there is nothing to set."""
        if not self.ranges:
            return [{}]
        from scipy.stats import qmc

        points = qmc.Halton(len(self.ranges), seed=5).random(count)
        return [
            {name: _value(spec, u) for (name, spec), u in zip(self.ranges.items(), point)} for point in points
        ]


def _value(spec: tuple[Any, ...], u: float) -> Any:
    kind, *rest = spec
    if kind == "of":
        return rest[0][min(int(u * len(rest[0])), len(rest[0]) - 1)]
    low, high = rest
    value = low + u * (high - low) if kind == "even" else float(np.exp(np.log(low) + u * np.log(high / low)))
    return round(value) if kind == "whole" else float(value)


def _gaussian_process(setting: Setting, seed: int) -> Learner:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

    width = 3
    kernel = (
        ConstantKernel(1.0, (1e-3, 1e3)) * RBF([1.0, *[5.0] * (width - 1)], (0.05, 1e3))
        + ConstantKernel(1.0, (1e-3, 1e3)) * DotProduct(1.0, (1e-3, 1e3))
        + WhiteKernel(0.1, (1e-8, 1.0))
    )
    return RowLearner(GaussianProcessRegressor(kernel, random_state=seed))


def _cubic(setting: Setting, seed: int) -> Learner:
    from sklearn.linear_model import LinearRegression

    return RowLearner(LinearRegression())


def _support_vectors(setting: Setting, seed: int) -> Learner:
    from sklearn.svm import SVR

    return RowLearner(SVR(**setting, max_iter=200_000))


def _kernel_ridge(setting: Setting, seed: int) -> Learner:
    from sklearn.kernel_ridge import KernelRidge

    return RowLearner(KernelRidge(kernel="rbf", **setting))


def _nystroem(setting: Setting, seed: int) -> Learner:
    from sklearn.kernel_approximation import Nystroem
    from sklearn.linear_model import Ridge
    from sklearn.pipeline import make_pipeline

    nystroem = Nystroem(n_components=128, gamma=setting["gamma"], random_state=seed)
    return RowLearner(make_pipeline(nystroem, Ridge(alpha=setting["alpha"])))


def _forest(setting: Setting, seed: int) -> Learner:
    from sklearn.ensemble import RandomForestRegressor

    return RowLearner(RandomForestRegressor(60, random_state=seed, **setting))


def _boosting(setting: Setting, seed: int) -> Learner:
    from sklearn.ensemble import HistGradientBoostingRegressor

    return RowLearner(HistGradientBoostingRegressor(max_iter=150, random_state=seed, **setting))


def _perceptron(setting: Setting, seed: int) -> Learner:
    from sklearn.neural_network import MLPRegressor

    layers = (setting["units"], setting["units"])
    network = MLPRegressor(
        hidden_layer_sizes=layers,
        alpha=setting["alpha"],
        solver="lbfgs",
        max_iter=300,
        random_state=seed,
    )
    return RowLearner(network)


def _interpolator(setting: Setting, seed: int) -> Learner:
    return RowLearner(_Interpolator(kernel="gaussian", degree=1, **setting))


def _gru(setting: Setting, seed: int) -> Learner:
    return GRULearner(**setting, seed=seed)


_GAMMA = ("log", 0.01, 3.0)
PEERS: tuple[Peer, ...] = (
    Peer("cubic", "cubic in T, ArduPilot's and PX4's fit", _cubic, features="T^1..3"),
    Peer(
        "gaussian-process",
        "GaussianProcessRegressor, own width per input, linear part, noise; tunes itself by its evidence",
        _gaussian_process,
        most_rows=600,
    ),
    Peer(
        "svr",
        "SVR",
        _support_vectors,
        {"C": ("log", 0.3, 300.0), "epsilon": ("log", 0.01, 0.3), "gamma": _GAMMA},
        most_rows=2000,
    ),
    Peer(
        "kernel-ridge",
        "KernelRidge",
        _kernel_ridge,
        {"alpha": ("log", 1e-5, 1.0), "gamma": _GAMMA},
        most_rows=2000,
    ),
    Peer(
        "nystroem",
        "Nystroem of 128 and Ridge",
        _nystroem,
        {"alpha": ("log", 1e-5, 1.0), "gamma": _GAMMA},
        most_rows=100_000,
    ),
    Peer(
        "random-forest",
        "RandomForestRegressor of 60",
        _forest,
        {"min_samples_leaf": ("whole", 1, 40), "max_features": ("even", 0.34, 1.0)},
        most_rows=10_000,
    ),
    Peer(
        "boosting",
        "HistGradientBoostingRegressor, 150 rounds",
        _boosting,
        {
            "learning_rate": ("log", 0.02, 0.3),
            "max_leaf_nodes": ("whole", 6, 40),
            "l2_regularization": ("log", 1e-3, 10.0),
        },
        most_rows=100_000,
    ),
    Peer(
        "perceptron",
        "MLPRegressor, two layers",
        _perceptron,
        {"units": ("of", (16, 32)), "alpha": ("log", 1e-4, 1.0)},
        most_rows=2000,
    ),
    Peer(
        "gru",
        "torch: one GRU layer and a linear one, Adam",
        _gru,
        {"hidden": ("of", (16, 32)), "rate": ("log", 3e-3, 3e-2), "decay": ("log", 1e-6, 1e-2)},
        most_rows=600,
    ),
    Peer(
        "rbf-interpolator",
        "scipy RBFInterpolator, Gaussian, smoothed, linear part",
        _interpolator,
        {"epsilon": ("log", 0.1, 3.0), "smoothing": ("log", 1e-3, 10.0)},
        most_rows=1000,
    ),
)
"""In the order of the tables."""


def peer_of(name: str) -> Peer:
    """The peer of a name."""
    return next(peer for peer in PEERS if peer.name == name)
