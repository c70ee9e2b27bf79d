"""How far units' constants are spread about their fleet's, each unit seen through noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.arrays import FloatArray

_DEVIATIONS = np.geomspace(0.03, 10.0, 60)
# Deviations that are weighed, in units of the one found and of the noise it was seen through together.


def least_squares(seen: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Own constants of each unit, told apart by a little ridge, and their standard errors, (u, k + 1)."""
    width = len(seen[0][1])
    inverses = [
        np.linalg.inv(information + 1e-9 * np.trace(information) / width * np.eye(width))
        for information, _ in seen
    ]
    own = np.array([inverse @ image for inverse, (_, image) in zip(inverses, seen, strict=True)])
    return own, np.sqrt([np.diag(inverse) for inverse in inverses])


def each_unit(
    seen: Sequence[tuple[FloatArray, FloatArray]], centres: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Posterior mean and covariance of every unit, and its expected squared distance from its centre."""
    inverse = np.linalg.inv(covariance)
    means, spreads, distances = [], [], []
    for (information, image), mean in zip(seen, centres, strict=True):
        spread = np.linalg.inv(information + inverse)
        own = spread @ (image + inverse @ mean)
        means.append(own)
        spreads.append(spread)
        distances.append(float((own - mean) @ inverse @ (own - mean) + np.trace(inverse @ spread)))
    return np.array(means), np.array(spreads), np.array(distances)


def widening(
    seen: Sequence[tuple[FloatArray, FloatArray]],
    centres: FloatArray,
    covariance: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Factors by which deviations between units are larger in the mean than where they are likeliest.

    Few units tell a deviation badly, and one hidden by the noise of runs comes out as next to none in some
    fleets. So each constant's is averaged over, all deviations beforehand alike (A. Gelman, Bayesian Anal. 1
    (2006) 515), the rest of the covariance held.

    Parameters
    ----------
    seen
        Information and image of the rows of each of u units.
    centres
        What the fleet expects of each, shape (u, k + 1).
    covariance
        Of units about their centres, as found, shape (k + 1, k + 1).
    weights
        Of the units; the covariance of one that lies far out is so much larger, shape (u,).

    Returns
    -------
    ndarray
        Roots of the mean squares over those found, shape (k + 1,).
    """
    information = np.array([one for one, _ in seen])
    apart = np.array([image - one @ mean for (one, image), mean in zip(seen, centres, strict=True)])
    found = np.sqrt(np.diag(covariance))
    _, errors = least_squares(seen)
    factors = np.ones(len(found))
    for place, deviation in enumerate(found.tolist()):
        sizes = _DEVIATIONS * np.hypot(deviation, np.median(errors[:, place]))
        likelihood = np.empty(len(sizes))
        for at, size in enumerate(sizes.tolist()):
            scale = np.ones(len(found))
            scale[place] = size / deviation
            inverse = np.linalg.inv(covariance * np.outer(scale, scale))
            whole = information + weights[:, None, None] * inverse
            root = np.linalg.cholesky(whole)
            along = np.linalg.solve(root, apart[..., None])
            levels = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum()
            level = -len(seen) * float(np.linalg.slogdet(inverse)[1])
            likelihood[at] = 0.5 * (float(np.sum(along**2)) - levels - level)
        belief = np.exp(likelihood - likelihood.max()) * sizes
        factors[place] = np.sqrt(belief @ sizes**2 / belief.sum()) / deviation
    return factors
