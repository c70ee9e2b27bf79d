"""What all noises share: runs, constants with their fixed block, and the whitening of rows by a noise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from fogml.arrays import FloatArray
from fogml.gap.linear_gaussian import LinearGaussian, Posterior, prior_factor
from fogml.gap.model import AnyModel, Constant
from fogml.gap.rows import READ, READ_GROUPS, Rows, slopes, through_nominal
from fogml.gap.scene import Scene, steps_are_coarse
from fogml.gap.settings import Priors
from fogml.gap.step_settings import NoiseSettings
from fogml.signals.bases import rate
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener
from fogml.twin.nominal import DELTA
from fogml.twin.twin import Twin


@dataclass(frozen=True, eq=False)
class Setting:
    """What all noises share: the scene, and the fixed block of constants and nuisances.

    Attributes
    ----------
    fixed
        Responses to one prior standard deviation, shape (m_r, p) for each run; constants first.
    errors
        What errors of each fit run's readings make of its replay, columns of unit priors, shape (m_r, k_r).
    covariances
        Of those, shape (m_r, m_r), where there are many of a run.
    widened
        Factors on the standard deviations of constants that are far off, by name.
    """

    scene: Scene
    constants: tuple[Constant, ...]
    priors: Priors
    fixed: tuple[FloatArray, ...]
    widened: Mapping[str, float] = field(default_factory=dict)
    errors: tuple[FloatArray, ...] = ()
    covariances: tuple[FloatArray | None, ...] = ()

    @property
    def values(self) -> Mapping[str, float]:
        """Constants at which effects meet the output: as fitted beside nothing, to begin with."""
        return self.scene.constants

    def at(self, values: Mapping[str, float]) -> Setting:
        """The same at other constants."""
        return replace(self, scene=replace(self.scene, constants=values))

    def with_covariances(self) -> Setting:
        """With the covariances of errors that are as many as it takes to be met more cheaply by those."""
        many = (3 * e.shape[1] > len(e) for e in self.errors)
        return replace(
            self, covariances=tuple(e @ e.T if wide else None for e, wide in zip(self.errors, many))
        )

    @property
    def deviations(self) -> FloatArray:
        """Prior standard deviations of the constants, widened ones so, shape (c,)."""
        return np.array([c.sd * self.widened.get(c.name, 1.0) for c in self.constants])

    def values_of(self, coefficients: FloatArray) -> dict[str, float]:
        """Constants in their units by coefficients, theirs first."""
        told = zip(self.constants, self.deviations, coefficients)
        return {c.name: float(c.mean + sd * x) for c, sd, x in told}

    @property
    def spans(self) -> tuple[slice, ...]:
        """Rows of each fit run in what is stacked."""
        edges = np.cumsum([0, *(len(r) for r in self.scene.fit)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(edges))


def whitener_of(noise: NoiseModel, rows: Rows, longest_runs: float = NoiseSettings.longest_runs) -> Whitener:
    """The whitener of a run's rows at a noise, whose flicker goes on to so many run lengths."""
    span = float(rows.end_s[-1] - rows.end_s[0]) + rows.row_s
    return Whitener(noise, rows.end_s, rows.row_s, noise.ladder(rows.row_s, longest_runs * span))


