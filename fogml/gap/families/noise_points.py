"""The noises that a diagnosis integrates over: about what fits, as likely as the static run allows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fogml.gap.families.frame import Setting
from fogml.gap.families.thermal_families import bumps
from fogml.signals.noise_fit import NAMES, NoiseFit, NoisePrior, fit_noise
from fogml.signals.noise_model import NoiseModel

SMOOTH_S, SMOOTH_BUMPS = 2400.0, 12
"""What wanders with time or temperature is kept out of the noise's first fit: half period [s], bumps."""
FREE_DEG_H = 5.0
"""Prior standard deviation of what that adds [deg/h]."""
MOST_ROWS = 600


@dataclass(frozen=True)
class NoisePoints:
    """Noises and the logarithms of their priors; `fit` is the one that the points lie about."""

    noises: tuple[NoiseModel, ...]
    log_priors: tuple[float, ...]
    fit: NoiseFit
    source: str


def noise_points(setting: Setting, prior: NoisePrior, source: str) -> NoisePoints:
    """Noises to integrate over.

    White noise is what the runs themselves show, whatever a static run said: it is no evidence of a cause.
    Flicker and random walk are taken at steps about what was expected of them, each as likely as the prior
    has it: the runs decide, beside everything that may act.
    """
    scene = setting.scene
    runs = scene.runs[: scene.fitted]
    fixed, free = [], []
    for rows, columns in zip(runs, setting.fixed):
        phase = np.pi * (rows.time_s - rows.time_s[0]) / max(rows.time_s[-1] - rows.time_s[0], 1.0)
        count = max(int((rows.time_s[-1] - rows.time_s[0]) / SMOOTH_S), 2)
        waves = np.zeros((len(rows), len(runs) * 40))
        own = np.cos(phase[:, None] * np.arange(1, min(count, 40) + 1))
        at = 40 * runs.index(rows)
        waves[:, at : at + own.shape[1]] = own
        fixed.append(columns)
        free.append(np.concatenate([waves, bumps(rows.temperature, *scene.range_degc, SMOOTH_BUMPS)], axis=1))
    used = np.any(np.concatenate(free), axis=0)
    beside = [np.concatenate([a, b[:, used]], axis=1) for a, b in zip(fixed, free)]
    deviations = np.concatenate([np.ones(fixed[0].shape[1]), np.full(int(used.sum()), FREE_DEG_H)])
    wide = NoisePrior(prior.centre, (10.0, prior_factor(prior, 1), prior_factor(prior, 2)))
    fit = fit_noise(
        [r.end_s for r in runs],
        [r.gap for r in runs],
        beside,
        prior=wide,
        deviations=deviations,
        averaging_s=runs[0].row_s,
        most=MOST_ROWS,
    )
    offsets = setting.priors.slow_noise
    held = dict(zip(NAMES, prior.deviations))
    noises, log_priors = [], []
    for b, k in product(offsets[:-1], offsets):
        slow = {
            name: getattr(prior.centre, name) * float(np.exp(x * held[name]))
            for name, x in (("B", b), ("K", k))
        }
        noise = replace(fit.model, **slow)
        if noise not in noises:
            noises.append(noise)
            log_priors.append(-0.5 * (b * b + k * k))
    return NoisePoints(tuple(noises), tuple(log_priors), fit, source)


def prior_factor(prior: NoisePrior, index: int) -> float:
    """The prior's factor of one coefficient."""
    return float(np.exp(prior.deviations[index]))
