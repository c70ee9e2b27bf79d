"""Spurious intensity modulation."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class IntensityModulation(BiasEffect):
    """The phase modulator modulates the intensity as well, which demodulates as a phase.

    ::

        b = m cot(phi_b / 2) / K_S,      phi_b = depth / (1 + 1e-6 a_v (T_electronics - 25))

    The two states of the bias modulation have powers in proportion to (1 + m) (1 + cos(phi_b + phi)) and (1
    - m) (1 + cos(phi_b - phi)); their difference vanishes at phi = m (1 + cos phi_b) / sin phi_b, which is
    read as a rate: a deeper modulation takes less of it. m in microradian; ``modulation_depth`` at 25 degC
    in degrees, and ``halfwave_coefficient`` a_v [ppm/degC] by which the modulator's half-wave voltage grows.
    6.56 microradian are 1 deg/h.

    Source: Lefevre (literature) for size, 1e-7 to 1e-6 rad, a tenth of it with a better modulator; form
    for square-wave bias modulation derived.
    """

    id = "intensity_modulation"
    code = "C5"
    title = "Spurious intensity modulation"
    amplitude = Quantity("amplitude", "urad", (0.1, 1.0), (5e-3, 0.05), "m", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("modulation_depth", "deg", (90.0, 157.5), (90.0, 157.5), "phi_b at 25 degC", (1.0, 175.0)),
        Quantity("halfwave_coefficient", "ppm/degC", (300.0, 1000.0), (300.0, 1000.0), "a_v", (-5e3, 5e3)),
    )
    needs = ("T_electronics",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias, nearly linear in the electronics' temperature, that falls with the modulation depth"
    confused_with = {
        "electronic_crosstalk": "change the light's power: only cross-talk changes",
        "bias_polynomial": "a power step moves the electronics alone",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per microradian [deg/h], shape (n,)."""
        growth = 1.0 + 1e-6 * shape["halfwave_coefficient"] * inputs.u("T_electronics")
        phase = 1e-6 / np.tan(0.5 * np.radians(shape["modulation_depth"]) / growth)
        return np.asarray(phase / inputs.coil.phase_per_deg_h)
