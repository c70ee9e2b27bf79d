"""Spurious intensity modulation."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.optics import REFERENCE_COIL
from fogml.twin.quantities import Quantity

_URAD_PER_DEG_H = 1e6 * REFERENCE_COIL.phase_per_deg_h


class IntensityModulation(BiasEffect):
    """The phase modulator modulates the intensity as well, which demodulates as a phase.

    ::

        b = m tan(phi_b / 2) / K_S,      phi_b = depth / (1 + 1e-6 a_v (T_electronics - 25))

    m in microradian; ``modulation_depth`` at 25 degC in degrees, and ``halfwave_coefficient`` a_v
    [ppm/degC] by which the modulator's half-wave voltage grows. 6.56 microradian are 1 deg/h.

    Source: Lefevre (literature) for size, 1e-7 to 1e-6 rad; form for square-wave bias modulation
    derived.
    """

    id = "intensity_modulation"
    code = "C5"
    title = "Spurious intensity modulation"
    amplitude = Quantity("amplitude", "urad", (0.1, 1.0), (0.1, 1.0), "m", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("modulation_depth", "deg", (90.0, 157.5), (90.0, 157.5), "phi_b at 25 degC", (1.0, 175.0)),
        Quantity("halfwave_coefficient", "ppm/degC", (300.0, 1000.0), (300.0, 1000.0), "a_v", (-5e3, 5e3)),
    )
    needs = ("T_electronics",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias, nearly linear in the electronics' temperature, that grows with the modulation depth"
    confused_with = {
        "electronic_crosstalk": "change the light's power: only cross-talk changes",
        "bias_polynomial": "a power step moves the electronics alone",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per microradian [deg/h], shape (n,)."""
        growth = 1.0 + 1e-6 * shape["halfwave_coefficient"] * inputs.u("T_electronics")
        return np.tan(0.5 * np.radians(shape["modulation_depth"]) / growth) / _URAD_PER_DEG_H
