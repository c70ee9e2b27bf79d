"""The prior of a unit's coefficients: what other units' coefficients were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, PlainSerializer, with_config

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.signals.distributions import chi2_sf
from fogml.strict import CONTENT, as_written, strictly

_SPREADS = np.logspace(0.0, 8.0, 33)
# Factors by which a unit's prior covariance may be wider than its fleet's.
_FREEDOM = 4.0
# Degrees of freedom of the t distribution that the factors make of the prior.
_DRAWS = 10_000
# Of the predictive distribution: a probability of 5 % is known to 0.2 %.
_TOLD = 0.1
# Least that rows tell of a direction, against what the fleet tells, for the direction to be checked.

if TYPE_CHECKING:
    Vector = FloatArray
    Matrix = FloatArray
else:
    _AS_ARRAY = (AfterValidator(partial(np.array, dtype=np.float64)), PlainSerializer(np.ndarray.tolist))
    Vector = Annotated[list[float], *_AS_ARRAY]
    """A field that is a list of numbers in a file, and an array here."""
    Matrix = Annotated[list[list[float]], *_AS_ARRAY]
    """A field of lists of numbers in a file."""
_OR_NONE = (
    BeforeValidator(lambda units: float("inf") if units is None else units),
    PlainSerializer(lambda units: units if np.isfinite(units) else None),
)
"""In a file infinitely many units are null."""


@with_config(CONTENT)
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
    wider
        Factors by which standard deviations of a next unit are wider than `covariance` says, as few units, or
        ones seen through noise, tell that badly; shape (k + 1,), none where they are known.
    """

    mean: Annotated[Vector, Field(min_length=1)]
    covariance: Matrix
    shift: Vector
    scale: Vector
    units: Annotated[float, Field(ge=1.0, allow_inf_nan=True), *_OR_NONE] = float("inf")
    wider: Vector | None = None

    @property
    def of_a_next(self) -> FloatArray:
        """Covariance of a next unit's coefficients, shape (k + 1, k + 1)."""
        return self.covariance if self.wider is None else self.covariance * np.outer(self.wider, self.wider)

    def columns(self, X: FloatArray) -> FloatArray:
        """The columns of rows of features, shape (n, k + 1)."""
        return np.column_stack([np.ones(len(X)), (X - self.shift) / self.scale])

    def to_raw(self) -> FloatArray:
        """Matrix from constant and coefficients in these columns to those in the features' own."""
        matrix = np.diag(1.0 / np.append(1.0, self.scale))
        matrix[0, 1:] = -self.shift / self.scale
        return matrix

    def as_dict(self) -> dict[str, Any]:
        """The prior as JSON-ready values."""
        return {key: value for key, value in as_written(self).items() if key != "wider" or value is not None}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Prior:
        """The prior that `as_dict` wrote."""
        try:
            return strictly(cls, values, "prior").checked()
        except InputError as error:
            raise InputError(f"the fleet's prior is not understood ({error})") from None

    def checked(self) -> Prior:
        """The prior, once its numbers make one."""
        width = len(self.mean)
        shapes = [self.covariance.shape, self.shift.shape, self.scale.shape]
        if shapes != [(width, width), (width - 1,), (width - 1,)]:
            raise InputError("shapes do not match")
        if not np.all(self.scale):
            raise InputError("a scale is 0")
        try:
            np.linalg.cholesky(self.covariance)
        except np.linalg.LinAlgError as error:
            raise InputError(str(error)) from None
        if self.wider is not None and (self.wider.shape != (width,) or not np.all(self.wider > 0.0)):
            raise InputError(f"{width} positive factors 'wider' were expected")
        return self


def posterior(
    information: FloatArray, image: FloatArray, prior: Prior, spreads: Sequence[float] | FloatArray = _SPREADS
) -> tuple[FloatArray, FloatArray, float]:
    """Mean and covariance of coefficients given rows, and the likeliest factor of the prior's covariance.

    The prior's covariance is multiplied by a factor of at least one, whose distribution makes the prior a t
    distribution; it is averaged over, weighed by the evidence. A unit like its fleet is drawn to the fleet's
    mean where its own rows tell little; an odd one makes wide priors likely, and is drawn less.

    Parameters
    ----------
    information, image
        ``Z'Z`` and ``Z'y`` of rows whose noise is of unit covariance, shapes (k + 1, k + 1) and (k + 1,).
    prior
        What the fleet tells.
    spreads
        Factors to average over.
    """
    root, values, seen = _directions(information, image, prior.mean, prior.of_a_next)
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


def agreement(information: FloatArray, image: FloatArray, prior: Prior) -> float:
    """Probability that a unit of the fleet would lie as far from its mean as these rows do, or farther.

    The unit's own estimate is compared with the fleet's mean under the covariance of both together
    (a prior-predictive check: G. Box, J. R. Stat. Soc. A 143 (1980) 383), in the directions of
    which the rows tell something: all jointly, by the sum of squares, and each for itself, by the
    largest one. What counts is the lesser of the two probabilities, against how small it comes out for
    units of the fleet, drawn: their constants from the t distribution that a mean and a covariance estimated
    from so many units predict (A. Gelman et al., Bayesian Data Analysis, 3.6).
    0 if the rows tell nothing, as then an odd unit would look the same.

    `information` and `image` are what the unit's rows tell of its constants, as in `posterior`.
    """
    precise, squares = _heard(information, image, prior)
    if not len(precise):
        return 0.0
    random = np.random.default_rng(0)
    unit = random.standard_normal((_DRAWS, len(precise)))
    noise = random.standard_normal((_DRAWS, len(precise)))
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


def rarity(information: FloatArray, image: FloatArray, prior: Prior) -> float:
    """Probability that a unit of the fleet lies so far from its mean, or farther; 1 if its rows tell nothing.

    By chi-square of the directions of which the rows tell something, the fleet's mean and covariance taken as
    they are: for the units that these are estimated from.

    `information` and `image` are as in `agreement`.
    """
    precise, squares = _heard(information, image, prior)
    return float(chi2_sf(squares.sum(), len(precise))) if len(precise) else 1.0


def _heard(information: FloatArray, image: FloatArray, prior: Prior) -> tuple[FloatArray, FloatArray]:
    """What rows tell of directions that they do tell, and the squares of their distances from the mean."""
    _, values, seen = _directions(information, image, prior.mean, prior.covariance)
    heard = values > _TOLD
    precise = values[heard]
    return precise, seen[heard] ** 2 / (precise * (1.0 + precise))


def _directions(
    information: FloatArray, image: FloatArray, mean: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Directions in which rows and prior are both independent.

    Returns
    -------
    The directions as columns, of unit variance in the prior; what the rows tell of each, its inverse
    variance; and that times their estimate's distance from the prior's mean.
    """
    root = np.linalg.cholesky(covariance)
    values, vectors = np.linalg.eigh(root.T @ information @ root)
    directions = root @ vectors
    return directions, np.maximum(values, 0.0), directions.T @ (image - information @ mean)
