"""The noise that a diagnosis judges by: from a static run, or from the runs themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product

import numpy as np

from fogml.errors import InputError
from fogml.gap.frame import Columns, Field, Setting
from fogml.gap.linear_gaussian import LinearGaussian, size_gains
from fogml.gap.model import AnyModel
from fogml.gap.rows import Rows
from fogml.gap.unknown import unknown_families
from fogml.runs.run import FloatArray, Run
from fogml.runs.thermal_columns import leading_temperature
from fogml.signals.noise_fit import NAMES, NoiseFit, NoisePrior, fit_noise
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener

UNIT_FACTOR = 1.3
"""Noise of a unit from one run to another, as a factor."""
FROM_RUNS = "the runs themselves, what moves with temperature taken out"
"""Where the noise comes from if no static run tells it."""
MOST_ROWS = 1500
"""Rows of a run whose likelihood is exact, at most."""


@dataclass(frozen=True)
class Noise:
    """Noise as known: its coefficients, their spread and where they come from."""

    model: NoiseModel
    fit: NoiseFit
    source: str


def prior_of(model: AnyModel, noise_run: Run | None) -> tuple[NoisePrior, str]:
    """The prior of the fit runs' noise: the model's, or what a static run shows.

    Raises
    ------
    InputError
        If the static run turns, or is too short for a noise.
    """
    stated = model.noise
    centre = NoiseModel(stated.N, stated.B, stated.K)
    factor = (stated.factor_N, stated.factor_B, stated.factor_K)
    wide = NoisePrior(centre, tuple(max(f, 1.001) for f in factor))  # type: ignore[arg-type]
    if noise_run is None:
        return wide, FROM_RUNS
    if np.any(noise_run.rate):
        raise InputError(f"{noise_run.name}: the table turns in it; a noise run is a static one")
    values = noise_run.gyro_deg_h
    usable = np.isfinite(values) & np.isfinite(noise_run.time)
    time, values = noise_run.time[usable], values[usable]
    if len(time) < 64:
        raise InputError(f"{noise_run.name}: {len(time)} samples; a noise run needs at least 64")
    columns = [_motion(noise_run, usable)]
    # Whatever the size: a static run tells N within a per cent, whatever was thought before.
    start = NoiseModel(*(_glance(time, values, centre)))
    fit = fit_noise(
        [time],
        [values],
        columns if columns[0].shape[1] else None,
        prior=NoisePrior(start, 10.0),
        averaging_s=noise_run.sample_s,
        most=MOST_ROWS,
    )
    spread = np.hypot(np.minimum(fit.standard_errors, np.log(3.0)), np.log(UNIT_FACTOR))
    return NoisePrior(fit.model, tuple(np.exp(spread))), f"static run {noise_run.name}"


def _motion(run: Run, usable: np.ndarray) -> FloatArray:
    """Temperature as a regressor of a static run, where it moves at all."""
    warmth = leading_temperature(run)
    if warmth is None:
        return np.empty((int(usable.sum()), 0))
    temperature = warmth[usable]
    if not np.isfinite(temperature).all() or np.ptp(temperature) < 0.05:
        return np.empty((len(temperature), 0))
    return (temperature - temperature.mean())[:, None]


def _glance(time: FloatArray, values: FloatArray, centre: NoiseModel) -> tuple[float, float, float]:
    """Rough N from neighbouring samples, B and K in the ratios that were expected."""
    step = float(np.median(np.diff(time)))
    white = float(np.median(np.abs(np.diff(values)))) / 0.6745 / np.sqrt(2.0)
    n = max(white * np.sqrt(step / 3600.0), 1e-9)
    ratio = n / centre.N
    return n, max(centre.B, 1e-9) * ratio, max(centre.K, 1e-9) * ratio


SMOOTH = ("time_7200", "time_2400", "temperature_25", "past")
"""Unknowns beside which noise is judged before anything else is known."""
SMOOTH_PRICE = 5.0
"""What one of them costs there [nats]: sizes and odds."""
WHITE_STEPS = (1.3, 1.06)
"""Factors by which white noise is searched, coarse and fine."""
NOISELESS = 1e-3
"""Share of the white noise expected under which none is: a simulation without noise is judged at that."""
_MEDIAN = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class NoisePoints:
    """Noises, the logarithms of their priors, and those of their posterior beside what may act.

    ``fit`` holds the posterior's moments.
    """

    noises: tuple[NoiseModel, ...]
    log_priors: tuple[float, ...]
    prior: NoisePrior
    source: str
    log_posteriors: FloatArray = field(default_factory=lambda: np.zeros(1))

    def judged(self, log_posteriors: FloatArray) -> NoisePoints:
        """With another posterior."""
        return replace(self, log_posteriors=log_posteriors)

    def within(self, behind: float) -> NoisePoints:
        """Those that are no further behind the likeliest [nats]."""
        kept = np.flatnonzero(self.log_posteriors > self.log_posteriors.max() - behind)
        return replace(
            self,
            noises=tuple(self.noises[i] for i in kept),
            log_priors=tuple(self.log_priors[i] for i in kept),
            log_posteriors=self.log_posteriors[kept],
        )

    def with_white(self, factor: float) -> NoisePoints:
        """With white noise so many times as strong."""
        return replace(self, noises=tuple(replace(n, N=factor * n.N) for n in self.noises))

    @property
    def best(self) -> int:
        """Which is the likeliest."""
        return int(np.argmax(self.log_posteriors))

    @cached_property
    def fit(self) -> NoiseFit:
        """Moments of the logarithms of the coefficients."""
        weights = np.exp(self.log_posteriors - self.log_posteriors.max())
        return _as_fit(self.noises, weights / weights.sum(), self.prior, float(self.log_posteriors.max()))


def noise_points(
    setting: Setting, prior: NoisePrior, source: str, static: Run | None, negligible: float
) -> NoisePoints:
    """Noises to integrate over; those with less than exp(-`negligible`) of the likeliest prior left out.

    White noise is what the runs themselves show, whatever a static run said: it is no evidence of a cause.
    Flicker and random walk are taken at steps about what was expected of them, each as likely as the static
    run itself has it, or the prior where there is none: the runs decide, beside everything that may act.
    """
    columns = Columns.of([f for f in unknown_families() if f.id in SMOOTH], setting.scene, setting.values)
    held = dict(zip(NAMES, prior.deviations))
    offsets = setting.priors.slow_noise

    def at(white: float, b: float, k: float) -> NoiseModel:
        flicker = prior.centre.B * float(np.exp(b * held["B"]))
        return NoiseModel(white, flicker, prior.centre.K * float(np.exp(k * held["K"])))

    least = NOISELESS * prior.centre.N
    white = first_noise(setting, prior).N
    for step in WHITE_STEPS:
        while True:
            tried = [max(white / step, least), white, white * step]
            scores = [_score(setting, columns, at(w, 0.0, 0.0)) for w in tried]
            best = int(np.argmax(scores))
            if best == 1 or tried[best] == white:
                break
            white = tried[best]
    told = None if static is None else StaticRun.of(static)
    noises: list[NoiseModel] = []
    log_priors = []
    for b, k in product(offsets[:-1], offsets):
        noise = at(white, b, k)
        if noise not in noises:
            noises.append(noise)
            own = replace(noise, N=prior.centre.N)
            log_priors.append(-0.5 * (b * b + k * k) if told is None else told.log_likelihood(own))
    kept = [i for i, p in enumerate(log_priors) if p > max(log_priors) - negligible]
    noises, log_priors = [noises[i] for i in kept], [log_priors[i] for i in kept]
    total = np.array([_score(setting, columns, n) + p for n, p in zip(noises, log_priors)])
    return NoisePoints(tuple(noises), tuple(log_priors), prior, source).judged(total)


def first_noise(setting: Setting, prior: NoisePrior) -> NoiseModel:
    """White noise as second differences of neighbouring rows show it, slow noise as expected."""
    found = [white_noise(rows, prior) for rows in setting.scene.runs[: setting.scene.fitted]]
    return replace(prior.centre, N=float(np.median(found)))


def white_noise(rows: Rows, prior: NoisePrior, made: Sequence[FloatArray] = ()) -> float:
    """Coefficient N of one run from second differences of neighbouring rows, by median, or the least.

    What constants, and causes where there are some, may do to them is fitted first: a table that turns all
    the time makes no noise.

    Parameters
    ----------
    rows
        The run, m rows.
    prior
        Its centre states the least.
    made
        What each cause may make of it, columns of shape (m, k) [deg/h].
    """
    second = np.diff(rows.gap, 2)
    columns = np.diff(np.concatenate([rows.constants, *made], axis=1), 2, axis=0)
    columns = columns / np.maximum(np.abs(columns).max(axis=0), np.finfo(float).tiny)
    left = second - columns @ np.linalg.lstsq(columns, second)[0]
    found = float(np.median(np.abs(left))) / _MEDIAN / math.sqrt(6.0) * math.sqrt(rows.row_s / 3600.0)
    return max(found, NOISELESS * prior.centre.N)


def _score(setting: Setting, columns: Columns, noise: NoiseModel) -> float:
    """Log evidence of a noise, beside nothing or one smooth unknown."""
    held = Field(setting, columns, noise)
    evidence = [held.base.log_evidence]
    for i in held.at:
        block = held.block(i)
        gains = size_gains(held.base.gram(block), held.base.fits(block), setting.priors.lengths)
        evidence.append(held.base.log_evidence + float(np.logaddexp.reduce(gains)) - SMOOTH_PRICE)
    return float(np.logaddexp.reduce(evidence)) - held.whitening.log_det


def _as_fit(
    noises: Sequence[NoiseModel], weights: np.ndarray, prior: NoisePrior, log_posterior: float
) -> NoiseFit:
    """Moments of the logarithms over weighed noises."""
    logs = np.log(np.maximum([[getattr(n, name) for name in NAMES] for n in noises], 1e-12))
    mean = weights @ logs
    covariance = (weights[:, None] * (logs - mean)).T @ (logs - mean)
    # Between two points of the grid the coefficient may be anywhere.
    step = np.array([0.01, 0.5 * prior.deviations[1], 0.5 * prior.deviations[2]])
    covariance += np.diag(step**2 / 12.0)
    model = NoiseModel(*(float(x) for x in np.exp(mean)))
    return NoiseFit(model, covariance, prior, log_posterior, len(noises))


STATIC_ROWS = 1000
FREE_DEG_H = 1e3
"""Prior standard deviation of the run's own constant and of what goes with its temperature [deg/h]."""


