"""Steady drift of the bias."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class RateRamp(NoiseEffect):
    """The bias drifts steadily.

    ::

        y = R t,      sigma(tau) = R tau / sqrt(2)

    with t in hours, from the first sample on. It is the same in every run, and so in a
    replay. A thermal ramp that is left looks exactly like it: not to
    be read from a run whose temperature moves.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "rate_ramp"
    code = "E5"
    place = "electronics"
    title = "Rate ramp"
    amplitude = Quantity("amplitude", "deg/h/h", (1e-3, 0.1), (1e-5, 1e-3), "R", (-1e6, 1e6), signed=True)
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at long times, with slope +1"
    confused_with = {
        "ageing": "days: ageing slows down",
        "rate_random_walk": "several runs: a ramp is the same in each",
        "bias_polynomial": "a soak of more than 6 h",
        "stress_relaxation": "a soak of more than 6 h: relaxation dies away",
    }
    candidate = True
    steady = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Hours since the first sample, shape (n,)."""
        return np.asarray((inputs.time - inputs.memory.first(f"{self.id} start", inputs.time)) / 3600.0)

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        return amplitude * sample_s / 3600.0 * np.arange(count, dtype=np.float64)
