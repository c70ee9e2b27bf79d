"""Which noise model a spectrum speaks for: terms behind an output filter, weighed by their evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.signals.distributions import chi2_sf
from fogml.signals.noise_spectrum import Spectrum
from fogml.signals.output_filters import LONGEST_MEAN, LOW_PASSES, NO_FILTER, OutputFilter, SpectrumTerms
from fogml.signals.slow_lines import without_slow_line
from fogml.signals.spectrum_fit import SpectrumFit, SpectrumModel

PLAIN = SpectrumTerms()
BEHIND = SpectrumTerms(("N", "B", "K", "Q", "W"))
FAR_BEHIND = SpectrumTerms(("N", "B", "K", "Q", "W", "E"))
"""Behind a filter, and behind one that lets so little pass at high frequencies that the ends are seen."""
_STARTS = np.log([0.02, 0.2, 1.5])
"""Warped corners to begin with."""
_WORTH = 2.0
"""Nats that a filter must bring before all forms are tried."""
_ENDS = 0.01
"""Share of a row's density that its series' ends may make."""
_DOUBTED = 1e-3
"""Chance of a right model's being doubted."""
_TIMES_TRIED = 10
"""Correlation times among which the likeliest is looked for first."""
_TIME_TOLD = 0.01
"""Share to which a correlation time is found."""
_TIMES = np.linspace(-2.0, 2.0, 5)
"""Correlation times beside the likeliest, in their standard errors."""
_LIVE = 5.0
"""Nats of evidence below the best at which a model no longer counts."""


@dataclass(frozen=True)
class NoiseChoice:
    """A fitted model and its evidence [nats], by Schwarz' criterion (Ann. Statist. 6 (1978) 461)."""

    model: SpectrumModel
    fit: SpectrumFit
    penalty: float

    @property
    def evidence(self) -> float:
        """Logarithm of the probability of the data, up to a constant of the data."""
        return -self.fit.loss - self.penalty


@dataclass(frozen=True)
class NoiseSearch:
    """Models that count.

    Attributes
    ----------
    spectrum
        The data.
    candidates
        The best first.
    weights
        Posterior probabilities, shape (candidates,).
    excess
        Variance of the rows' relative errors that the best model does not explain.
    fit_p_value
        Chance of errors as large as the best model's (portmanteau over all rows).
    """

    spectrum: Spectrum
    candidates: tuple[NoiseChoice, ...]
    weights: FloatArray
    excess: float
    fit_p_value: float

    @property
    def best(self) -> SpectrumFit:
        """The fit of the best model."""
        return self.candidates[0].fit

    def profile_loss(self, name: str, coefficient: float, fits: dict[int, SpectrumFit]) -> float:
        """Nats lost where a term is held at a coefficient, the models weighed; `fits` are where to begin."""
        lost = []
        for place, (candidate, weight) in enumerate(zip(self.candidates, self.weights)):
            names = candidate.fit.terms.names
            if name not in names:
                lost.append((0.0 if coefficient == 0.0 else np.inf) - np.log(weight))
                continue
            start = fits.get(place, candidate.fit)
            held = (names.index(name), coefficient)
            found = candidate.model.fit(start, held=held, excess=self.excess)
            if np.isfinite(found.loss):
                fits[place] = found
            lost.append(found.loss - candidate.fit.loss - np.log(weight))
        return float(-np.logaddexp.reduce(-np.array(lost)))


def search_noise(spectrum: Spectrum) -> NoiseSearch:
    """Fit and weigh noise models, of what sinusoids of a few cycles leave (`fogml.signals.slow_lines`).

    White noise, flicker, random walk and quantisation alone; behind low passes of first and second order
    and a running mean; and, where none of those fits, from each octave on down, the rows above being left to
    themselves. A Gauss-Markov term competes beside the terms alone and beside the best of them.
    """
    if not np.any(spectrum.power > 0.0):
        raise InputError("noise models: the values are all the same; there is no noise to fit")
    search = _searched(spectrum)
    while (less := without_slow_line(search.spectrum, search.best, search.excess)) is not None:
        search = _searched(less)
    return search


