"""The noises that a diagnosis integrates over: about what a static run shows, as the runs allow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.special import softmax

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.gap.field import Columns, Field
from fogml.gap.frame import Setting
from fogml.gap.linear_gaussian import LinearGaussian, size_gains
from fogml.gap.model import AnyModel
from fogml.gap.reading import usable_samples
from fogml.gap.rows import Rows
from fogml.gap.scene import Scene
from fogml.gap.settings import STANDARD
from fogml.gap.step_settings import NoiseSettings
from fogml.gap.unknown import unknown_families
from fogml.intervals import Z50
from fogml.numerals import short
from fogml.runs.run import Run
from fogml.runs.thermometers import leading_temperature
from fogml.runs.turning import check_noise_run
from fogml.signals.noise_fit import NAMES, NoiseFit, NoisePrior, fit_noise
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener


@dataclass(frozen=True, eq=False)
class NoisePoints:
    """Noises, the logarithms of their priors, and those of their posterior beside what may act.

    Attributes
    ----------
    steps
        How far flicker and random walk of each lie above what was expected of them, in prior standard
        deviations.
    static
        The static run that says how likely each is; None where the prior does.
    """

    noises: tuple[NoiseModel, ...]
    steps: tuple[tuple[float, float], ...]
    log_priors: tuple[float, ...]
    prior: NoisePrior
    source: str
    log_posteriors: FloatArray
    static: StaticRun | None = None

    def within(self, behind: float) -> NoisePoints:
        """Those that are no further behind the likeliest [nats]."""
        kept = np.flatnonzero(self.log_posteriors > self.log_posteriors.max() - behind)
        return replace(
            self,
            noises=tuple(self.noises[i] for i in kept),
            steps=tuple(self.steps[i] for i in kept),
            log_priors=tuple(self.log_priors[i] for i in kept),
            log_posteriors=self.log_posteriors[kept],
        )

    def with_white(self, factor: float) -> NoisePoints:
        """With white noise so many times as strong."""
        return replace(self, noises=tuple(replace(n, N=factor * n.N) for n in self.noises))

    def beyond(self, offsets: Sequence[float]) -> NoisePoints | None:
        """What follows where the likeliest lies at the grid's upper end, a step of `offsets` on; None else.

        Where slow noise exceeds all that a model expects of it, the end of a grid is no reason to call it a
        cause. A static run says itself how far it goes.
        """
        if self.static is not None:
            return None
        best = self.steps[self.best]
        ends = [max(values) for values in zip(*self.steps)]
        at_end = [value == end and end > 0.0 for value, end in zip(best, ends)]
        if not any(at_end):
            return None
        grown = [end + offsets[-1] - offsets[-2] if at else end for end, at in zip(ends, at_end)]
        flicker, walk = ({*values, last} for values, last in zip(zip(*self.steps), grown))
        more = [s for s in product(sorted(flicker), sorted(walk)) if s[0] > ends[0] or s[1] > ends[1]]
        return _points(self.prior, self.source, None, self.noises[0].N, more)

    def and_more(self, more: NoisePoints) -> NoisePoints:
        """These and others."""
        return replace(
            self,
            noises=self.noises + more.noises,
            steps=self.steps + more.steps,
            log_priors=self.log_priors + more.log_priors,
            log_posteriors=np.concatenate([self.log_posteriors, more.log_posteriors]),
        )

    @property
    def best(self) -> int:
        """Which is the likeliest."""
        return int(np.argmax(self.log_posteriors))

    @cached_property
    def fit(self) -> NoiseFit:
        """Moments of the logarithms of the coefficients."""
        weights = softmax(self.log_posteriors)
        logs = np.log(np.maximum([[getattr(n, name) for name in NAMES] for n in self.noises], 1e-12))
        mean = weights @ logs
        covariance = (weights[:, None] * (logs - mean)).T @ (logs - mean)
        # Between two points of the grid the coefficient may be anywhere.
        step = np.array([0.01, 0.5 * self.prior.deviations[1], 0.5 * self.prior.deviations[2]])
        covariance += np.diag(step**2 / 12.0)
        model = NoiseModel(*(float(x) for x in np.exp(mean)))
        return NoiseFit(model, covariance, self.prior)


def prior_of(
    model: AnyModel, noise_run: Run | None, settings: NoiseSettings = STANDARD.noise
) -> tuple[NoisePrior, str]:
    """The prior of the fit runs' noise: the model's, or what a static run shows.

    Raises
    ------
    InputError
        If the static run turns, or is too short for a noise.
    """
    stated = model.noise
    centre = NoiseModel(stated.N, stated.B, stated.K)
    factor = (stated.factor_N, stated.factor_B, stated.factor_K)
    if noise_run is None:
        wide = NoisePrior(centre, tuple(max(f, 1.001) for f in factor))  # type: ignore[arg-type]
        return wide, "the runs themselves, what moves with temperature taken out"
    check_noise_run(noise_run)
    usable, _ = usable_samples(noise_run)
    time, values = noise_run.time[usable], noise_run.gyro_deg_h[usable]
    if len(time) < settings.fewest_samples:
        raise InputError(
            f"{noise_run.name}: {len(time)} samples; a noise run needs at least {settings.fewest_samples}"
        )
    warmth = _motion(noise_run, usable, settings)
    # Whatever the size: a static run tells N within a per cent, whatever was thought before. Roughly from
    # neighbouring samples; B and K in the ratios that were expected.
    white = math.sqrt(0.5 * float(np.mean(np.diff(values) ** 2)))
    n = max(white * np.sqrt(float(np.median(np.diff(time))) / 3600.0), 1e-9)
    ratio = n / centre.N
    start = NoiseModel(n, max(centre.B, 1e-9) * ratio, max(centre.K, 1e-9) * ratio)
    fit = fit_noise(
        [time],
        [values],
        None if warmth is None else [warmth[:, None]],
        prior=NoisePrior(start, 10.0),
        averaging_s=noise_run.sample_s,
        most=settings.most_rows,
    )
    spread = np.hypot(np.minimum(fit.standard_errors, np.log(3.0)), np.log(settings.unit_factor))
    return NoisePrior(fit.model, tuple(np.exp(spread))), f"static run {noise_run.name}"


def not_static(noise_run: Run | None, settings: NoiseSettings = STANDARD.noise) -> tuple[str, ...]:
    """A sentence where temperature moves through a noise run."""
    if noise_run is None:
        return ()
    warmth = _motion(noise_run, usable_samples(noise_run)[0], settings)
    moved = 0.0 if warmth is None else float(np.ptp(warmth))
    if moved < settings.thermal_degc:
        return ()
    return (
        f"{noise_run.name} is no static run: temperature moves by {short(moved, 2)} degC in it, and drift "
        "that is no straight line in temperature counts as noise, which may hide a gap.",
    )


def _motion(run: Run, usable: BoolArray, settings: NoiseSettings) -> FloatArray | None:
    """Temperature about its mean as a regressor of a static run, where it moves at all."""
    held = leading_temperature(run)
    if held is None:
        return None
    warmth = held[usable]
    if not np.isfinite(warmth).all() or np.ptp(warmth) < settings.static_motion_degc:
        return None
    return np.asarray(warmth - warmth.mean())


def noise_points(
    setting: Setting, prior: NoisePrior, source: str, static: Run | None, negligible: float
) -> NoisePoints:
    """Noises to integrate over; those with less than exp(-`negligible`) of the likeliest prior left out.

    White noise is what the runs themselves show, whatever a static run said: it is no evidence of a cause.
    Flicker and random walk are taken at steps about what was expected of them, each as likely as the static
    run itself has it, or the prior where there is none: the runs decide, beside everything that may act.
    """
    settings, scene, offsets = setting.priors.noise, setting.scene, setting.priors.slow_noise
    families = [f for f in unknown_families(scene.grids) if f.id in settings.smooth]
    columns = Columns.of(families, scene)
    least = settings.noiseless * prior.centre.N
    white = first_noise(scene, prior, settings).N
    for step in settings.white_steps:
        while True:
            tried = [max(white / step, least), white, white * step]
            scores = [_score(setting, columns, replace(prior.centre, N=w)) for w in tried]
            best = int(np.argmax(scores))
            if best == 1 or tried[best] == white:
                break
            white = tried[best]
    told = None if static is None else StaticRun.of(static, settings)
    points = _points(prior, source, told, white, list(product(offsets[:-1], offsets))).within(negligible)
    found = np.array([_score(setting, columns, noise) for noise in points.noises])
    return replace(points, log_posteriors=found + points.log_posteriors)


def _points(
    prior: NoisePrior,
    source: str,
    static: StaticRun | None,
    white: float,
    steps: Sequence[tuple[float, float]],
) -> NoisePoints:
    """Noises at steps from what was expected, as likely as their priors have them."""
    held = dict(zip(NAMES, prior.deviations))
    noises: list[NoiseModel] = []
    kept, log_priors = [], []
    for b, k in steps:
        flicker = prior.centre.B * float(np.exp(b * held["B"]))
        noise = NoiseModel(white, flicker, prior.centre.K * float(np.exp(k * held["K"])))
        if noise not in noises:
            noises.append(noise)
            kept.append((b, k))
            own = replace(noise, N=prior.centre.N)
            log_priors.append(-0.5 * (b * b + k * k) if static is None else static.log_likelihood(own))
    return NoisePoints(
        tuple(noises), tuple(kept), tuple(log_priors), prior, source, np.array(log_priors), static
    )


def first_noise(scene: Scene, prior: NoisePrior, settings: NoiseSettings) -> NoiseModel:
    """White noise as second differences of neighbouring rows show it, slow noise as expected."""
    found = [white_noise(rows, settings.noiseless * prior.centre.N)[0] for rows in scene.fit]
    return replace(prior.centre, N=float(np.median(found)))


def white_noise(rows: Rows, least: float, made: Sequence[FloatArray] = ()) -> tuple[float, int]:
    """Coefficient N of one run from second differences of neighbouring rows, by median, or the least.

    And by how many differences it is told. What constants, and causes where there are some, may do to them
    is fitted first: a table that turns all the time makes no noise. Each difference counts by what that
    leaves of white noise in it. `made` is what each cause may make of the run, columns of shape (m, k)
    [deg/h].
    """
    second = np.diff(rows.gap, 2)
    values = np.concatenate([rows.constants, *made], axis=1)
    columns = np.diff(values, 2, axis=0)
    # Differences are rounded as their values are, which may be far larger.
    largest = np.abs(columns).max(axis=0)
    rounding = len(columns) * np.finfo(float).eps * np.abs(values).max(axis=0)
    moves = largest > rounding
    basis, sizes, _ = np.linalg.svd(columns[:, moves] / largest[moves], full_matrices=False)
    basis = basis[:, sizes > np.max(rounding[moves] / largest[moves], initial=0.0) * sizes.max(initial=0.0)]
    left = second - basis @ (basis.T @ second)
    # With D the second differences, the diagonal of (I - U U') D D' (I - U U').
    through = np.diff(np.pad(basis, ((2, 2), (0, 0))), 4, axis=0)
    variance = 6.0 - np.sum(basis * (2.0 * through - basis @ (basis.T @ through)), axis=1)
    told = variance > 1e-6
    if not told.any():
        return least, 0
    found = float(np.median(np.abs(left[told]) / np.sqrt(variance[told]))) / Z50
    return max(found * math.sqrt(rows.row_s / 3600.0), least), len(second) - basis.shape[1]


def _score(setting: Setting, columns: Columns, noise: NoiseModel) -> float:
    """Log evidence of a noise, beside nothing or one smooth unknown."""
    held = Field(setting, columns, noise)
    evidence = [held.base.log_evidence]
    for i in held.at:
        block = held.block(i)
        gains = size_gains(held.base.gram(block), held.base.fits(block), setting.priors.lengths)
        gained = held.base.log_evidence + float(np.logaddexp.reduce(gains))
        evidence.append(gained - setting.priors.noise.smooth_price)
    return float(np.logaddexp.reduce(evidence)) - held.whitening.log_det


@dataclass(frozen=True, eq=False)
class StaticRun:
    """A static run as rows: when each ends [s], their values [deg/h] and what is free, shape (m, k)."""

    end_s: FloatArray
    values: FloatArray
    free: FloatArray
    row_s: float
    unit_factor: float

    @classmethod
    def of(cls, run: Run, settings: NoiseSettings) -> StaticRun:
        """Means over even rows; those with few samples are left out."""
        usable, _ = usable_samples(run)
        time, values = run.time[usable], run.gyro_deg_h[usable]
        step = float(np.median(np.diff(time)))
        width = max(1, -(-len(time) // settings.static_rows))
        row = np.floor((time - time[0] + 0.5 * step) / (width * step)).astype(np.intp)
        counts = np.bincount(row)
        full = counts >= max(0.5 * width, 1)
        free = [np.ones(len(counts))]
        warmth = _motion(run, usable, settings)
        if warmth is not None:
            free.append(np.bincount(row, weights=warmth) / np.maximum(counts, 1))
        means = np.bincount(row, weights=values) / np.maximum(counts, 1)
        ends = time[0] + (np.arange(len(counts)) + 1.0) * width * step
        columns = settings.free_deg_h * np.column_stack(free)[full]
        return cls(ends[full], means[full], columns, width * step, settings.unit_factor)

    def log_likelihood(self, noise: NoiseModel) -> float:
        """Of noise that is a factor of `unit_factor` more or less from run to run."""
        values = []
        for off, weight in ((-1.0, 0.25), (0.0, 0.5), (1.0, 0.25)):
            scale = self.unit_factor**off
            held = NoiseModel(noise.N, noise.B * scale, noise.K * scale)
            whitener = Whitener(held, self.end_s, self.row_s)
            model = LinearGaussian.of(whitener.whiten(self.values)).beside(whitener.whiten(self.free))
            values.append(model.log_evidence - whitener.log_det + math.log(weight))
        return float(np.logaddexp.reduce(values))
