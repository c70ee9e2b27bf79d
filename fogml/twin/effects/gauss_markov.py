"""Noise with an exponential correlation."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.quantities import Quantity


class GaussMarkov(NoiseEffect):
    """A first-order Gauss-Markov process.

    ::

        dy/dt = -y / T_c + q_c white(t),      standard deviation A = q_c sqrt(T_c / 2)

    A is the amplitude and ``time_constant`` is T_c. The Allan deviation rises to a hump of 0.437 q_c
    sqrt(T_c) at 1.89 T_c.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "gauss_markov"
    code = "E7"
    title = "Gauss-Markov noise"
    amplitude = Quantity("amplitude", "deg/h", (0.05, 2.0), (5e-4, 1e-2), "standard deviation", (0.0, 1e6))
    shape = (Quantity("time_constant", "s", (10.0, 1e4), (10.0, 1e4), "T_c", (1e-6, 1e9)),)
    sources = ("IEEE Std 952-1997",)
    shows = "a hump of the Allan deviation at about twice its correlation time"
    shown_on = "rest for an hour"
    confused_with = {
        "bias_instability": "two decades of averaging time: flicker is flat",
        "sinusoidal": "the spectrum: a line is narrow",
        "rate_random_walk": "longer times: this one falls again",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        from fogml.signals.random_noise import gauss_markov

        return gauss_markov(rng, count, sample_s, amplitude, shape["time_constant"])
