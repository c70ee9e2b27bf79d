"""A linear model whose coefficients have a prior: what other units' coefficients were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field
from sklearn.utils.validation import check_is_fitted, validate_data

from fogml.errors import InputError
from fogml.models.coefficient_errors import Told, told_by_rows
from fogml.models.linear import LinearRegressor, SavedLinear
from fogml.models.table import TrainingTable
from fogml.runs.run import FloatArray
from fogml.strict import Strict, strictly

_SPREADS = np.logspace(0.0, 8.0, 33)
# Factors by which a unit's prior covariance may be wider than its fleet's.
_FREEDOM = 4.0
# Degrees of freedom of the t distribution that the factors make of the prior.
_DRAWS = 10_000
# Of the predictive distribution: a probability of 5 % is known to 0.2 %.
_TOLD = 0.1
# Least that rows tell of a direction, against what the fleet tells, for the direction to be checked.


@dataclass(frozen=True)
class Prior:
    """Normal distribution of a fleet's coefficients in the columns ``[1, (x - shift) / scale]``.

    Attributes
    ----------
    mean, covariance
        Of the constant and the k coefficients [deg/h], shapes (k + 1,) and (k + 1, k + 1).
    shift, scale
        Of the k columns, in their units, shape (k,).
    units
        Units that mean and covariance are estimated from; infinite where they are known.
    """

    mean: FloatArray
    covariance: FloatArray
    shift: FloatArray
    scale: FloatArray
    units: float = float("inf")

    def columns(self, X: FloatArray) -> FloatArray:
        """The columns of rows of features, shape (n, k + 1)."""
        return np.column_stack([np.ones(len(X)), (X - self.shift) / self.scale])

    def as_dict(self) -> dict[str, Any]:
        """The prior as JSON-ready values."""
        values = {key: np.asarray(value).tolist() for key, value in vars(self).items()}
        return {**values, "units": self.units if np.isfinite(self.units) else None}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Prior:
        """The prior that `as_dict` wrote.

        Raises
        ------
        InputError
            If the numbers do not make a prior.
        """
        try:
            saved = strictly(_SavedPrior, values, "prior")
            units = float("inf") if saved.units is None else saved.units
            names = ("mean", "covariance", "shift", "scale")
            arrays = {name: np.array(getattr(saved, name), dtype=np.float64) for name in names}
            width = len(saved.mean)
            shapes = [arrays[name].shape for name in ("covariance", "shift", "scale")]
            if shapes != [(width, width), (width - 1,), (width - 1,)]:
                raise ValueError("shapes do not match")
            if not np.all(arrays["scale"]):
                raise ValueError("a scale is 0")
            np.linalg.cholesky(arrays["covariance"])
        except (ValueError, InputError, np.linalg.LinAlgError) as error:
            raise InputError(f"the fleet's prior is not understood ({error})") from None
        return cls(**arrays, units=units)


class _SavedPrior(Strict):
    """A prior as `Prior.as_dict` writes it."""

    mean: list[float] = Field(min_length=1)
    covariance: list[list[float]]
    shift: list[float]
    scale: list[float]
    units: float | None = Field(default=None, ge=1.0)


class PriorRegressor(LinearRegressor):
    """Linear model with a normal prior on its coefficients, of a width that the rows may overrule.

    The prior's covariance is multiplied by a factor of at least one, whose distribution makes the
    prior a t distribution; it is averaged over, weighed by the evidence. A unit like its fleet is
    drawn to the fleet's mean where its own rows tell little; an odd one makes wide priors likely,
    and is drawn less. How well the unit agrees with the fleet is told beside, as where rows tell
    little even an odd unit is drawn far.

    What the rows tell is that of :func:`fogml.models.coefficient_errors.told_by_rows`.

    Parameters
    ----------
    prior
        As `Prior.as_dict` gives it.

    Attributes
    ----------
    spread_ : float
        Factor of the prior's covariance with the greatest weight; 1 for a unit like its fleet.
    agreement_ : float
        Probability of a unit of the fleet lying at least as far out, see `agreement`.
    """

    _parameter_constraints: ClassVar[dict[str, Any]] = {"prior": [None, dict]}

    def __init__(self, prior: dict[str, Any] | None = None) -> None:
        self.prior = prior
        self.ridge = 0.0
        self.fit_intercept = True

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        folds: ArrayLike | None = None,
        groups: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> Self:
        """Fit to rows in time order, of the runs `groups` at times `time` [s]; `folds` are not needed.

        Raises
        ------
        InputError
            If there is no prior, or it is for another number of columns.
        """
        inputs, target = validate_data(self, X, y, dtype=np.float64, y_numeric=True)
        if self.prior is None:
            raise InputError("a fleet's prior is needed")
        prior = Prior.from_dict(self.prior)
        if len(prior.shift) != inputs.shape[1]:
            raise InputError(
                f"the fleet's prior is for {len(prior.shift)} columns, {inputs.shape[1]} are given"
            )
        columns = prior.columns(inputs)
        told = told_by_rows(_table(columns, target, groups, time))
        solution, covariance, self.spread_ = posterior(told.information, told.image, prior)
        self._told = told
        self.__dict__.pop("agreement_", None)
        left = target - columns @ solution
        variance = float(left @ left) / max(1.0, len(target) - columns.shape[1])
        to_raw = _to_raw(prior)
        raw = to_raw @ solution
        self.intercept_, self.coef_ = float(raw[0]), raw[1:]
        self.covariance_ = to_raw @ covariance @ to_raw.T
        self.residual_std_ = float(np.sqrt(variance))
        self.ridge_, self.rank_ = 0.0, inputs.shape[1]
        return self

    @cached_property
    def agreement_(self) -> float:
        """Probability of a unit of the fleet lying at least as far out, see `agreement`."""
        check_is_fitted(self)
        return agreement(self._told, Prior.from_dict(self.prior or {}))

    def refitted(self, X: ArrayLike, y: ArrayLike) -> PriorRegressor:
        """A new regressor with the same prior fitted to other rows."""
        check_is_fitted(self)
        return PriorRegressor(self.prior).fit(X, y)

    def to_saved(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """The fitted regressor as JSON-ready values and arrays."""
        values, arrays = super().to_saved()
        return {**values, "prior": self.prior, "spread": self.spread_, "agreement": self.agreement_}, arrays

    @classmethod
    def from_saved(cls, values: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Self:
        """The regressor that `to_saved` gave.

        Raises
        ------
        InputError
            If it is no such regressor.
        """
        saved = strictly(_SavedShared, values, "regressor")
        plain = LinearRegressor.from_saved({name: values[name] for name in SavedLinear.model_fields}, arrays)
        Prior.from_dict(saved.prior)
        model = cls(prior=saved.prior)
        for name, value in vars(plain).items():
            if name.endswith("_"):
                setattr(model, name, value)
        model.spread_ = saved.spread
        model.agreement_ = saved.agreement
        return model


class _SavedShared(SavedLinear):
    """What `PriorRegressor.to_saved` writes beside the arrays."""

    prior: dict[str, Any]
    spread: float
    agreement: float


def posterior(
    information: FloatArray, image: FloatArray, prior: Prior, spreads: Sequence[float] | FloatArray = _SPREADS
) -> tuple[FloatArray, FloatArray, float]:
    """Mean and covariance of coefficients given rows, and the likeliest factor of the prior's covariance.

    Parameters
    ----------
    information, image
        ``Z'Z / s^2`` and ``Z'y / s^2`` of the rows, shapes (k + 1, k + 1) and (k + 1,).
    prior
        What the fleet tells.
    spreads
        Factors to average over.
    """
    root, values, seen = _directions(information, image, prior)
    gains, weights = [], []
    for spread in spreads:
        gain = spread / (1.0 + spread * values)
        gains.append(gain)
        # The t distribution as a mixture of normals: its factor is inverse gamma.
        factor = -(0.5 * _FREEDOM) * np.log(spread) - 0.5 * _FREEDOM / spread
        weights.append(factor + 0.5 * float(gain @ seen**2) - 0.5 * float(np.log1p(spread * values).sum()))
    share = np.exp(np.array(weights) - np.max(weights))
    share /= share.sum()
    along = np.array(gains) * seen
    mean = share @ along
    # Scatter about each factor's mean, and of those means.
    covariance = np.diag(share @ np.array(gains)) + ((along - mean).T * share) @ (along - mean)
    best = float(np.asarray(spreads)[int(np.argmax(share))])
    return prior.mean + root @ mean, root @ covariance @ root.T, best


def agreement(told: Told, prior: Prior) -> float:
    """Probability that a unit of the fleet would lie as far from its mean as these rows do, or farther.

    The unit's own estimate is compared with the fleet's mean under the covariance of both together
    (a prior-predictive check: G. Box, J. R. Stat. Soc. A 143 (1980) 383), in the directions of
    which the rows tell something: all jointly, by the sum of squares, and each for itself, by the
    largest one. What counts is the lesser of the two probabilities, against how small it comes out for
    units of the fleet, drawn: their constants from the t distribution that a mean and a covariance estimated
    from so many units predict (A. Gelman et al., Bayesian Data Analysis, 3.6), their noise from the models
    that the rows speak for, each as often as it is likely.
    0 if the rows tell nothing, as then an odd unit would look the same.

    Parameters
    ----------
    told
        What the unit's rows tell of its constants.
    prior
        What the fleet tells.
    """
    directions, values, seen = _directions(told.information, told.image, prior)
    heard = values > _TOLD
    if not heard.any():
        return 0.0
    precise = values[heard]
    squares = seen[heard] ** 2 / (precise * (1.0 + precise))
    random = np.random.default_rng(0)
    unit = random.standard_normal((_DRAWS, len(precise)))
    noise = _noise_drawn(told, directions[:, heard] / np.sqrt(precise), random)
    if np.isfinite(prior.units):
        freedom = random.chisquare(max(prior.units - len(prior.mean), 1.0), _DRAWS)
        unit *= np.sqrt((1.0 + 1.0 / prior.units) * (prior.units - 1.0) / freedom)[:, None]
    drawn = (unit * np.sqrt(precise) + noise) ** 2 / (1.0 + precise)
    figures = np.vstack(
        [np.append(drawn.sum(axis=1), squares.sum()), np.append(drawn.max(axis=1), squares.max())]
    )
    # Of each figure the share of draws that are larger; then how rarely the lesser share is so small.
    ranks = np.argsort(np.argsort(-figures, axis=1), axis=1).min(axis=0)
    return float(np.mean(ranks[:-1] <= ranks[-1]))


def _directions(
    information: FloatArray, image: FloatArray, prior: Prior
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Directions in which rows and prior are both independent.

    Returns
    -------
    The directions as columns, of unit variance in the prior; what the rows tell of each, its inverse
    variance; and that times their estimate's distance from the prior's mean.
    """
    root = np.linalg.cholesky(prior.covariance)
    values, vectors = np.linalg.eigh(root.T @ information @ root)
    directions = root @ vectors
    return directions, np.maximum(values, 0.0), directions.T @ (image - information @ prior.mean)