class RunWhitening:
    """Whitens series over the rows of one run by a noise, and by errors of its readings.

    Those, columns A of unit priors once whitened by the noise, add A A' to the covariance. With
    I + A'A = C C' an inverse root of I + A A' is I - A (C' + I)^-1 C^-1 A'
    (A. Andrews, AIAA Journal 6 (1968) 1165); of many columns the inverse of its own factor costs less.

    Parameters
    ----------
    noise, rows, longest_runs
        The noise, the run, and how many run lengths its flicker goes on to.
    errors, covariance
        Columns of unit priors, shape (m, k), and what they add to the covariance, shape (m, m), where those
        are many.
    """

    def __init__(
        self,
        noise: NoiseModel,
        rows: Rows,
        longest_runs: float,
        errors: FloatArray,
        covariance: FloatArray | None = None,
    ) -> None:
        self._whitener = whitener_of(noise, rows, longest_runs)
        extra = (1.0 / rows.weight**2 - 1.0) * noise.white_density / rows.row_s
        self._weight = 1.0 / np.sqrt(1.0 + extra / self._whitener.deviation**2)
        self.log_det = self._whitener.log_det - float(np.sum(np.log(self._weight)))
        self._given, self._factor, self._taken = errors, None, None
        if covariance is not None:
            # With W the noise's whitening and C the covariance: C W', and a factor of I + W C W'.
            self._across = self._by_noise(covariance).T
            self._factor = prior_factor(self._by_noise(self._across))
        elif errors.size:
            self._across = self._by_noise(errors).T
            self._factor = prior_factor(self._across @ self._across.T)
            beside = solve_triangular(self._factor + np.eye(len(self._factor)), self._across, lower=True)
            self._taken = solve_triangular(self._factor, beside, lower=True, trans=1).T
        if self._factor is not None:
            self.log_det += float(np.sum(np.log(np.diagonal(self._factor))))

    def _by_noise(self, values: FloatArray) -> FloatArray:
        white = self._whitener.whiten(values)
        white *= self._weight if white.ndim == 1 else self._weight[:, None]
        return white

    def whiten(self, values: FloatArray) -> FloatArray:
        """Series of shape (m, ...), whitened."""
        white = self._by_noise(values)
        if self._taken is not None:
            white -= self._taken @ (self._across @ white)
        elif self._factor is not None:
            white = solve_triangular(self._factor, white, lower=True, overwrite_b=True)
        return white

    def errors_in(self, values: FloatArray) -> FloatArray:
        """What of series of shape (m, ...) is errors of the readings, by their posterior mean."""
        if self._factor is None:
            return np.zeros(values.shape)
        white = self._by_noise(values)
        if self._taken is None:
            return np.asarray(self._across @ cho_solve((self._factor, True), white))
        return np.asarray(self._given @ cho_solve((self._factor, True), self._across @ white))


class Whitening:
    """Whitens series over the rows of the fit runs by one noise and by errors of each run's readings."""

    def __init__(self, noise: NoiseModel, setting: Setting) -> None:
        self.noise = noise
        fit, longest = setting.scene.fit, setting.priors.noise.longest_runs
        errors = setting.errors or [np.zeros((len(rows), 0)) for rows in fit]
        wide = setting.covariances or [None] * len(fit)
        told = zip(fit, errors, wide, strict=True)
        self.runs = [RunWhitening(noise, rows, longest, own, many) for rows, own, many in told]

    def stacked(self, series: Sequence[FloatArray]) -> FloatArray:
        """Series of each fit run, shape (m_r, ...), whitened and one after the other; others left out."""
        return np.concatenate([run.whiten(values) for values, run in zip(series, self.runs)])

    @cached_property
    def log_det(self) -> float:
        """Half the logarithm of the determinant of the rows' covariance."""
        return sum(run.log_det for run in self.runs)


def setting_of(model: AnyModel, plant: Twin, scene: Scene, priors: Priors, noise: NoiseModel) -> Setting:
    """Constants fitted beside nothing, those widened that are far off, and the fixed block at them."""
    constants = model.constants
    setting = Setting(scene, constants, priors, ()).at({c.name: c.mean for c in constants})
    noises = [float(np.median(whitener_of(noise, r, priors.noise.longest_runs).deviation)) for r in scene.fit]
    for _ in range(3):
        # Before the columns, which are as wide as the priors that coefficients are told by.
        off = {c.name: abs(setting.values[c.name] - c.mean) for c in constants}
        far = [c for c in constants if off[c.name] > priors.noise.far_off * c.sd]
        more = {c.name: 2.0 * off[c.name] / c.sd for c in far}
        setting = replace(setting, widened={**setting.widened, **more})
        least = [priors.noise.least_error * by for by in noises]
        errors = (_reading_errors(r, setting.values, by) for r, by in zip(scene.fit, least))
        setting = replace(setting, errors=tuple(errors)).with_covariances()
        fixed = tuple(fixed_columns(setting, i, plant) for i in range(len(scene.runs)))
        whitening = Whitening(noise, setting)
        found = Posterior.of(whitening.stacked(fixed), whitening.stacked([r.gap for r in scene.fit]))
        setting = replace(setting, fixed=fixed).at(setting.values_of(found.mean))
    return setting


def _reading_errors(rows: Rows, constants: Mapping[str, float], least: float) -> FloatArray:
    """What errors of the smoothed readings make of the replay, columns of unit priors, shape (m, k).

    Those of a size under `least` [deg/h] are left out.
    """
    told = slopes(rows, constants)
    steepest = sum(float(np.abs(slope).max()) * (2.0 if n == DELTA else 1.0) for n, slope in told.items())
    columns = [np.zeros((len(rows), 0))]
    for name, smoothness in rows.smoothness.items():
        # The modes are of length 1: none makes more than the steepest slope of it.
        if name in READ and smoothness.noise * steepest >= least:
            found = through_nominal(rows, told, {name: smoothness.errors(len(rows.kept))})
            columns.append(found[:, np.sum(found**2, axis=0) > least**2])
    return np.concatenate(columns, axis=1)


