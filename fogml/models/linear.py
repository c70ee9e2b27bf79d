"""Linear least squares with an optional ridge, for wide and ill-conditioned columns and many rows."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.models.compact import affine
from fogml.models.folds import dealt_folds
from fogml.models.parameters import check_parameters, expect_arrays
from fogml.models.scikit_learn import (
    BaseEstimator,
    Interval,
    RegressorMixin,
    StrOptions,
    check_is_fitted,
    validate_data,
)
from fogml.models.tall_least_squares import Condensed, Part, condense
from fogml.strict import Strict, strictly

if TYPE_CHECKING:
    from fogml.models.rbf.network import Network

RIDGE_GRID = (0.0, *np.logspace(-8, 1, 19).tolist())
"""Ridges that ``ridge="auto"`` chooses from."""
_RANK_TOLERANCE = 1e-12


class SavedLinear(Strict):
    """What `LinearRegressor.to_saved` writes beside the arrays."""

    ridge: Annotated[float, Field(ge=0.0)] | Literal["auto"]
    fit_intercept: bool
    ridge_used: float = Field(ge=0.0)
    rank: int = Field(ge=0)
    residual_std: float = Field(ge=0.0)
    standard_errors: list[Annotated[float, Field(ge=0.0)]] = Field(min_length=1)


class LinearRegressor(RegressorMixin, BaseEstimator):
    """Linear model ``y = intercept + x @ coef``, by QR and SVD on centred and scaled columns.

    Minimises ``mean((y - prediction)**2) + ridge * sum((coef * column_std)**2)``; the intercept
    is not penalised. Columns that others tell (rank deficiency) get the solution of least norm
    on scaled columns.

    Parameters
    ----------
    ridge
        0, a positive number, or ``"auto"``: the one of `RIDGE_GRID` with the least squared error
        on left-out folds of time. Errors on blocks of time are used and not the leave-one-out
        or generalised cross-validation shortcuts, because those take the noise for white, and
        a gyro's is not.
    fit_intercept
        Whether there is an intercept.

    Attributes
    ----------
    coef_ : (k,)
        Coefficients, in y's unit per column's unit.
    intercept_ : float
        Intercept.
    ridge_ : float
        The ridge used.
    rank_ : int
        Rank of the centred columns.
    residual_std_ : float
        Root of the residual sum of squares over the rows less the effective parameters.
    covariance_ : (k + 1, k + 1)
        Covariance of (intercept, coefficients): for white residuals as fitted here; a drift model puts
        that of the residuals' own noise in its place, which is larger.
    shrinkage_ : (k + 1,)
        What the ridge takes off (intercept, coefficients): those without it less those with it.
    cross_validation_ : dict
        With ``ridge="auto"``, mean squared error on left-out folds for each ridge.
    """

    linear_beyond = True
    _parameter_constraints: ClassVar[dict[str, Any]] = {
        "ridge": [StrOptions({"auto"}), Interval(Real, 0.0, None, closed="left")],
        "fit_intercept": ["boolean"],
    }

    def __init__(self, ridge: float | Literal["auto"] = 0.0, fit_intercept: bool = True) -> None:
        self.ridge = ridge
        self.fit_intercept = fit_intercept

    def fit(self, X: ArrayLike, y: ArrayLike, folds: ArrayLike | None = None) -> Self:
        """Fit to rows in time order.

        Parameters
        ----------
        X
            Columns, shape (n, k).
        y
            Values, shape (n,).
        folds
            Fold of each row, from 0, for ``ridge="auto"``; by default 20 blocks of
            neighbouring rows dealt to 5 folds in turn.
        """
        least = 2 if isinstance(self.ridge, str) else 1
        matrix, target = validate_data(self, X, y, dtype=np.float64, y_numeric=True, ensure_min_samples=least)
        labels = dealt_folds(len(target)) if folds is None else np.asarray(folds, dtype=np.intp)
        if labels.shape != target.shape:
            raise InputError(f"folds has shape {labels.shape}, there are {len(target)} rows")
        if np.count_nonzero(np.diff(labels)) > len(labels) // 64:
            # Folds that change from row to row are brought together, to be read in long pieces.
            order = np.argsort(labels, kind="stable")
            matrix, target, labels = matrix[order], target[order], labels[order]
        return self.fit_parts([Part(np.asarray(target, dtype=np.float64), matrix.__getitem__, labels)])

    def fit_parts(self, parts: Sequence[Part]) -> Self:
        """Fit to rows whose columns are built piece by piece, so that they never exist at once."""
        check_parameters(type(self), self.get_params(deep=False))
        automatic = isinstance(self.ridge, str)
        if not automatic:
            parts = [Part(part.target, part.columns, np.zeros_like(part.folds)) for part in parts]
        n_folds = 1 + max(int(part.folds.max(initial=0)) for part in parts)
        condensed = condense(parts, n_folds)
        self.n_features_in_ = len(condensed.shift)
        ridge = self._choose_ridge(condensed) if automatic else float(self.ridge)
        self._solve(condensed, ridge)
        return self

    def predict(self, X: ArrayLike) -> FloatArray:
        """Values for rows of columns, shape (n,)."""
        check_is_fitted(self)
        matrix = validate_data(self, X, dtype=np.float64, reset=False)
        return self.predict_unchecked(matrix)

    def predict_unchecked(self, X: FloatArray) -> FloatArray:
        """As `predict`, for columns known to be finite float64 of shape (n, k)."""
        return np.asarray(X @ self.coef_ + self.intercept_)

    def refitted(self, X: ArrayLike, y: ArrayLike) -> LinearRegressor:
        """A new regressor fitted to other rows with the ridge of this one."""
        check_is_fitted(self)
        return LinearRegressor(ridge=self.ridge_, fit_intercept=self.fit_intercept).fit(X, y)

    def compact(self) -> Network:
        """The fitted regressor as a network without Gaussians."""
        check_is_fitted(self)
        return affine(self.coef_, self.intercept_)

    def standard_errors(self) -> FloatArray:
        """Standard errors of (intercept, coefficients), shape (k + 1,): the roots of `covariance_`."""
        check_is_fitted(self)
        return np.asarray(np.sqrt(np.diag(self.covariance_)))

    def coefficient_table(self, names: Sequence[str]) -> dict[str, dict[str, float]]:
        """Value and standard error of each coefficient by its column's name; the intercept is ``1``."""
        errors = self.standard_errors().tolist()
        table = {"1": {"value": self.intercept_, "se": errors[0]}} if self.fit_intercept else {}
        for name, value, error in zip(names, self.coef_.tolist(), errors[1:], strict=True):
            table[name] = {"value": value, "se": error}
        return table

    @property
    def parameter_count(self) -> int:
        """Number of coefficients, the intercept included."""
        return len(self.coef_) + int(self.fit_intercept)

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted regressor as JSON-ready values and arrays."""
        check_is_fitted(self)
        values = {
            "ridge": self.ridge,
            "fit_intercept": self.fit_intercept,
            "ridge_used": self.ridge_,
            "rank": self.rank_,
            "residual_std": self.residual_std_,
            "standard_errors": self.standard_errors().tolist(),
        }
        return values, {"coef": self.coef_, "intercept": np.array([self.intercept_])}

    @classmethod
    def from_saved(cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        """The regressor that `to_saved` gave; of the covariance its diagonal remains.

        Raises
        ------
        InputError
            If it is no such regressor.
        """
        saved = strictly(SavedLinear, values, "regressor")
        width = len(saved.standard_errors) - 1
        expect_arrays(arrays, {"coef": (np.float64, (width,)), "intercept": (np.float64, (1,))})
        model = cls(ridge=saved.ridge, fit_intercept=saved.fit_intercept)
        model.coef_ = arrays["coef"]
        model.intercept_ = float(arrays["intercept"][0])
        model.n_features_in_ = width
        model.ridge_ = saved.ridge_used
        model.rank_ = saved.rank
        model.residual_std_ = saved.residual_std
        model.covariance_ = np.diag(np.array(saved.standard_errors) ** 2)
        return model

    def _choose_ridge(self, condensed: Condensed) -> float:
        held = [fold for fold, count in enumerate(condensed.counts) if count]
        if len(held) < 2:
            raise InputError("ridge 'auto' needs rows in at least two folds; state a ridge instead")
        errors = np.zeros(len(RIDGE_GRID))
        for fold in held:
            rest = np.concatenate([condensed.factors[other] for other in held if other != fold])
            count = int(condensed.counts.sum() - condensed.counts[fold])
            system = _System(condensed, rest, count, self.fit_intercept)
            rows = condensed.factors[fold]
            for place, ridge in enumerate(RIDGE_GRID):
                left = rows[:, -1] - rows[:, :-1] @ system.solution(ridge)
                errors[place] += left @ left
        errors /= condensed.counts.sum()
        self.cross_validation_ = dict(zip(RIDGE_GRID, errors.tolist(), strict=True))
        return float(RIDGE_GRID[int(np.argmin(errors))])

    def _solve(self, condensed: Condensed, ridge: float) -> None:
        count = int(condensed.counts.sum())
        rows = np.concatenate(condensed.factors)
        system = _System(condensed, rows, count, self.fit_intercept)
        solution = system.solution(ridge)
        left = rows[:, -1] - rows[:, :-1] @ solution
        self.ridge_ = ridge
        self.rank_ = system.rank
        self.coef_, self.intercept_ = self._raw(condensed, solution)
        bare, level = self._raw(condensed, system.solution(0.0))
        self.shrinkage_ = np.append(level, bare) - np.append(self.intercept_, self.coef_)
        freedom = count - system.effective_parameters(ridge) - int(self.fit_intercept)
        variance = float(left @ left) / freedom if freedom > 0 else 0.0
        self.residual_std_ = float(np.sqrt(variance))
        self.covariance_ = variance * system.unit_covariance(ridge)

    def _raw(self, condensed: Condensed, solution: FloatArray) -> tuple[FloatArray, float]:
        """Coefficients of raw columns and intercept, of a solution in the condensed frame."""
        coef = np.asarray(solution[1:] / condensed.scale)
        if not self.fit_intercept:
            return coef, 0.0
        return coef, float(solution[0] + condensed.y_shift - condensed.shift @ coef)


class _System:
    """A least-squares problem in condensed rows: its singular values, and solutions for any ridge.

    Solutions are (b0, b) in the condensed frame, where ``y - y_shift = b0 + (x - shift)/scale @ b``.
    """

    def __init__(self, frame: Condensed, rows: FloatArray, count: int, intercept: bool) -> None:
        self._frame, self._count, self._intercept = frame, count, intercept
        if intercept:
            # The column of ones stands first: what QR leaves below its row is centred.
            triangle: FloatArray = np.asarray(np.linalg.qr(rows, mode="r"))
            self._mean = triangle[0] / triangle[0, 0]
            columns, target = triangle[1:, 1:-1], triangle[1:, -1]
            level = frame.shift / frame.scale
        else:
            columns = rows[:, 1:-1] + rows[:, :1] * (frame.shift / frame.scale)
            target = rows[:, -1] + rows[:, 0] * frame.y_shift
            level = np.zeros(len(frame.shift))
        self._spread = np.linalg.norm(columns, axis=0) / np.sqrt(count)
        # A column that does not vary but for rounding holds nothing.
        self._constant = self._spread <= 1e-13 * np.maximum(1.0, np.abs(level))
        self._spread[self._constant] = 1.0
        columns = np.where(self._constant, 0.0, columns / self._spread)
        if columns.size:
            left, values, right = np.linalg.svd(columns, full_matrices=False)
        else:
            left, values, right = np.empty((len(columns), 0)), np.empty(0), np.empty((0, columns.shape[1]))
        self.rank = int(np.count_nonzero(values > _RANK_TOLERANCE * values.max(initial=0.0)))
        self._values, self._right = values[: self.rank], right[: self.rank]
        self._target = left.T[: self.rank] @ target

    def solution(self, ridge: float) -> FloatArray:
        """Solution (b0, b) in the condensed frame, shape (k + 1,)."""
        gains = self._values / (self._values**2 + ridge * self._count)
        slopes = (gains * self._target) @ self._right / self._spread
        if self._intercept:
            first = self._mean[-1] - self._mean[1:-1] @ slopes
        else:
            first = slopes @ (self._frame.shift / self._frame.scale) - self._frame.y_shift
        return np.concatenate(([first], slopes))

    def effective_parameters(self, ridge: float) -> float:
        """Trace of the smoother, the intercept not counted."""
        return float(np.sum(self._values**2 / (self._values**2 + ridge * self._count)))

    def unit_covariance(self, ridge: float) -> FloatArray:
        """Covariance of (intercept, coefficients) in raw columns for residuals of variance 1."""
        gains = self._values / (self._values**2 + ridge * self._count)
        half = gains[:, None] * self._right / (self._spread * self._frame.scale)
        slopes = half.T @ half
        covariance = np.zeros((len(slopes) + 1, len(slopes) + 1))
        covariance[1:, 1:] = slopes
        if self._intercept:
            mean = self._frame.shift + self._frame.scale * self._mean[1:-1]
            covariance[0, 1:] = covariance[1:, 0] = -slopes @ mean
            covariance[0, 0] = mean @ slopes @ mean + 1.0 / self._count
        return covariance
