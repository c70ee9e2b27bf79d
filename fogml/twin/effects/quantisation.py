"""Quantisation of the output angle."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.noise import URAD_S_IN_DEG_H
from fogml.twin.quantities import Quantity


class Quantisation(NoiseEffect):
    """The angle is read in whole steps.

    ::

        y = q diff(round(theta / q)) / dt,      q = sqrt(12) Q,      sigma(tau) = sqrt(3) Q / tau

    What rounding leaves over is drawn as uniform and white, as it is for a rate of several steps a sample.
    1 urad is 0.206 arcsec.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "quantisation"
    code = "E1"
    title = "Quantisation"
    amplitude = Quantity("amplitude", "urad", (0.05, 5.0), (5e-3, 0.5), "Q", (0.0, 1e6))
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at short times, with slope -1"
    shown_on = "rest for an hour"
    confused_with = {
        "angle_random_walk": "the slope of the Allan deviation: -1 here, -1/2 there",
        "sensor_quantisation": "it does not go with temperature",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        from fogml.signals.random_noise import quantisation_noise

        return quantisation_noise(rng, count, sample_s, amplitude * URAD_S_IN_DEG_H)