def _noise_drawn(told: Told, directions: FloatArray, random: np.random.Generator) -> FloatArray:
    """Noise of what rows tell of directions, of unit variance on average, shape (_DRAWS, directions)."""
    along = told.columns @ directions
    model = random.choice(len(told.weights), _DRAWS, p=told.weights)
    noise = random.standard_normal((_DRAWS, along.shape[1]))
    for place in np.unique(model):
        squares, axes = np.linalg.eigh(along.T @ told.noise[place] @ along)
        noise[model == place] *= np.sqrt(np.maximum(squares, 0.0))
        noise[model == place] @= axes.T
    if np.isfinite(told.freedom):
        noise *= np.sqrt(told.freedom / random.chisquare(told.freedom, _DRAWS))[:, None]
    return noise


def _table(
    columns: FloatArray, target: FloatArray, groups: ArrayLike | None, time: ArrayLike | None
) -> TrainingTable:
    """Rows of runs `groups` at times; by default rows of one run that follow each other evenly."""
    count = len(target)
    run = np.zeros(count, dtype=np.intp) if groups is None else np.unique(groups, return_inverse=True)[1]
    times = np.arange(count, dtype=np.float64) if time is None else np.asarray(time, dtype=np.float64)
    return TrainingTable(columns, target, run, times, np.zeros(count, dtype=np.intp))


def _to_raw(prior: Prior) -> FloatArray:
    """Matrix from (constant, coefficients) in the prior's columns to those in the features' own."""
    width = len(prior.shift)
    matrix = np.zeros((width + 1, width + 1))
    matrix[0, 0] = 1.0
    matrix[0, 1:] = -prior.shift / prior.scale
    matrix[1:, 1:] = np.diag(1.0 / prior.scale)
    return matrix
