"""Intervals of noise terms by profile likelihood, where no term can be negative.

Far from every bound twice the loss is chi-square of one degree of freedom. A term beside one that is near its
bound is not: quantisation of none is found to be some in half of all runs, and takes that of the white noise,
while in the others it cannot give it back. By what the bounds are at the interval's ends the loss has another
distribution (S. G. Self & K.-Y. Liang, J. Am. Stat. Assoc. 82, 1987, 605), whose quantile says how far an end
may lie (hybrid resampling: C.-S. Chuang & T. L. Lai, Statistica Sinica 10, 2000, 1). It is drawn:
coefficients scatter by Fisher's information, and bounds are kept.

Of slow noise that a run hardly tells: sizes of it that are likely, and the ramp told from them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import chain, combinations

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.signals.noise_search import NoiseSearch
from fogml.signals.spectrum_fit import SpectrumFit, SpectrumModel

_DRAWS = 4096
"""Runs drawn: the quantile of 5 % is told to 2 % of a standard error, as that without bounds is known."""
_NEAR = 4.0
"""Standard errors from which on a bound is not felt: one run in 30000."""
_SAME = 0.02
"""Standard errors by which ends are not looked for again: as well as the draws tell."""
_TOLD = 1e-3
"""Standard errors to which a root is found."""
_FLAT = 1e-9
"""Least information of a direction, of 1 along each term: what is less has no end anyway."""


def term_interval(search: NoiseSearch, name: str, level: float) -> tuple[float, float]:
    """Profile likelihood interval of a coefficient; from 0 where models without it fit as well.

    Parameters
    ----------
    search
        Models and their weights.
    name
        The term, one of the best model's.
    level
        Coverage; half of what is left lies beyond either end.
    """
    from scipy.special import ndtri

    alone = float(ndtri(0.5 + 0.5 * level))
    value, place = search.best[name], search.best.terms.names.index(name)
    model = search.candidates[0].model
    # The scale on which the term alone would be told from the others' scatter.
    used = search.best.used
    share = model.design(search.best.log_corner)[0][used, place] / search.best.density[used]
    information = 0.5 * float(np.sum(model.freedom[used] * share**2))
    scale = alone / np.sqrt(information) if information > 0.0 else max(value, 1e-300)
    fits: dict[int, SpectrumFit] = {}
    least = search.profile_loss(name, value, fits)

    def root(coefficient: float) -> float:
        """Standard errors off the best value: straight in the coefficient, nearly."""
        lost = search.profile_loss(name, coefficient, fits) - least
        return float(np.sqrt(2.0 * max(lost, 0.0)))

    def allowed(direction: float) -> float:
        """What the root may be at an end, by the fit there."""
        there = fits.get(0, search.best)
        information = model.information(there, search.excess)
        return allowed_root(information, there.coefficients, place, direction, level)

    def end(limit: float, direction: float, most: float, reach: float) -> float:
        """Where the root is the most, from the best value on; at the limit if it is nowhere."""
        near, at_near = value, -most
        while True:
            far = value + direction * reach
            if (far - limit) * direction >= 0.0:
                far = limit
            at_far = root(far) - most
            if at_far > 0.0:
                return _crossing(lambda at: root(at) - most, (near, at_near), (far, at_far), 2e-2 * scale)
            if far == limit:
                return limit
            near, at_near = far, at_far
            # As far again as the straight line says, and a little more.
            reach *= float(np.clip(1.2 * most / max(at_far + most, 1e-3), 1.2, 4.0))

    def settled(limit: float, direction: float, most: float) -> float:
        """The end, with what is allowed there."""
        found = end(limit, direction, most, 1.1 * scale)
        there = allowed(direction)
        if abs(there - most) < _SAME:
            return found
        return end(limit, direction, there, 1.1 * abs(found - value) * there / most)

    upper = settled(value + 1e12 * max(scale, value), 1.0, alone)
    fits.clear()
    if value == 0.0:
        return 0.0, upper
    at_none = root(0.0)
    most = allowed(-1.0)
    if at_none <= most:
        return 0.0, upper
    fits.clear()
    return settled(0.0, -1.0, most), upper


def allowed_root(
    information: FloatArray, coefficients: FloatArray, place: int, direction: float, level: float
) -> float:
    """Root of twice the loss up to which a coefficient belongs to its interval [standard errors].

    Parameters
    ----------
    information
        Fisher's, of the coefficients and, behind them, of constants without bounds, shape (p, p).
    coefficients
        The true ones; none can be estimated as negative.
    place
        Which one the interval is of.
    direction
        1 for its upper end, where estimates are lower than the coefficient; -1 for its lower end.
    level
        Coverage; half of what is left is that of losses beyond.
    """
    from scipy.special import ndtri

    tail = 0.5 + 0.5 * level
    alone = float(ndtri(tail))
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    told = np.flatnonzero(size > 0.0)
    if not size[place] > 0.0:
        return alone
    truth = (np.append(coefficients, np.zeros(len(size) - len(coefficients))) * size)[told]
    values, vectors = np.linalg.eigh(information[np.ix_(told, told)] / np.outer(size[told], size[told]))
    frame = np.sqrt(np.maximum(values, _FLAT))[:, None] * vectors.T
    errors = np.linalg.norm(np.linalg.inv(frame), axis=1)
    at = int(np.searchsorted(told, place))
    bounded = (told < len(coefficients)) & (truth < _NEAR * errors)
    if not bounded.any():
        return alone
    noise = np.random.default_rng(0).standard_normal((len(told), _DRAWS))
    seen = frame @ truth[:, None] + noise
    loss, found = _bounded(frame, seen, bounded, at)
    held, _ = _bounded(np.delete(frame, at, 1), seen - truth[at] * frame[:, [at]], np.delete(bounded, at))
    off = np.sqrt(np.maximum(held - loss, 0.0)) * np.sign(truth[at] - found) * direction
    # The same draws without bounds, of which the quantile is known.
    free = np.linalg.inv(frame)[at] / errors[at] @ noise * -direction
    return max(alone + float(np.quantile(off, tail) - np.quantile(free, tail)), _TOLD)


def _bounded(
    frame: FloatArray, seen: FloatArray, bounded: BoolArray, at: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Least squares with some coefficients that are not negative: squares left, and coefficient `at`, (n,).

    That without bounds on those which stay positive, of each choice of such ones that stays so.
    """
    least, found = np.full(seen.shape[1], np.inf), np.zeros(seen.shape[1])
    some = np.flatnonzero(bounded)
    for taken in chain.from_iterable(combinations(some, count) for count in range(len(some) + 1)):
        columns = np.flatnonzero(~bounded | np.isin(np.arange(len(bounded)), taken))
        basis, upper = np.linalg.qr(frame[:, columns])
        along = basis.T @ seen
        fitted = np.linalg.solve(upper, along)
        squares = np.sum(seen**2, axis=0) - np.sum(along**2, axis=0)
        better = np.all(fitted[bounded[columns]] >= 0.0, axis=0) & (squares < least)
        least[better] = squares[better]
        if at is not None:
            found[better] = fitted[columns.tolist().index(at), better] if at in columns else 0.0
    return least, found


def _crossing(
    f: Callable[[float], float], low: tuple[float, float], high: tuple[float, float], tolerance: float
) -> float:
    """Root of a nearly straight function between two points of known values, by the Illinois rule.

    Values at the ends are not asked again: a fit that begins elsewhere may give a slightly other one.
    """
    (a, at_a), (b, at_b) = low, high
    for _ in range(30):
        c = (a * at_b - b * at_a) / (at_b - at_a)
        at_c = f(c)
        if (at_c > 0.0) == (at_b > 0.0):
            b, at_b, at_a = c, at_c, 0.5 * at_a
        else:
            a, at_a, b, at_b = b, at_b, c, at_c
        if abs(b - a) <= tolerance or abs(at_c) <= _TOLD:
            return c
    return c


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
    search: NoiseSearch, walk_upper: float, removed: FloatArray, ramps: int, off: float
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
        How many of the constants, the first ones, are ramps.
    off
        Standard errors from the ramp to either end.
    """
    best = search.best
    count = min(ramps, len(best.constants))
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
