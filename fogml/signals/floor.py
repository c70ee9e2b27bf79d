"""The noise floor: what a gyro's own noise leaves in averages, drift apart.

Defined once, for every command: the expected standard deviation of the consecutive averages over the
averaging time about their mean, under the noise model with white noise, flicker, quantisation and, where no
drift can be mistaken for it, random walk. With the one-sided density S of the averages' input and M windows
of T::

    floor^2 = integral of S(f) sinc^2(f T) (1 - (sin(pi f M T) / (M sin(pi f T)))^2) df

so that slow noise counts as far as it moves averages within a run, and not by the mean that is taken off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, combinations

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.intervals import LEVEL, MEDIAN_SIZE
from fogml.numerals import percent
from fogml.signals import large
from fogml.signals.averages import FastNoise, averages_variance, fast_noise
from fogml.signals.clock import check_interval
from fogml.signals.distributions import students_ppf
from fogml.signals.noise_spectrum import Rows, spectrum_of
from fogml.signals.output_filters import SpectrumTerms
from fogml.signals.spectrum_fit import SpectrumFit, SpectrumModel
from fogml.signals.term_intervals import slow_fits

_SPIKE = 8.0
"""A sample, or a step of the sub-averages, further than this many standard deviations is no noise."""
_BLOCKS, _LOUD = 32, 4.0
"""Blocks of time, and the multiple of their median mean square from which one is left out."""
_LEAST = 8
"""Steps between means that tell a typical one."""


def quiet_parts(values: FloatArray, starts: IntArray, stops: IntArray, width: int) -> list[tuple[int, int]]:
    """Rows without loud blocks, cut at steps, as told by means of so many samples; gaps stay cuts."""
    means = [
        values[a : a + (b - a) // width * width].reshape(-1, width).mean(axis=1)
        for a, b in zip(starts.tolist(), stops.tolist())
    ]
    whole = [(a, b) for a, b in zip(starts.tolist(), stops.tolist()) if b - a >= 3]
    steps = [np.abs(np.diff(part)) for part in means]
    count = sum(map(len, steps))
    typical = float(np.median(np.concatenate(steps))) / MEDIAN_SIZE if count >= _LEAST else 0.0
    if typical == 0.0:
        return whole
    block = max(count // _BLOCKS, 4)
    kept: list[tuple[int, int]] = []
    for start, stop, step in zip(starts.tolist(), stops.tolist(), steps):
        bad = np.zeros(len(step), dtype=np.bool_)
        for first in range(0, len(step), block):
            inside = np.sort(step[first : first + block])
            # A block with one step in it is not loud but for that.
            if float(np.sum(inside[:-1] ** 2)) > _LOUD * typical**2 * len(inside) and len(inside) >= 4:
                bad[first : first + block] = True
        bad |= step > _SPIKE * typical
        edges = np.flatnonzero(np.diff(np.concatenate(([True], bad, [True])).astype(np.int8)))
        for a, b in zip(edges[::2].tolist(), edges[1::2].tolist()):
            # Means a to b are quiet; the last goes on to the stretch's end.
            kept.append((start + a * width, stop if b == len(step) else start + (b + 1) * width))
    kept = [(a, b) for a, b in kept if b - a >= 3]
    return kept if sum(b - a for a, b in kept) >= 0.5 * sum(b - a for a, b in whole) else whole


def without_spikes(values: FloatArray) -> FloatArray:
    """Values with those far from both neighbours replaced by the neighbours' mean."""
    if len(values) < 3:
        return values

    def away(part: FloatArray) -> FloatArray:
        return np.asarray(np.abs(part[1:-1] - 0.5 * (part[:-2] + part[2:])))

    # White noise of one unit is 3/2 away in variance.
    middle = large.median(lambda: (away(values[part]) for part in large.pieces(values, overlap=2)))
    limit = _SPIKE * middle / MEDIAN_SIZE
    lone = [
        part.start + 1 + np.flatnonzero((away(x := values[part]) > limit) & (np.abs(x[2:] - x[:-2]) <= limit))
        for part in large.pieces(values, overlap=2)
    ]
    rows = np.concatenate(lone)
    if limit == 0.0 or not len(rows):
        return values
    cleaned = large.each(np.copy, values)
    cleaned[rows] = 0.5 * (values[rows - 1] + values[rows + 1])
    return cleaned


