"""Noise under vibration."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import WhiteNoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class VibrationNoise(WhiteNoiseEffect):
    """White noise of the rate under vibration, which random strain of the coil makes.

    ::

        N = A g_rms

    in deg/sqrt(h), with g_rms the vibration [g]: strain is in proportion to acceleration, so its density is
    to g_rms**2. It comes with ``vibration_rectification``, which is of second order.

    Source: first-order response to random vibration (derived); ranges are engineering ones, of units whose
    noise doubles at some g rms.
    """

    id = "vibration_noise"
    code = "E11"
    title = "Noise under vibration"
    amplitude = Quantity("amplitude", "deg/sqrt(h)/g", (2e-3, 5e-2), (1e-4, 2e-3), "A", (0.0, 1e6))
    needs = ("vibration",)
    sources = ("IEEE Std 952-1997", "H. C. Lefevre, The Fiber-Optic Gyroscope")
    shows = "more white noise while something shakes, such as the compressor"
    confused_with = {
        "angle_random_walk": "all machines off: that one stays",
        "vibration_rectification": "the mean, which that one shifts",
    }
    candidate = False

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Vibration [g], shape (n,)."""
        return inputs.drive("vibration")
