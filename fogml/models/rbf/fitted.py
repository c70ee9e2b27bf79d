"""What every regressor with a fitted network does: predict, refit its weights, count, save."""

from __future__ import annotations

from numbers import Integral
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.models.parameters import check_parameters
from fogml.models.rbf.network import Network, Solution, solve_network
from fogml.models.rbf.rates import Edge
from fogml.models.scikit_learn import BaseEstimator, Interval, RegressorMixin, check_is_fitted, validate_data
from fogml.strict import Strict, strictly

_ROUNDING_OF_NOISE = 1e-3
# Greatest change by rounding to float32, as a share of the noise, for keeping float32.


class SavedFit(Strict):
    """Fitted attributes that are saved beside the arrays."""

    n_features_in_: int = Field(ge=1)
    ridge_: float = Field(ge=0.0)
    rows_: int = Field(ge=1)
    noise_std_: float = Field(ge=0.0)
    spread_: float = Field(ge=0.0)
    rounding_error_: float = Field(ge=0.0)
    weights_dtype_: Literal["float32", "float64"]
    notes_: list[str]


class _Saved(Strict):
    """What `NetworkRegressor.to_saved` writes beside the arrays."""

    parameters: dict[str, Any]
    fitted: dict[str, Any]
    columns: list[int]
    edge_columns: list[int]


class NetworkRegressor(RegressorMixin, BaseEstimator):
    """A regressor whose fit ends in a `Network`.

    Attributes
    ----------
    network_ : Network
        The network in the inputs' units.
    ridge_ : float
        Penalty on the square of an output weight, in the squared unit of the target over all rows.
    noise_std_ : float
        Standard deviation of what the network leaves on the training rows.
    rounding_error_ : float
        Greatest change of a training row's value by rounding all numbers to float32.
    weights_dtype_ : str
        Precision of the network's numbers: ``float32`` unless that changes values by over a
        thousandth of the noise. What is saved is what predicts.
    notes_ : list of str
        What a reader of the model's card should know.
    """

    _linear_part = True
    _fitted: ClassVar[type[SavedFit]]
    _parameter_constraints: ClassVar[dict[str, Any]] = {
        "seed": [Interval(Integral, 0, (1 << 32) - 1, closed="both")],
        "threads": [None, Interval(Integral, 1, None, closed="left")],
    }
    threads: int | None
    network_: Network
    solution_: Solution | None

    def predict(self, X: ArrayLike, return_std: bool = False, single: bool = False) -> Any:
        """Values at rows, shape (n,).

        Parameters
        ----------
        X
            Inputs, shape (n, k).
        return_std
            Give the standard deviation of the network's value too, shape (n,): what the noise of
            the training rows leaves open about the output weights, centres and widths being
            known. The noise of a new row, ``noise_std_``, comes on top.
        single
            Evaluate the basis functions in float32: off by at most 1e-6 of the sum of the output
            weights' magnitudes.

        Raises
        ------
        InputError
            If the standard deviation is asked of a loaded network, which does not keep it.
        """
        check_is_fitted(self)
        inputs = np.ascontiguousarray(validate_data(self, X, dtype=np.float64, reset=False))
        values = self.network_(inputs, self.threads, single)
        if not return_std:
            return values
        if self.solution_ is None:
            raise InputError("a loaded network does not know its standard deviation; fit it again")
        return values, self.spread_ * self.solution_.standard_deviation(inputs, self.threads)

    def predict_unchecked(self, X: FloatArray) -> FloatArray:
        """As `predict`, for inputs known to be finite float64 of shape (n, k)."""
        return self.network_(X, self.threads)

    def compact(self) -> Network:
        """The fitted network."""
        check_is_fitted(self)
        return self.network_

    @property
    def parameter_count(self) -> int:
        """Number of centres', widths', weights' and linear numbers."""
        check_is_fitted(self)
        return self.network_.parameter_count

    @property
    def weight_bytes(self) -> int:
        """Bytes of the saved arrays."""
        return sum(array.nbytes for array in self.network_.arrays(self.weights_dtype_).values())

    def refitted(self, X: ArrayLike, y: ArrayLike) -> Self:
        """A new regressor with this one's centres, widths and ridge, output weights solved on other rows.

        The penalty keeps its weight against the number of rows.
        """
        check_is_fitted(self)
        inputs, target = validate_data(self, X, y, dtype=np.float64, y_numeric=True, reset=False)
        inputs, target = np.ascontiguousarray(inputs), np.asarray(target, dtype=np.float64)
        other = type(self)(**self.get_params())
        for name, value in vars(self).items():
            if name.endswith("_"):
                setattr(other, name, value)
        shape = self.network_
        other.ridge_ = self.ridge_ * len(target) / self.rows_
        edge = Edge.of(inputs, shape.edge.columns)
        other._solve(inputs, target, shape.columns, shape.centres, shape.widths, edge)
        return other

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted regressor as JSON-ready values and arrays; the standard deviation is not kept."""
        check_is_fitted(self)
        values = {
            "parameters": {name: _plain(value) for name, value in self.get_params().items()},
            "fitted": {name: _plain(getattr(self, name)) for name in self._fitted.model_fields},
            "columns": self.network_.columns.tolist(),
            "edge_columns": self.network_.edge.columns.tolist(),
        }
        return values, self.network_.arrays(self.weights_dtype_)

    @classmethod
    def from_saved(cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        """The regressor that `to_saved` gave.

        Raises
        ------
        InputError
            If it is no such regressor.
        """
        saved = strictly(_Saved, values, "regressor")
        fitted = strictly(cls._fitted, saved.fitted, "regressor.fitted")
        check_parameters(cls, saved.parameters)
        regressor = cls(**saved.parameters)
        for name, value in fitted:
            setattr(regressor, name, value)
        regressor.network_ = Network.from_arrays(
            fitted.n_features_in_, saved.columns, saved.edge_columns, arrays, fitted.weights_dtype_
        )
        regressor.solution_ = None
        return regressor

    def _solve(
        self,
        inputs: FloatArray,
        target: FloatArray,
        columns: IndexArray,
        centres: FloatArray,
        widths: FloatArray,
        edge: Edge | None = None,
        averaged: tuple[FloatArray, FloatArray] | None = None,
    ) -> None:
        """Solve for the output weights with ``ridge_``, and keep the network, in float32 where harmless.

        `averaged` are averages of the rows over time: slow noise shows in them, white noise is
        smaller there by the root of the number of rows behind each.
        """
        ridge = self.ridge_
        solution = solve_network(inputs, target, columns, centres, widths, ridge, self._linear_part, edge)
        rows, means = (inputs, target) if averaged is None else averaged
        values = solution.network(rows, self.threads)
        slow = float(np.sqrt(np.mean((means - values) ** 2) * len(target) / len(means)))
        rounded = solution.network.rounded()
        self.solution_ = solution
        self.rows_ = len(target)
        self.noise_std_ = solution.noise_std
        self.spread_ = max(solution.noise_std, slow)
        self.rounding_error_ = float(np.max(np.abs(rounded(rows, self.threads) - values)))
        harmless = self.rounding_error_ <= _ROUNDING_OF_NOISE * self.noise_std_
        self.weights_dtype_ = "float32" if harmless else "float64"
        self.network_ = rounded if harmless else solution.network


def _plain(value: Any) -> Any:
    """A parameter or fitted value as JSON-ready."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