Columns = Callable[[IntArray], FloatArray]

PER_WINDOW = 20
"""Half periods in an averaging time of the fastest noise that is looked at: a faster one, an output filter, a
dither or repeated values do not matter to the averages, and do not enter."""
_LIGHT = 1e-4
"""Weight below which a model no longer counts."""
_NOTICED = 0.02
"""Share of the rows from which it is told that they are left out."""
_FEWEST = 64
"""Coefficients of slow noise that are enough to leave the fast ones out."""
_DRIFT = ("K", "D")
"""Terms that drift makes: densities that fall with the second and fourth power of frequency."""


@dataclass(frozen=True)
class Floor:
    """A noise floor with its interval, in the unit of the data.

    Attributes
    ----------
    value, lower, upper
        The floor and its 90 % interval.
    source
        Where the noise comes from.
    """

    value: float
    lower: float
    upper: float
    source: str = "the run itself"


@dataclass(frozen=True)
class FloorModel:
    """Noise models of a run, by their weights, which give a floor at the windows of any run."""

    fits: tuple[tuple[SpectrumModel, SpectrumFit], ...]
    weights: FloatArray
    sample_s: float
    counted: tuple[str, ...]
    fast: FastNoise
    slow: tuple[tuple[SpectrumModel, SpectrumFit], ...]
    slow_weights: FloatArray
    """Models at any size of slow noise that the run allows."""
    loud: float = 0.0
    """Share of the rows that is loud, or a step, and is left out."""

    def floor(self, averaging_s: float, windows: int, source: str = "the run itself") -> Floor:
        """The floor of so many windows over an averaging time."""
        if self.loud > _NOTICED:
            source += f" without the {percent(self.loud, 0)} of it that is loud"
        measured, its_variance = self.fast.averages_variance(averaging_s, windows)
        shares = {
            name: averages_variance(name, self.sample_s, averaging_s, windows, self.fast.from_hz)
            for name in self.counted
        }
        squares, errors = [], []
        for model, fit in (*self.fits, *self.slow):
            share = np.array([shares.get(name, 0.0) for name in fit.terms.names])
            squares.append(measured + float(share @ fit.coefficients))
            errors.append(its_variance + float(share @ _covariance(model, fit) @ share))
        square = float(self.weights @ squares[: len(self.fits)])
        if square <= 0.0:
            return Floor(0.0, 0.0, 0.0, source)
        # Half by what the data speak for, half by slow noise of any size that they allow.
        weights = 0.5 * np.concatenate((self.weights, self.slow_weights))
        likely = np.maximum(squares, 1e-12 * square)
        spread = np.sqrt(np.log1p(np.array(errors) / likely**2)) + 1e-12
        ends = students_ppf([0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], weights, np.log(likely), spread, np.inf)
        lower, upper = np.exp(0.5 * ends)
        value = float(np.sqrt(square))
        return Floor(value, min(float(lower), value), max(float(upper), value), source)


