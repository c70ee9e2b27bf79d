"""Expansion of the coil."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class CoilExpansion(ScaleFactorEffect):
    """Length and diameter of the warming coil, which the scale factor is proportional to.

    ::

        s = (alpha_L + alpha_D) (T - 25)

    alpha_D is 0.55 ppm/degC for free silica and 5 to 25 on a former or in adhesive, alpha_L 0.5 to 5; a
    navigation gyro has a former of low expansion, which fibre and diameter follow. T stands for the
    coil's mean. It is one with the nominal gyro's own slope of the scale factor.

    Source: Lefevre (literature); ranges partly engineering ones.
    """

    id = "coil_expansion"
    code = "D2"
    place = "coil"
    title = "Expansion of the coil"
    amplitude = Quantity("amplitude", "ppm/degC", (1.0, 30.0), (0.1, 3.0), "alpha_L + alpha_D", (-1e3, 1e3))
    needs = ("T",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a scale factor in proportion to the coil's temperature"
    confused_with = {
        "source_wavelength": "turn the table during warm-up, when the source heats first, and in soaks",
        "halfwave_voltage": "turn the table during warm-up: the modulator heats first",
        "sf_hysteresis": "the rate table at each soak, on both branches",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm/degC [ppm], shape (n,)."""
        return inputs.u("T")
