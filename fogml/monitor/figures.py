"""Figures of what a model leaves on a run, each with its standard error under the run's own noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma

from fogml.arrays import BoolArray, FloatArray
from fogml.models.base import DriftModel
from fogml.signals.noise_fit import fit_noise
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener

_DRAWS = 16
"""Noise models drawn to tell how well the run tells its noise: degrees of freedom to a third."""
_ALIKE = 1e-6
"""Rates that differ by no more than this share are the same: far below what a table's rate is told to."""


@dataclass(frozen=True)
class Averages:
    """Averages of what is left on a run.

    Attributes
    ----------
    time
        Mean times of the m averages [s], shape (m,).
    left
        What the model leaves [deg/h], shape (m,).
    temperature
        Temperature [degC], shape (m,).
    reference
        Rate of the table and of Earth [deg/h], shape (m,).
    used
        Those that tell level, slopes and scatter, shape (m,).
    moving
        Those during which the table turns, shape (m,).
    averaging_s
        Averaging time [s].
    """

    time: FloatArray
    left: FloatArray
    temperature: FloatArray
    reference: FloatArray
    used: BoolArray
    moving: BoolArray
    averaging_s: float


def run_figures(averages: Averages, model: DriftModel, *, outside_deviation: float = 0.0) -> dict[str, float]:
    """Figures of a run by their names, and their standard errors by those with ``_se``.

    The noise is fitted to the same averages (`fogml.signals.noise_fit`), so that a standard error counts for
    as many degrees of freedom nu as the noise's own uncertainty leaves it (F. E. Satterthwaite, Biometrics
    Bulletin 2, 1946): it is the deviation of Student's t, ``sqrt(nu / (nu - 2))`` times that of known noise.

    A level at the middle of the trained temperatures needs a slope. What the run does not tell of it is no
    more than what the model states: over the trained range it adds the deviation of the model's intervals.
    Averages outside training tell a level alone, as well as the model's interval there states
    (`outside_deviation`, deg/h).

    Where the table turns in some of these, the scale factor is fitted with them. A table that turns
    alike in all of them tells neither level nor scale factor, as each looks as the other does.
    """
    used = averages.used
    time, left = averages.time[used], averages.left[used]
    if np.ptp(left) == 0.0:
        return _still(float(left[0]))
    columns, priors = _columns(model, averages)
    reference = averages.reference[used]
    turned = bool(averages.moving[used].any())
    alike = turned and bool(np.ptp(reference) <= _ALIKE * np.abs(reference).max())
    if turned and not alike:
        columns["scale_factor"] = 1e-6 * averages.reference
        priors = np.append(priors, np.inf)
    names = list(columns)
    every = np.stack([np.ones(len(used)), *columns.values()], axis=1)
    table = every[used]
    noise = fit_noise([time], [left], [table[:, 1:]], averaging_s=averages.averaging_s)
    models = [noise.model, *noise.draw(np.random.default_rng(0), _DRAWS)]
    fits = [_fit(one, time, averages.averaging_s, table, left, priors) for one in models]
    found = _untold()
    for i, name in enumerate(["level", *names]):
        found[name] = fits[0].values[i]
        found[f"{name}_se"] = _of_student([fit.errors[i] for fit in fits])
        if i and found[f"{name}_se"] > priors[i - 1]:
            # The run tells the slope less well than the model states it.
            found[name] = found[f"{name}_se"] = float("nan")
    free = len(time) - table.shape[1]
    # The logarithm of a deviation with so many degrees of freedom: its mean and its variance.
    found["scatter"] = fits[0].innovation - 0.5 * float(digamma(free / 2) - np.log(free / 2))
    found["scatter_se"] = 0.5 * float(np.sqrt(polygamma(1, free / 2)))
    if outside_deviation:
        found["level_se"] = float(np.hypot(found["level_se"], outside_deviation))
        for name in ("temperature_slope", "rate_slope", "scatter", "scale_factor"):
            found[name] = found[f"{name}_se"] = float("nan")
    if alike:
        found["level"] = found["level_se"] = float("nan")
    if not turned:
        found["scale_factor"], found["scale_factor_se"] = _by_turns(
            averages, every, models, fits, outside_deviation
        )
    return found


def _untold() -> dict[str, float]:
    names = ("level", "temperature_slope", "rate_slope", "scatter", "scale_factor")
    return {f"{name}{end}": float("nan") for name in names for end in ("", "_se")}


def _still(level: float) -> dict[str, float]:
    """Of an output that does not move: no noise, so that nothing tells how well it is told."""
    return {**_untold(), "level": level}


