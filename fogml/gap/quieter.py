"""Noise or effect: what came out as slow noise may be something unknown that moves as slowly.

Where the runs' noise lies above what is known of it, the search is done with the known noise as well.
It may be the other way round, too: smooth unknowns that are kept out of the noise take slow noise along.
So the search is also done with whatever moves slowly taken for noise. The noise and the explanation stand
that are the most probable together.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fogml.gap.classes import UNEVEN, Ranking
from fogml.gap.noise import deviations_above
from fogml.gap.preparing import Prepared, recalibrated_constants, with_noise_beside
from fogml.gap.search import Search
from fogml.signals.noise_model import NoiseModel

ABOVE = 1.0
"""Prior standard deviations that slow noise came out above the known one, from which that is tried."""


def quieter(p: Prepared) -> Prepared | None:
    """The same with slow noise as it was known before; None where it came out no larger.

    White noise stays as fitted: whatever acts besides, the runs show it.
    """
    fitted, known = p.noise.fit.model, p.noise_prior.centre
    above = deviations_above(p.noise, p.noise_prior)
    if max(above.get("B", 0.0), above.get("K", 0.0)) < ABOVE:
        return None
    model = NoiseModel(fitted.N, min(fitted.B, known.B), min(fitted.K, known.K))
    noise = replace(p.noise, model=model, fit=replace(p.noise.fit, model=model))
    whiteners, constants = recalibrated_constants(p.model, p.fit, noise)
    return replace(p, noise=noise, whiteners=whiteners, recalibrated=constants)


def louder(p: Prepared) -> Prepared:
    """The same with whatever the constants leave taken for noise."""
    return with_noise_beside(p, None, alone=True)


def log_joint(p: Prepared, search: Search, ranking: Ranking) -> float:
    """Logarithm of the probability of the runs, the best explanation and the noise together."""
    field = search.field_
    evidence = field.log_evidence - sum(whitener.log_det for whitener in p.whiteners)
    off = list(deviations_above(p.noise, p.noise_prior).values())
    uneven = np.logaddexp(math.log1p(-UNEVEN), ranking.noise.gain + math.log(UNEVEN))
    return float(evidence + ranking.best.log_posterior + uneven - 0.5 * np.sum(np.square(off)))
