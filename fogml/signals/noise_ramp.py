"""The rate ramp of a series, told from random walks that it hardly shows."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.noise_search import NoiseSearch
from fogml.signals.spectrum_fit import SpectrumFit

_WALKS, _BEYOND = 9, 1.25
"""How many random walks errors are averaged over, up to how much beyond the interval's end."""


def ramp(
    search: NoiseSearch, walk_upper: float, removed: FloatArray, ramps: int | None
) -> tuple[float, float] | None:
    """The ramp and its standard error [deg/h/s], or None without one.

    It is that of the best fit: of several runs the root mean square of theirs. A walk that a series of its
    length does not show moves its two ends apart as a ramp does, so that the error is averaged over walks,
    likelihoods as weights.

    Parameters
    ----------
    search
        The models and their weights.
    walk_upper
        Upper end of the random walk's interval [deg/h/sqrt(s)].
    removed
        What was taken off the constants before [deg/h/s].
    ramps
        How many of the constants are ramps; all if None.
    """
    best = search.best
    count = len(best.constants) if ramps is None else min(ramps, len(best.constants))
    if count == 0:
        return None
    fits = _over_walks(search, _BEYOND * walk_upper) or [best]
    variances = [
        np.trace(fit.covariance[:count, :count]) + np.sum((fit.constants - best.constants)[:count] ** 2)
        for fit in fits
    ]
    likelihoods = np.exp(min(fit.loss for fit in fits) - np.array([fit.loss for fit in fits]))
    size = np.sqrt(np.mean((best.constants + removed)[:count] ** 2))
    return float(size), float(np.sqrt(np.average(variances, weights=likelihoods)) / count)


def _over_walks(search: NoiseSearch, most: float) -> list[SpectrumFit]:
    """The best model at random walks from none to `most` [deg/h/sqrt(s)], evenly apart."""
    choice = search.candidates[0]
    place = choice.fit.terms.names.index("K")
    fits = [choice.fit]
    for size in np.linspace(0.0, most, _WALKS):
        found = choice.model.fit(fits[-1], held=(place, float(size**2)), excess=search.excess)
        if np.isfinite(found.loss):
            fits.append(found)
    return fits[1:]
