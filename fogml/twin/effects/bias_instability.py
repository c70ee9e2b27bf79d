"""Flicker of the bias."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.quantities import Quantity


class BiasInstability(NoiseEffect):
    """Flicker: noise with a density of 1/f, without end at either side.

    ::

        S(f) = B**2 / (pi f) one-sided,      sigma(tau) = sqrt(2 ln 2 / pi) B = 0.664 B

    Drawn for the whole record at once, with 1/f down to half of one over its length.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "bias_instability"
    code = "E3"
    title = "Bias instability"
    amplitude = Quantity("amplitude", "deg/h", (0.05, 2.0), (5e-4, 1e-2), "B", (0.0, 1e6))
    sources = ("IEEE Std 952-1997",)
    shows = "the flat part of the Allan deviation"
    shown_on = "rest for an hour"
    confused_with = {
        "gauss_markov": "two decades of averaging time: that one has a hump",
        "rate_random_walk": "longer times: that one rises",
        "chamber_ripple": "coherence with temperature",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        from fogml.signals.random_noise import flicker_noise

        return flicker_noise(rng, count, amplitude)