def _searched(spectrum: Spectrum) -> NoiseSearch:
    size = np.log(max(float(spectrum.count.sum()), 2.0))
    plain = SpectrumModel(spectrum, PLAIN)
    found = [NoiseChoice(plain, plain.fit(), 0.0)]
    found += _filtered(spectrum, found[0], size)
    best = max(found, key=lambda c: c.evidence)
    if fit_p_value(best.model, best.fit) < _DOUBTED:
        found += _from_lower_on(spectrum)
    # Beside the terms alone too: of what is correlated a filter may have been made.
    best = max(found, key=lambda c: c.evidence)
    for beside in (found[0], best) if best is not found[0] else (best,):
        found += _correlated(spectrum, beside, size)
    found.sort(key=lambda c: -c.evidence)
    live = [c for c in found if c.evidence > found[0].evidence - _LIVE]
    weights = np.exp([c.evidence - live[0].evidence for c in live])
    p_value = fit_p_value(live[0].model, live[0].fit)
    # Scatter that chance explains is none: intervals would widen for nothing.
    excess = _excess_of(live[0].model, live[0].fit) if p_value < _DOUBTED else 0.0
    if excess > 0.0:
        live = [replace(c, fit=c.model.fit(c.fit, excess=excess)) for c in live]
    return NoiseSearch(spectrum, tuple(live), weights / weights.sum(), excess, p_value)


def fit_p_value(model: SpectrumModel, fit: SpectrumFit) -> float:
    """Chance of errors of the rows as large as a fit's, by chi-square."""
    errors, rows = _relative_errors(model, fit)
    freedom = len(rows) - fit.free
    return float(chi2_sf(float(errors @ errors), freedom)) if freedom > 0 else 1.0


def _relative_errors(model: SpectrumModel, fit: SpectrumFit) -> tuple[FloatArray, IndexArray]:
    """Normal errors of the rows of many coefficients, and which: cube roots (Wilson and Hilferty, 1931)."""
    rows = np.flatnonzero((model.spectrum.count >= 8.0) & fit.used)
    scale = 2.0 / (9.0 * model.freedom[rows])
    ratio = model.spectrum.power[rows] / fit.density[rows]
    return (np.cbrt(ratio) - (1.0 - scale)) / np.sqrt(scale), rows


def _excess_of(model: SpectrumModel, fit: SpectrumFit) -> float:
    """Variance of the rows' relative errors beyond chance (Mandel and Paule, 1970)."""
    errors, rows = _relative_errors(model, fit)
    free = len(rows) - fit.free
    if free <= 0 or float(errors @ errors) <= free:
        return 0.0
    relative = np.minimum(np.abs(model.spectrum.power[rows] / fit.density[rows] - 1.0), 1.0) ** 2
    chance = 2.0 / model.freedom[rows]
    low, high = 0.0, 4.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.sum(relative / (chance + middle)) > free else (low, middle)
    return high


def _filtered(spectrum: Spectrum, plain: NoiseChoice, size: float) -> list[NoiseChoice]:
    first = [form for form in LOW_PASSES if form.kind == "butterworth" and form.warp == "bilinear"]
    mean = _running_mean(spectrum)
    if mean is not None:
        first.append(mean)

    def fitted(
        forms: Sequence[OutputFilter], corners: FloatArray, used: BoolArray | None
    ) -> list[NoiseChoice]:
        models = [
            SpectrumModel(spectrum, BEHIND if form.order == 1 else FAR_BEHIND, form, used) for form in forms
        ]
        penalty = 0.5 * size + _of_levels(spectrum, used)
        tried = [
            NoiseChoice(m, _scanned(m, corners if m.filter.free else corners[:1]), penalty) for m in models
        ]
        return [c for c in tried if _holds_back(c)]

    found = fitted(first, _STARTS, None)
    if all(c.fit.loss > plain.fit.loss - _WORTH for c in found):
        return []
    top = min(found, key=lambda c: c.fit.loss)
    best = top.fit
    begin = np.array([c.fit.log_corner for c in found if c.fit.filter.free] or _STARTS)
    ends = best["E"] * top.model.design(best.log_corner)[0][:, -1] if best["E"] > 0.0 else np.zeros(1)
    used = None
    if np.any(ends > _ENDS * best.density):
        # There the series' ends are seen, which are no noise, and not the noise; the same rows for all.
        used = np.asarray(ends <= _ENDS * best.density)
        found = fitted(first, begin, used)
    return found + fitted([form for form in LOW_PASSES if form not in first], begin, used)


def _scanned(model: SpectrumModel, corners: FloatArray) -> SpectrumFit:
    """The best fit from corners; of the series' ends only once a filter is found without them.

    Ends that make up for a wrong corner are a best fit of their own, far below the right one.
    """
    if model.terms.names[-1] != "E":
        return model.scanned(corners)
    names = model.terms.names[:-1]
    without = SpectrumModel(model.spectrum, SpectrumTerms(names), model.filter, model.used).scanned(corners)
    return model.fit(replace(without, terms=model.terms, coefficients=np.append(without.coefficients, 0.0)))


