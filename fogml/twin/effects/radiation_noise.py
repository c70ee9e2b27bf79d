"""Noise of the light that ionising radiation takes."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import WhiteNoiseEffect
from fogml.twin.effects.radiation import Radiation, effective_dose
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class RadiationNoise(WhiteNoiseEffect):
    """White noise that is left to find where radiation darkened the fibre.

    ::

        N = A sqrt(10**(loss D_e**f / 10) - 1)

    with D_e and its parameters as in ``radiation``, and ``loss`` the induced absorption of the coil at 1 Gy
    [dB]. Shot noise has a variance inverse to the light; A is that of the unit's angle random walk which is
    shot noise, so that the two together have the noise of the light that is left.

    Source: shot noise (derived); absorption as in ``radiation``; ranges are engineering ones.
    """

    id = "radiation_noise"
    code = "E10"
    title = "Noise under ionising radiation"
    amplitude = Quantity("amplitude", "deg/sqrt(h)", (2e-3, 5e-2), (1e-4, 2e-3), "A", (0.0, 1e6))
    shape = (
        Quantity("loss", "dB", (1e-3, 0.05), (1e-3, 0.05), "at 1 Gy", (0.0, 10.0)),
        *Radiation.shape,
    )
    needs = ("dose",)
    sources = ("J. Jin et al., Science China Technological Sciences 53 (2010) 3056",)
    shows = "white noise that grows with the dose and comes back in part over hours"
    shown_on = "irradiation for two hours, turning at 10 deg/s"
    confused_with = {
        "angle_random_walk": "before the dose there is that one alone",
        "arw_physics": "temperature: this one follows the dose alone",
    }
    candidate = False

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Noise over that of the light before, shape (n,)."""
        lost = shape["loss"] * effective_dose(inputs, self.id, shape) ** shape["dose_exponent"]
        return np.sqrt(np.expm1(0.1 * np.log(10.0) * lost))
