"""Modulation off the proper frequency."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ProperFrequencyMismatch(BiasEffect):
    """The modulation stays at its frequency while the coil's proper frequency drifts.

    ::

        b = q (f_m / f_p(T) - 1) = q (dn/dT / n + alpha) (T - 25)

    q in deg/h per unit; f_m is the proper frequency at 25 degC, which falls by 7.2 ppm/degC. Another
    f_m adds a constant to the bias.

    Source: proper frequency c / (2 n L) (derived); Lefevre (literature); q before gating of the demodulator
    is an engineering range.
    """

    id = "proper_frequency_mismatch"
    code = "C7"
    title = "Modulation off the proper frequency"
    amplitude = Quantity("amplitude", "deg/h", (100.0, 1000.0), (10.0, 100.0), "q", (-1e6, 1e6), signed=True)
    needs = ("T",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias linear in the coil's temperature"
    confused_with = {
        "bias_polynomial": "a sweep of the modulation frequency",
        "electronic_crosstalk": "a sweep of the modulation frequency",
        "mount_tilt": "a sweep of the modulation frequency, or a yaw of the fixture",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h and unit of mismatch [deg/h], shape (n,)."""
        return inputs.coil.proper_frequency_slope * inputs.u("T")
