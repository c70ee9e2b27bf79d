"""Rectified vibration."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class VibrationRectification(BiasEffect):
    """A steady shift of the bias under vibration.

    ::

        b = k_v g_rms**2

    with g_rms the vibration [g], and k_v with the gain of the unit's resonances in it. Sources that shake
    independently add in squares. The noise that comes with it is ``vibration_noise``.

    Source: second-order response (literature); ranges are engineering ones.
    """

    id = "vibration_rectification"
    code = "F1"
    family = "vibration"
    place = "mount"
    title = "Vibration rectification"
    amplitude = Quantity("amplitude", "deg/h/g2", (0.01, 1.0), (1e-4, 2e-2), "k_v", (-1e6, 1e6), signed=True)
    needs = ("vibration",)
    sources = ("IEEE Std 952-1997", "H. C. Lefevre, The Fiber-Optic Gyroscope")
    shows = "a shift with the vibration, such as while the compressor runs, together with more noise"
    confused_with = {
        "chamber_pickup": "a vibration sensor; the compressor off for ten minutes in a soak",
        "bias_polynomial": "the compressor off for ten minutes in a soak",
        "vibration_noise": "the mean: noise has none",
        "g_sensitivity": "another attitude at rest changes that one alone",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/g**2 [deg/h], shape (n,)."""
        return np.square(inputs.drive("vibration"))