def floor_model(
    values: FloatArray,
    sample_s: float,
    averaging_s: float,
    starts: IntArray,
    stops: IntArray,
    columns: Columns | None = None,
    *,
    drifts: bool = True,
) -> FloorModel | None:
    """The noise models behind the floor of a series' averages, drift kept out; None where there is no noise.

    The density up to ten cycles in an averaging time is fitted by white noise, quantisation and flicker, and
    beside them by what a drift makes; flicker is weighed by its evidence, so that nothing hangs on a
    hard choice and the floor moves with its data. Spikes, steps and loud bursts are left out. Flicker that
    the run does not tell from white noise is missed in part, and the interval says so.

    Parameters
    ----------
    values
        Evenly sampled, finite, shape (n,), in any unit, `sample_s` apart [s].
    averaging_s
        Averaging time [s].
    starts, stops
        Parts of the values between gaps.
    columns
        What a drift follows, slow: gives them at rows, shape (rows, p); their constants are integrated out.
    drifts
        Whether noise that rises like a random walk counts as drift; for a static run it is the gyro's own.
    """
    check_interval(sample_s, "floor")
    if not (np.isfinite(averaging_s) and averaging_s > 0.0):
        raise InputError(f"floor: an averaging time of {averaging_s} s; it must be positive")
    width = max(int(averaging_s / sample_s / PER_WINDOW), 1)
    parts = quiet_parts(values, starts, stops, width)
    stretches = [without_spikes(values[a:b]) for a, b in parts]
    if all(np.ptp(part) == 0.0 for part in stretches):
        return None
    large.release()
    tables = None if columns is None else [_from(columns, a) for a, _ in parts]
    spectrum = spectrum_of(stretches, sample_s, tables)
    if not np.any(spectrum.power > 0.0):
        return None
    # Faster noise does not matter to the averages; but short runs need all that they have.
    from_hz = min(0.5 * PER_WINDOW / averaging_s, 0.5 / sample_s)
    slow = spectrum.frequency_hz[:, -1] < from_hz
    if float(spectrum.count[slow].sum()) < _FEWEST or not np.any(spectrum.power[slow] > 0.0):
        slow = np.ones(len(spectrum.power), dtype=np.bool_)
        from_hz = 0.5 / sample_s
    fast = fast_noise(spectrum, ~slow, from_hz, sum(map(len, stretches)))
    kept = slow | (np.arange(len(slow)) < len(spectrum.values))
    spectrum = replace(
        spectrum,
        frequency_hz=spectrum.frequency_hz[kept],
        power=spectrum.power[kept],
        count=spectrum.count[kept],
        stretch_s=spectrum.stretch_s[kept],
    )
    slow = slow[kept]
    own = ("Q", "B") if drifts else ("Q", "B", "K")
    beside = _DRIFT if drifts else ()
    size = 0.5 * float(np.log(max(spectrum.count[slow].sum(), 2.0)))
    fits: list[tuple[SpectrumModel, SpectrumFit]] = []
    evidence: list[float] = []
    for more in _subsets(own):
        for drift in _subsets(beside):
            model = SpectrumModel(spectrum, SpectrumTerms(("N", *more, *drift)), used=slow)
            fit = model.fit()
            fits.append((model, fit))
            evidence.append(-fit.loss - size * (1 + len(more) + len(drift)))
    if not np.isfinite(max(evidence)):
        return None
    weights = np.exp(np.array(evidence) - max(evidence))
    live = np.flatnonzero(weights > _LIGHT)
    chosen = weights[live] / weights[live].sum()
    # Stretches without a step between two means are left out for that, and not as loud.
    lengths = stops - starts
    judged = int(lengths[lengths >= 2 * width].sum())
    loud = 1.0 - sum(map(len, stretches)) / max(judged, 1)
    whole_model = fits[-1][0]
    found, shares = slow_fits(whole_model, own[1:])
    any_size = tuple((whole_model, fit) for fit in found)
    likely = tuple(fits[i] for i in live)
    return FloorModel(likely, chosen, sample_s, ("N", *own), fast, any_size, shares, loud)


def _from(columns: Columns, first: int) -> Rows:
    """Columns at the rows of a stretch, which begins at a row."""
    return lambda part: columns(np.arange(first + part.start, first + part.stop))


def _subsets(names: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    return chain.from_iterable(combinations(names, size) for size in range(len(names) + 1))


def _covariance(model: SpectrumModel, fit: SpectrumFit) -> FloatArray:
    """Covariance of the coefficients by Fisher's information; of drift terms that are zero, none."""
    design = model.design(fit.log_corner)[0]
    free = np.array([value > 0.0 or name == "N" for name, value in zip(fit.terms.names, fit.coefficients)])
    weighed = design[:, free] * (np.sqrt(0.5 * model.freedom) / fit.density)[:, None]
    size = np.linalg.norm(weighed, axis=0)
    size[size == 0.0] = 1.0
    covariance = np.zeros((design.shape[1], design.shape[1]))
    covariance[np.ix_(free, free)] = np.linalg.pinv((weighed / size).T @ (weighed / size)) / np.outer(
        size, size
    )
    return covariance
