"""Noise or effect: what came out as slow noise may be something unknown that moves as slowly.

Where the runs' noise lies above what is known of it, the search is done with the known noise as well,
and the noise and the explanation stand that are the more probable together.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fogml.gap.classes import UNEVEN, Ranking
from fogml.gap.preparing import Prepared, recalibrated_constants
from fogml.gap.search import Search
from fogml.signals.noise_fit import NAMES
from fogml.signals.noise_model import NoiseModel

ABOVE = 1.0
"""Prior standard deviations that slow noise came out above the known one, from which that is tried."""


def quieter(p: Prepared) -> Prepared | None:
    """The same with slow noise as it was known before; None where it came out no larger.

    White noise stays as fitted: whatever acts besides, the runs show it.
    """
    fitted, known = p.noise.fit.model, p.noise_prior.centre
    b, k = min(fitted.B, known.B), min(fitted.K, known.K)
    _, b_deviation, k_deviation = p.noise_prior.deviations
    above = max(_log_ratio(fitted.B, b) / b_deviation, _log_ratio(fitted.K, k) / k_deviation)
    if above < ABOVE:
        return None
    model = NoiseModel(fitted.N, b, k)
    noise = replace(p.noise, model=model, fit=replace(p.noise.fit, model=model))
    whiteners, constants = recalibrated_constants(p.model, p.fit, noise)
    return replace(p, noise=noise, whiteners=whiteners, recalibrated=constants)


def log_joint(p: Prepared, search: Search, ranking: Ranking) -> float:
    """Logarithm of the probability of the runs, the best explanation and the noise together."""
    field = search.field_
    evidence = field.log_evidence - sum(whitener.log_det for whitener in p.whiteners)
    fitted, prior = p.noise.fit.model, p.noise_prior
    off = [
        _log_ratio(getattr(fitted, name), getattr(prior.centre, name)) / deviation
        for name, deviation in zip(NAMES, prior.deviations)
        if getattr(prior.centre, name) > 0.0
    ]
    uneven = np.logaddexp(math.log1p(-UNEVEN), ranking.noise.gain + math.log(UNEVEN))
    return float(evidence + ranking.best.log_posterior + uneven - 0.5 * np.sum(np.square(off)))


def _log_ratio(value: float, other: float) -> float:
    return math.log(max(value, 1e-300) / max(other, 1e-300))