def fixed_columns(setting: Setting, run: int, plant: Twin) -> FloatArray:
    """One standard deviation of each constant, and of what sensors of ordinary quality miss, shape (m, p).

    Each sensor is late by a little, and its readings may be what acted, rather than the smooth course.
    Where they come in coarser steps than the twin's, the constants meet them as they were read, as a replay
    does. What the twin itself has that each run draws anew is another one on each.
    """
    scene, values, sd = setting.scene, setting.values, setting.deviations
    rows, coarse = scene.runs[run], steps_are_coarse(scene, plant)
    told, time = slopes(rows, values), rows.even.time
    columns = [rows.constants * sd]
    hidden = {n: v - rows.even.temperatures[n] for n, v in rows.readings.items()}
    if coarse:
        columns[0] = columns[0] + _through_each(rows, setting.constants, hidden) * sd
    lag_s = math.hypot(setting.priors.missed_lag, plant.sensors.common.lag)
    for names in READ_GROUPS:
        own = [n for n in names if n in rows.readings]
        late = {n: lag_s / 60.0 * rate(time, rows.even.temperatures[n]) for n in own}
        columns.append(through_nominal(rows, told, late)[:, None])
        errors = {n: hidden[n] for n in own}
        columns.append(through_nominal(rows, told, {} if coarse else errors)[:, None])
    columns.append(rows.replay_errors * np.array([lag_s, 1.0]))
    for declared, held in plant.on:
        if declared.drawn_per_run:
            own_column = np.zeros((len(rows), scene.fitted))
            if run < scene.fitted:
                own_column[:, run] = rows.made(declared, held.amplitude, held.shape, values)
            columns.append(own_column)
    off = {i: r.own.nuisances(values) for i, r in enumerate(scene.runs) if r.own is not None}
    for name in sorted({name for named in off.values() for name in named}):
        mine = off[run].get(name)
        columns.append((np.zeros(len(rows)) if mine is None else rows.samples(mine))[:, None])
    return np.concatenate(columns, axis=1)


def _through_each(rows: Rows, constants: Sequence[Constant], errors: Mapping[str, FloatArray]) -> FloatArray:
    """What readings differ by from the smooth course in the response to each constant, shape (m, c)."""
    zeros = {c.name: 0.0 for c in constants}
    columns = np.zeros((len(rows), len(constants)))
    for i, c in enumerate(constants):
        if c.name not in ("e0", "b0"):
            columns[:, i] = through_nominal(rows, slopes(rows, zeros | {c.name: 1.0}), errors)
    return columns


def gap_length(setting: Setting, noise: NoiseModel) -> float:
    """Whitened length of the gap beside the constants, above noise."""
    whitening = Whitening(noise, setting)
    data = whitening.stacked([r.gap for r in setting.scene.fit])
    left = LinearGaussian.of(data).beside(whitening.stacked(setting.fixed)).gram(data[:, None])
    return math.sqrt(max(float(left[0, 0]) - len(data), 0.0))


def with_form_errors(setting: Setting, noise: NoiseModel, length: float) -> Setting:
    """With what no form holds of a gap of a whitened length: its share, smooth in each run's time.

    Where that is too short to be seen there is none.
    """
    share, scene = setting.priors.form_error * length, setting.scene
    count = min(setting.priors.noise.form_waves, scene.most_of_own)
    if share < 1.0:
        return setting
    runs, fitted = scene.runs, scene.fitted
    waves = []
    for i, rows in enumerate(runs):
        held = np.zeros((len(rows), count * fitted))
        if i < fitted:
            into = rows.time_s - rows.end_s[0] + rows.row_s
            phase = np.pi * into / (rows.end_s[-1] - rows.end_s[0] + rows.row_s)
            held[:, i * count : (i + 1) * count] = np.cos(phase[:, None] * np.arange(1, count + 1))
        waves.append(held)
    white = Whitening(noise, setting).stacked(waves)
    scale = share / np.sqrt(float(count * fitted) * np.sum(white**2, axis=0))
    fixed = (np.concatenate([f, w * scale], axis=1) for f, w in zip(setting.fixed, waves))
    return replace(setting, fixed=tuple(fixed))