def _columns(model: DriftModel, averages: Averages) -> tuple[dict[str, FloatArray], FloatArray]:
    """Regressors of the slopes that the run moves along, and what deviation each slope has by the model."""
    temperature = averages.temperature
    rate = _rate(averages.time, temperature, averages.averaging_s)
    deviation = float(model.intervals_.half_width(0.68))
    columns, priors = {}, []
    for name, atom, values in (("temperature_slope", "T", temperature), ("rate_slope", "dT", rate)):
        told = values[averages.used]
        if not np.ptp(told) > 0.0:
            continue
        low, high = model.card_.box.get(atom, (told.min(), told.max()))
        middle = 0.5 * (low + high) if atom == "T" else 0.0
        columns[name] = values - middle
        # Over an evenly covered range, a slope of 1 has the deviation of its span over the root of 12.
        priors.append(deviation * np.sqrt(12.0) / (high - low) if high > low else np.inf)
    return columns, np.array(priors)


@dataclass(frozen=True)
class _Fit:
    """Constants [level, slopes], their standard errors, and the log deviation of an innovation.

    `together` and `covariance` are constants with what the model states of the slopes.
    """

    values: FloatArray
    errors: FloatArray
    innovation: float
    together: FloatArray
    covariance: FloatArray


def _fit(
    noise: NoiseModel,
    time: FloatArray,
    averaging_s: float,
    table: FloatArray,
    left: FloatArray,
    priors: FloatArray,
) -> _Fit:
    whitener = Whitener(noise, time, averaging_s)
    white = whitener.whiten(np.column_stack((table, left)))
    columns, y = white[:, :-1], white[:, -1]
    # Slopes stand for themselves; the level is told with what the model states of them.
    slopes, covariance = _solved(columns, y)
    rows = np.diag(np.concatenate(([0.0], np.where(np.isfinite(priors), 1.0 / priors, 0.0))))
    level, known = _solved(np.vstack((columns, rows)), np.concatenate((y, np.zeros(len(rows)))))
    values = np.concatenate((level[:1], slopes[1:]))
    errors = np.sqrt(np.concatenate((np.diag(known)[:1], np.diag(covariance)[1:])))
    left_over = y - columns @ slopes
    free = len(y) - columns.shape[1]
    scale = 0.5 * np.log(float(left_over @ left_over) / free)
    return _Fit(values, errors, whitener.log_det / len(y) + scale, level, known)


def _solved(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least squares by singular values, and the constants' covariance for noise of variance 1."""
    scale = np.linalg.norm(columns, axis=0)
    inverse = np.linalg.pinv(columns / scale) / scale[:, None]
    return inverse @ y, inverse @ inverse.T


def _of_student(errors: list[float]) -> float:
    """Standard error that counts that the noise is estimated; the first is of the noise as found."""
    spread = float(np.var(2.0 * np.log(errors[1:])))
    # The logarithm of a variance with nu degrees of freedom has the variance 2 / nu, if nu is large.
    freedom = 2.0 / spread if spread > 0.0 else np.inf
    return errors[0] * float(np.sqrt(1.0 + 2.0 / max(freedom - 2.0, 1.0)))


def _rate(time: FloatArray, temperature: FloatArray, averaging_s: float) -> FloatArray:
    """Rate of averaged temperatures [degC/min], taken within stretches without a gap, shape (m,)."""
    rate = np.zeros(len(time))
    edges = np.flatnonzero(np.diff(time) > 2.5 * averaging_s) + 1
    for part in np.split(np.arange(len(time)), edges):
        if len(part) > 1:
            rate[part] = 60.0 * np.gradient(temperature[part], time[part])
    return rate


def _by_turns(
    averages: Averages,
    table: FloatArray,
    models: list[NoiseModel],
    fits: list[_Fit],
    outside_deviation: float,
) -> tuple[float, float]:
    """Error of the scale factor [ppm] by the averages at which the table turns, and its standard error.

    Level and slopes, of which `table` holds the regressors, are told by the others.
    """
    moving = averages.moving
    reference = averages.reference[moving]
    power = float(reference @ reference)
    if not power > 0.0:
        return float("nan"), float("nan")
    weights = 1e6 * reference / power
    of_constants = weights @ table[moving]

    def deviation(model: NoiseModel, fit: _Fit) -> float:
        coloured = Whitener(model, averages.time[moving], averages.averaging_s).colour_adjoint(weights)
        return float(np.sqrt(coloured @ coloured + of_constants @ fit.covariance @ of_constants))

    told = _of_student([deviation(model, fit) for model, fit in zip(models, fits, strict=True)])
    error_ppm = float(weights @ averages.left[moving] - of_constants @ fits[0].together)
    return error_ppm, float(np.hypot(told, outside_deviation * of_constants[0]))
