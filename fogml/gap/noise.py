"""The noise that a diagnosis judges by: from a static run, or from the runs themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.errors import InputError
from fogml.gap.twin_model import AnyModel
from fogml.runs.run import FloatArray, Run
from fogml.runs.thermal_columns import leading_temperature
from fogml.signals.noise_fit import NoiseFit, NoisePrior, fit_noise
from fogml.signals.noise_model import NoiseModel

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
