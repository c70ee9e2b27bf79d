"""Scale factors of the two directions."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_TURN_OVER_DEG_H = 1.0


class SfAsymmetry(ScaleFactorEffect):
    """Scale factors of the two directions differ.

    ::

        s = k_a sign(Omega)

    so that K_plus - K_minus is 2 k_a of their mean, and the output gains k_a |Omega|, which looks like a
    bias that grows with the rate. Within about 1 deg/h of zero the sign goes over smoothly, as
    tanh(Omega / (1 deg/h)).

    Source: IEEE Std 952 (literature); ranges are engineering ones.
    """

    id = "sf_asymmetry"
    code = "D5"
    family = "even_in_rate"
    place = "electronics"
    title = "Asymmetry of the scale factor"
    amplitude = Quantity("amplitude", "ppm", (10.0, 200.0), (0.5, 10.0), "k_a", (-1e5, 1e5), signed=True)
    needs = ("rate", "earth")
    sources = ("IEEE Std 952-1997", "H. C. Lefevre, The Fiber-Optic Gyroscope")
    shows = "turns of both signs: their sum does not vanish and grows with the rate"
    confused_with = {
        "sf_nonlinearity": "rates of both signs: this one changes sign",
        "deadband": "a ladder of rates of both signs down to a few deg/h",
        "cable_and_slip_ring": "two rates: this one grows with the rate",
        "vibration_rectification": "a vibration sensor on the turning table",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [ppm], shape (n,)."""
        return np.tanh(inputs.input_rate_deg_h / _TURN_OVER_DEG_H)
