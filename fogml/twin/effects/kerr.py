"""Optical Kerr effect."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class Kerr(BiasEffect):
    """Two beams of unequal power change the index for each other.

    ::

        b = k_K (P_1 - P_2) (1 - <I**2> / (2 <I>**2)) = A 10**(c (T_electronics - 25) / 10)

    The amplitude A is the bias at 25 degC; it is about zero for a broadband source, whose intensity
    has <I**2> = 2 <I>**2. ``power_coefficient`` c [dB/degC] is that of the light's power, which P_1 - P_2
    follows; where ``light_power`` is on, the light is the one that it states.

    Source: Bergh, Lefevre and Shaw, Optics Letters 7 (1982) 282 (literature); below 1e-3 deg/h with a
    broadband source (engineering).
    """

    id = "kerr"
    code = "C6"
    title = "Kerr effect"
    amplitude = Quantity("amplitude", "deg/h", (1e-5, 1e-3), (1e-6, 1e-4), "A", (-100.0, 100.0), signed=True)
    shape = (Quantity("power_coefficient", "dB/degC", (-0.05, -0.02), (-0.05, -0.02), "c", (-1.0, 1.0)),)
    needs = ("T_electronics",)
    sources = ("R. A. Bergh, H. C. Lefevre and H. J. Shaw, Optics Letters 7 (1982) 282",)
    shows = "a bias in proportion to the light's power; none with a broadband source"
    confused_with = {
        "electronic_crosstalk": "change the coherence or the power split: only this one changes",
        "bias_polynomial": "change the coherence or the power split",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h at 25 degC [deg/h], shape (n,)."""
        # Per 100 degC, as the unit's light has it.
        slope = 100.0 * shape["power_coefficient"]
        return inputs.light.level(inputs.u("T_electronics"), power_slope=slope)
