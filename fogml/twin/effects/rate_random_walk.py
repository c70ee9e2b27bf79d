"""Random walk of the bias."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.quantities import Quantity


class RateRandomWalk(NoiseEffect):
    """The bias walks at random.

    ::

        sigma(tau) = K sqrt(tau / 3)

    with K in deg/h/sqrt(h) and tau in hours. Not to be read from a run whose temperature moves.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "rate_random_walk"
    code = "E4"
    title = "Rate random walk"
    amplitude = Quantity("amplitude", "deg/h/sqrt(h)", (0.02, 1.0), (1e-4, 5e-3), "K", (0.0, 1e6))
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at long times, with slope +1/2"
    shown_on = "rest for an hour"
    confused_with = {
        "rate_ramp": "several runs: a ramp is the same in each",
        "bias_instability": "longer times: this one rises",
        "stress_relaxation": "a repeat of the run: relaxation repeats",
        "ageing": "a repeat of the run",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        from fogml.signals.random_noise import random_walk

        # From deg/h/sqrt(h) to deg/h/sqrt(s).
        return random_walk(rng, count, sample_s, amplitude / 60.0)
