"""The network of the temperature-product patent: one width, centres from the data, no linear part."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.models.folds import dealt_folds
from fogml.models.parameters import check_parameters
from fogml.models.rbf.blocks import Frame
from fogml.models.rbf.centres import orthogonal_least_squares, thinned, thinned_rows
from fogml.models.rbf.evaluate import basis_functions
from fogml.models.rbf.fitted import NetworkRegressor, SavedFit
from fogml.models.scikit_learn import Interval, validate_data

WIDTHS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Widths tried, in standard deviations of the inputs."""
_CANDIDATES = 300
_SEARCH_ROWS = 50_000
_PIECE = 1 << 13


class _Fitted(SavedFit):
    width_: float = Field(gt=0.0)
    held_out_mse_: float


class PatentRBFRegressor(NetworkRegressor):
    """RBF network as in the patent (Sensors 2015, 15(5), 11189): ``w0 + sum_j w_j exp(-|x - c_j|^2 / s^2)``.

    One width for all centres and standardised inputs, centres chosen among the training rows by
    orthogonal least squares (Chen, Cowan & Grant 1991), no linear part, no tuning. The patent's
    "train again" until the index is met is a search over widths and sizes on folds of time of the
    training rows. It falls to the constant ``w0`` beyond the training rows.

    Parameters
    ----------
    max_centres
        Greatest number of centres.
    width
        Width in standard deviations of the inputs; None chooses among `WIDTHS`.
    goal
        Mean squared error on held-out rows at which the smallest network that meets it is taken;
        None takes the one with the least error.
    seed
        Not used: nothing is random. Kept so that every network is made alike.
    threads
        Threads; by default all cores.

    Attributes
    ----------
    width_ : float
        The width used, in standard deviations of the inputs.
    held_out_mse_ : float
        Mean squared error on held-out rows of the width and size chosen.

    Further attributes are those of `NetworkRegressor`.
    """

    _linear_part = False
    _fitted = _Fitted
    _parameter_constraints: ClassVar[dict[str, Any]] = {
        "max_centres": [Interval(Integral, 1, None, closed="left")],
        "width": [None, Interval(Real, 0.0, None, closed="neither")],
        "goal": [None, Interval(Real, 0.0, None, closed="left")],
        **NetworkRegressor._parameter_constraints,
    }

    def __init__(
        self,
        max_centres: int = 40,
        *,
        width: float | None = None,
        goal: float | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> None:
        self.max_centres = max_centres
        self.width = width
        self.goal = goal
        self.seed = seed
        self.threads = threads

    def fit(self, X: ArrayLike, y: ArrayLike, *, folds: ArrayLike | None = None) -> Self:
        """Fit to rows in time order.

        Parameters
        ----------
        X
            Inputs, shape (n, k).
        y
            Values, shape (n,).
        folds
            Fold of each row, shape (n,); by default 20 blocks of time dealt to 5 folds.
        """
        check_parameters(type(self), self.get_params(deep=False))
        inputs, target = validate_data(self, X, y, dtype=np.float64, y_numeric=True, ensure_min_samples=2)
        inputs, target = np.ascontiguousarray(inputs), np.asarray(target, dtype=np.float64)
        label = dealt_folds(len(target)) if folds is None else np.asarray(folds, dtype=np.intp)
        if label.shape != target.shape:
            raise InputError(f"folds has shape {label.shape}, there are {len(target)} rows")
        frame = Frame.of(inputs, target)
        scaled = (inputs - frame.shift) / frame.scale
        centred = target - frame.target_shift
        candidates = np.unique(thinned(scaled, _CANDIDATES), axis=0)
        kept = thinned_rows(len(target), _SEARCH_ROWS)
        widths = WIDTHS if self.width is None else (float(self.width),)
        paths = [
            _path(scaled[kept], centred[kept], label[kept], candidates, width, self.max_centres, self.threads)
            for width in widths
        ]
        best, size = self._choose(paths)
        path = paths[best]
        self.width_ = widths[best]
        self.held_out_mse_ = float(path.errors[size])
        centres = candidates[path.chosen[:size]]
        self.ridge_ = 0.0
        self._solve(
            inputs,
            target,
            np.arange(inputs.shape[1], dtype=np.intp),
            frame.shift + frame.scale * centres,
            np.tile(frame.scale * self.width_, (len(centres), 1)),
        )
        self.notes_: list[str] = []
        return self

    def describe(self) -> dict[str, Any]:
        """What reports say of the network."""
        return {
            "centres": len(self.network_.weights),
            "width": self.width_,
            "held_out_mse": self.held_out_mse_,
            "noise_std": self.noise_std_,
            "weights_dtype": self.weights_dtype_,
            "rounding_error": self.rounding_error_,
        }

    def _choose(self, paths: list[_Path]) -> tuple[int, int]:
        """Position of the width, and number of centres."""
        if self.goal is not None:
            met = [
                (int(np.argmax(path.errors <= self.goal)), position)
                for position, path in enumerate(paths)
                if np.any(path.errors <= self.goal)
            ]
            if met:
                size, position = min(met)
                return position, size
        best = min(range(len(paths)), key=lambda position: float(paths[position].errors.min()))
        return best, int(np.argmin(paths[best].errors))


@dataclass(frozen=True)
class _Path:
    """Candidates in order of choice, and mean squared error on held-out rows by number of centres from 0."""

    chosen: IndexArray
    errors: FloatArray


def _path(
    inputs: FloatArray,
    target: FloatArray,
    label: IndexArray,
    candidates: FloatArray,
    width: float,
    most: int,
    threads: int | None,
) -> _Path:
    """Greedy choice of centres on all rows, and its errors on each fold by a choice on the others."""
    names = np.unique(label)
    products = [_products(inputs[label == n], target[label == n], candidates, width, threads) for n in names]
    total = np.sum(products, axis=0)
    chosen = _choice(total, most)
    if len(names) < 2:
        # Nothing to hold out: the training error itself, which asks for all centres.
        return _Path(chosen - 1, _errors(_choice(total, most), total, total) / len(target))
    sums = np.zeros(len(chosen) + 1)
    for held in products:
        rest = total - held
        errors = _errors(_choice(rest, most), rest, held)
        # A shorter path goes on as it ended.
        padded = np.append(errors, np.full(max(0, len(sums) - len(errors)), errors[-1]))
        sums += padded[: len(sums)]
    return _Path(chosen - 1, sums / len(target))


def _products(
    inputs: FloatArray, target: FloatArray, candidates: FloatArray, width: float, threads: int | None
) -> FloatArray:
    """Products of the columns ``[1, basis functions, target]`` over the rows, shape (m + 2, m + 2)."""
    size = len(candidates) + 2
    total = np.zeros((size, size))
    every = np.arange(inputs.shape[1], dtype=np.intp)
    widths = np.full(candidates.shape, width)
    for start in range(0, len(target), _PIECE):
        rows = slice(start, start + _PIECE)
        columns = np.ones((size, len(target[rows])))
        columns[1:-1] = basis_functions(
            np.ascontiguousarray(inputs[rows]), every, candidates, widths, threads
        )
        columns[-1] = target[rows]
        total += columns @ columns.T
    return total


def _choice(products: FloatArray, most: int) -> IndexArray:
    """Columns in order of choice after the constant, as indices into ``[1, basis functions]``."""
    gram, image = products[:-1, :-1], products[:-1, -1]
    chosen = orthogonal_least_squares(lambda i: gram[i].copy(), np.diag(gram), image, most + 1, forced=1)
    return chosen[chosen > 0]


def _errors(chosen: IndexArray, fitted: FloatArray, held: FloatArray) -> FloatArray:
    """Sum of squared errors on held-out rows for the constant alone, then with each further centre."""
    order = np.append(0, chosen)
    errors = np.empty(len(order))
    for size in range(1, len(order) + 1):
        columns = order[:size]
        gram, image = fitted[np.ix_(columns, columns)], fitted[columns, -1]
        weights = np.linalg.lstsq(gram, image, rcond=1e-13)[0]
        errors[size - 1] = (
            held[-1, -1]
            - 2.0 * weights @ held[columns, -1]
            + weights @ held[np.ix_(columns, columns)] @ weights
        )
    return np.maximum(errors, 0.0)