def _holds_back(choice: NoiseChoice) -> bool:
    """Whether most of a model's white noise is that behind its filter, and not what comes after it.

    Noise after the filter that makes more of the output's power is the gyro's own, and what looks like noise
    held back is a drift, or correlated noise.
    """
    model, fit = choice.model, choice.fit
    density = model.design(fit.log_corner)[0] * fit.coefficients
    names = list(fit.terms.names)
    held, after = (float(model.spectrum.count @ density[:, names.index(name)]) for name in ("N", "W"))
    return after <= 0.5 * held


def _running_mean(spectrum: Spectrum) -> OutputFilter | None:
    """The running mean of white noise that fits best, if it beats the noise itself."""
    cycles = spectrum.frequency_hz * spectrum.sample_s
    rows = spectrum.count >= 8.0
    freedom, power = spectrum.count[rows], spectrum.power[rows]

    def loss(form: OutputFilter) -> float:
        gain = form.response(cycles[rows], 0.0)[0].mean(axis=1)
        level = float(freedom @ (power / gain)) / float(freedom.sum())
        return float(freedom @ np.log(level * gain))

    if not np.any(rows):
        return None
    forms = [OutputFilter("mean", order) for order in range(2, LONGEST_MEAN + 1)]
    best = min(forms, key=loss)
    return best if loss(best) < loss(NO_FILTER) else None


def _of_levels(spectrum: Spectrum, used: BoolArray | None) -> float:
    """Penalty for rows that are left to levels of their own."""
    if used is None:
        return 0.0
    return 0.5 * float(np.sum(np.log(np.maximum(spectrum.count[~used], 2.0))))


def _from_lower_on(spectrum: Spectrum) -> list[NoiseChoice]:
    """Plain models of the rows below an octave's end: the rows above have a level of their own each."""
    found: list[NoiseChoice] = []
    top = 0.25 / spectrum.sample_s
    low = spectrum.frequency_hz[:, -1]
    while True:
        used = low < top
        if float(spectrum.count[used].sum()) < 64.0:
            return found
        model = SpectrumModel(spectrum, PLAIN, used=used)
        found.append(NoiseChoice(model, model.fit(), _of_levels(spectrum, used)))
        top *= 0.5


def _correlated(spectrum: Spectrum, best: NoiseChoice, size: float) -> list[NoiseChoice]:
    """Models with a Gauss-Markov term, where slow noise is there at all.

    Its correlation time is the likeliest, and some within its error about it, together as likely as that one:
    so intervals of the other terms count that it is not known.
    """
    from scipy.optimize import minimize_scalar

    fit = best.fit
    slow = fit["B"] + fit["K"]
    if slow == 0.0 and fit_p_value(best.model, fit) > 0.05:
        return []
    lowest = float(spectrum.frequency_hz.min())
    longest, shortest = 1.0 / (4.0 * np.pi * lowest), 2.0 * spectrum.sample_s
    if longest <= 2.0 * shortest:
        return []
    known: dict[float, NoiseChoice] = {}

    def loss(log_time: float) -> float:
        tau = float(np.exp(log_time))
        terms = SpectrumTerms((*fit.terms.names, "G"), tau)
        model = SpectrumModel(spectrum, terms, fit.filter, best.model.used)
        start = replace(fit, terms=terms, coefficients=np.append(fit.coefficients, 1e-6 * fit["N"] / tau))
        known[log_time] = NoiseChoice(model, model.fit(start), best.penalty + size)
        return known[log_time].fit.loss

    low, high = np.log([shortest, longest])
    grid = np.linspace(low, high, _TIMES_TRIED)
    step = float(grid[1] - grid[0])
    first = grid[np.argmin([loss(at) for at in grid])]
    bounds = max(first - step, low), min(first + step, high)
    middle = float(minimize_scalar(loss, bounds=bounds, method="bounded", options={"xatol": _TIME_TOLD}).x)
    near = 0.1 * step
    bend = (loss(middle - near) - 2.0 * loss(middle) + loss(middle + near)) / near**2
    if not np.isfinite(bend):
        return []
    error = min(1.0 / np.sqrt(max(bend, 1e-6)), 0.5 * step)
    places = np.clip(middle + error * _TIMES, low, high)
    for at in places:
        loss(at)
    found = [known[at] for at in np.unique(places) if _is_correlated(known[at])]
    if not found:
        return []
    shares = np.array([choice.evidence for choice in found])
    shared = float(np.logaddexp.reduce(shares) - shares.max())
    return [replace(choice, penalty=choice.penalty + shared) for choice in found]


def _is_correlated(choice: NoiseChoice) -> bool:
    """Whether what is correlated is less than white noise at the upper end.

    What is more there too is white noise behind a filter of first order.
    """
    model, fit = choice.model, choice.fit
    top = int(np.flatnonzero(model.used)[-1])
    ahead = model.design(fit.log_corner)[0][top] * fit.coefficients
    return bool(ahead[-1] < ahead[fit.terms.names.index("N")])
