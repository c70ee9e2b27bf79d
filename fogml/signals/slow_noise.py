"""Slow noise that a run hardly tells: sizes of it that are likely, and the ramp told from them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.noise_search import NoiseSearch
from fogml.signals.spectrum_fit import SpectrumFit, SpectrumModel

_SIZES = 9
"""Sizes of a term that are tried, evenly apart from none on."""
_RULED_OUT = 3.0
"""Nats of likelihood that rule a size out: 2.4 standard errors."""
_DOUBLINGS = 12
"""Times that the greatest size is doubled at most until it is ruled out."""
_BEYOND = 1.25
"""How far beyond its interval's end a random walk is tried."""


def slow_fits(model: SpectrumModel, names: Sequence[str]) -> tuple[list[SpectrumFit], FloatArray]:
    """Fits of a model at sizes of each of some terms, and their shares.

    Shares are likelihoods under sizes, the roots of coefficients, that are all as likely beforehand; each
    term has the same in all.
    """
    best = model.fit()
    fits: list[SpectrumFit] = []
    shares: list[FloatArray] = []
    for name in names:
        place = best.terms.names.index(name)
        sizes = np.linspace(0.0, _ruled_out(model, best, place), _SIZES)
        found = _at_sizes(model, best, place, sizes) or [best]
        fits += found
        shares.append(_likelihoods(found) / len(names))
    return fits, np.concatenate(shares)


def ramp(
    search: NoiseSearch, walk_upper: float, removed: FloatArray, ramps: int | None, off: float
) -> tuple[float, float, float] | None:
    """The ramp and the ends of its interval [deg/h/s], or None without one.

    It is that of the best fit: of several runs the root mean square of theirs, less what errors add to it. A
    walk that a series of its length does not show moves its two ends apart as a ramp does, so that the error
    is averaged over walks, likelihoods as weights.

    The length of k ramps in units of their error is nearly normal, of deviation 1 at most, about the root of
    the true length's square and k - 1.

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
    off
        Standard errors from the ramp to either end.
    """
    best = search.best
    count = len(best.constants) if ramps is None else min(ramps, len(best.constants))
    if count == 0:
        return None
    model, place = search.candidates[0].model, best.terms.names.index("K")
    sizes = np.linspace(0.0, _BEYOND * walk_upper, _SIZES)
    fits = _at_sizes(model, best, place, sizes, search.excess) or [best]
    scatter = [
        np.diag(fit.covariance)[:count] + (fit.constants - best.constants)[:count] ** 2 for fit in fits
    ]
    variances = _likelihoods(fits) @ scatter
    # As many ramps of one error as scatter alike (F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110).
    each = float(variances @ variances) / max(float(variances.sum()), 1e-300)
    size = np.sqrt(np.mean((best.constants + removed)[:count] ** 2))
    lengths = np.maximum(size + np.array([0.0, -off, off]) * np.sqrt(each / count), 0.0)
    added = max(float(variances.sum()) - each, 0.0) / count
    found, lower, upper = np.sqrt(np.maximum(lengths**2 - added, 0.0)).tolist()
    return found, lower, upper


def _at_sizes(
    model: SpectrumModel, best: SpectrumFit, place: int, sizes: Iterable[float], excess: float = 0.0
) -> list[SpectrumFit]:
    """Fits where a term is held at sizes, each from the one before."""
    found = [best]
    for size in sizes:
        fit = model.fit(found[-1], held=(place, float(size**2)), excess=excess)
        if np.isfinite(fit.loss):
            found.append(fit)
    return found[1:]


def _likelihoods(fits: Sequence[SpectrumFit]) -> FloatArray:
    """Likelihoods of fits, which add up to 1."""
    losses = np.array([fit.loss for fit in fits])
    likelihoods = np.exp(losses.min() - losses)
    return np.asarray(likelihoods / likelihoods.sum())


def _ruled_out(model: SpectrumModel, best: SpectrumFit, place: int) -> float:
    """A size of a term that the data rule out."""
    shape = model.design(best.log_corner)[0][:, place]
    used = best.used & (shape > 0.0)
    size = float(np.sqrt(max(float(np.min(best.density[used] / shape[used])), best.coefficients[place])))
    for _ in range(_DOUBLINGS):
        if not model.fit(best, held=(place, size**2)).loss - best.loss < _RULED_OUT:
            break
        size *= 2.0
    return size
