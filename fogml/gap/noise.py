"""The noise that a diagnosis judges by: from a static run, or from the runs themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.gap.frame import constant_rows
from fogml.gap.group import Group
from fogml.gap.model import Constant, GyroModel
from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray, Run
from fogml.signals.noise_fit import NAMES, NoiseFit, NoisePrior, fit_noise
from fogml.signals.noise_model import NoiseModel

UNIT_FACTOR = 1.3
"""Noise of a unit from one run to another, as a factor."""
BESIDE = (
    "temperature",
    "temperature_rate",
    "past",
    "heat_flow",
    "start",
    "time",
    "direction",
    "gradient",
    "table_rate",
)
"""Groups of the unknown that are kept out of the noise."""
FROM_RUNS = "the runs themselves, what moves with temperature taken out"
FROM_RUNS_ALONE = "the runs themselves, what was found taken out"
"""Where the noise comes from if no static run tells it: with smooth unknowns kept out, or without."""
MOST_ROWS, MOST_OF_ALL, FEWEST_ROWS = 1500, 3000, 600
"""Rows of a run whose likelihood is exact: at most, of all runs together, and of each at least."""
FREE_DEG_H = 5.0
"""Prior standard deviation of what smooth unknowns add [deg/h]."""
LEAST_SHARE_OF_WHITE = 0.02
SAFE_SIDE = 0.6
"""Standard errors that slow noise is taken larger by."""


@dataclass(frozen=True)
class Noise:
    """Noise as known: its coefficients, their spread and where they come from."""

    model: NoiseModel
    fit: NoiseFit
    source: str


def prior_of(model: GyroModel, noise_run: Run | None) -> tuple[NoisePrior, str]:
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


def noise_of(
    observations: Sequence[Observation],
    constants: Sequence[Constant],
    groups: Sequence[Group],
    prior: NoisePrior,
    source: str,
    explained: Sequence[FloatArray] | None = None,
) -> Noise:
    """The noise of the fit runs, beside the constants and smooth unknowns, under a prior.

    `explained` are rows of what effects that were found can do on each run, shape (m_r, k).
    """
    series, times, fixed, free = [], [], [], []
    means = {c.name: c.mean for c in constants}
    smooth = [g for g in groups if g.name in BESIDE]
    for r, o in enumerate(observations):
        used = _quiet(o)
        fixed.append(constant_rows(o, constants)[used])
        columns = [column for g in smooth for column in g.columns[r].T]
        if explained is not None:
            # Scaled so that one prior standard deviation is plenty.
            columns += [column / max(float(np.abs(column).max()), 1e-300) for column in explained[r].T]
        free.append(np.reshape(columns, (len(columns), len(o))).T[used])
        series.append((o.recorded - o.averaged(o.model.output(means)))[used])
        times.append(o.time[used])
    axes = _plain_axes(free, prior.centre.N * np.sqrt(3600.0 / observations[0].row_s))
    columns = [np.concatenate([a, b @ axes], axis=1) for a, b in zip(fixed, free)]
    deviations = np.concatenate([np.ones(len(constants)), np.full(axes.shape[1], FREE_DEG_H)])
    fit = fit_noise(
        times,
        series,
        columns,
        prior=prior,
        deviations=deviations,
        averaging_s=observations[0].row_s,
        most=min(MOST_ROWS, max(MOST_OF_ALL // len(observations), FEWEST_ROWS)),
    )
    return Noise(_on_the_safe_side(fit), fit, source)


def tension(noise: Noise, prior: NoisePrior) -> float:
    """Evidence that something unknown was taken for noise: noise far above what was known of it [nats].

    That of a coefficient that is free to be larger, against the prior; at the price of being asked.
    """
    return 0.5 * max(0.0, *deviations_above(noise, prior).values()) ** 2 - math.log(10.0)


def deviations_above(noise: Noise, prior: NoisePrior) -> dict[str, float]:
    """Prior standard deviations that each coefficient which is free came out above its median."""
    return {
        name: math.log(getattr(noise.fit.model, name) / getattr(prior.centre, name)) / deviation
        for name, deviation in zip(NAMES, prior.deviations)
        if getattr(prior.centre, name) > 0.0
    }


def _plain_axes(free: Sequence[FloatArray], white_deg_h: float) -> FloatArray:
    """Main axes of columns with equal priors, shape (k, axes); those far under white noise left out."""
    rows = sum(map(len, free))
    squares, axes = np.linalg.eigh(sum(block.T @ block for block in free))
    size = FREE_DEG_H * np.sqrt(np.maximum(squares, 0.0) / rows)
    return np.asarray(axes[:, size > LEAST_SHARE_OF_WHITE * white_deg_h])


def _on_the_safe_side(fit: NoiseFit) -> NoiseModel:
    """The fitted noise with slow terms larger by a share of their uncertainty.

    Slow noise that is underestimated looks like an effect; overestimated it only hides a weak one.
    """
    _, b, k = SAFE_SIDE * np.minimum(fit.standard_errors, 1.0)
    return NoiseModel(float(fit.model.N), float(fit.model.B * np.exp(b)), float(fit.model.K * np.exp(k)))


def _quiet(o: Observation) -> NDArray[np.bool_]:
    """Rows in which the table rests, if they are enough: in turns the readings' noise counts as well."""
    rate = np.abs(o.averaged(o.run.rate))
    still = rate <= 1e-3 * float(rate.max(initial=0.0))
    return still if still.sum() >= 0.4 * len(still) else np.ones(len(still), dtype=np.bool_)


def _motion(run: Run, usable: np.ndarray) -> FloatArray:
    """Temperature as a regressor of a static run, where it moves at all."""
    if not run.temperature_columns:
        return np.empty((int(usable.sum()), 0))
    temperature = run.temperature()[usable]
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