@dataclass(frozen=True, eq=False)
class StaticRun:
    """A static run as rows: when each ends [s], their values [deg/h] and what is free, shape (m, k)."""

    end_s: FloatArray
    values: FloatArray
    free: FloatArray
    row_s: float

    @classmethod
    def of(cls, run: Run) -> StaticRun:
        """Means over even rows; those with few samples are left out."""
        run = run.without_dropouts
        values = run.gyro_deg_h
        usable = np.isfinite(values) & np.isfinite(run.time)
        time, values = run.time[usable], values[usable]
        step = float(np.median(np.diff(time)))
        width = max(1, -(-len(time) // STATIC_ROWS))
        row = np.floor((time - time[0] + 0.5 * step) / (width * step)).astype(np.intp)
        counts = np.bincount(row)
        full = counts >= max(0.5 * width, 1)
        means = np.bincount(row, weights=values) / np.maximum(counts, 1)
        free = [np.ones(len(counts))]
        if (held := leading_temperature(run)) is not None:
            warmth = held[usable]
            if np.isfinite(warmth).all() and np.ptp(warmth) > 0.05:
                free.append(np.bincount(row, weights=warmth - warmth.mean()) / np.maximum(counts, 1))
        ends = time[0] + (np.arange(len(counts)) + 1.0) * width * step
        return cls(ends[full], means[full], FREE_DEG_H * np.column_stack(free)[full], width * step)

    def log_likelihood(self, noise: NoiseModel) -> float:
        """Of noise that is a factor of `UNIT_FACTOR` more or less from run to run."""
        values = []
        for off, weight in ((-1.0, 0.25), (0.0, 0.5), (1.0, 0.25)):
            scale = UNIT_FACTOR**off
            held = NoiseModel(noise.N, noise.B * scale, noise.K * scale)
            whitener = Whitener(held, self.end_s, self.row_s)
            model = LinearGaussian.of(whitener.whiten(self.values)).beside(whitener.whiten(self.free))
            values.append(model.log_evidence - whitener.log_det + math.log(weight))
        return float(np.logaddexp.reduce(values))
