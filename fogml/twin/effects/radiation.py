"""Ionising radiation."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class Radiation(ScaleFactorEffect):
    """Absorption that radiation induces in the fibre shifts the mean wavelength.

    ::

        eps = c D**f (dD/dt)**g

    eps in ppm of the scale factor, D the absorbed dose [Gy] and dD/dt its rate [Gy/h]; c in ppm at
    1 Gy and 1 Gy/h, ``dose_exponent`` f and ``rate_exponent`` g. The light that is lost besides raises
    the angle random walk. Nothing without the drive ``dose``.

    Source: Jin et al., Science China Technological Sciences 53 (2010) 3056 (read): power law of the
    induced absorption; ranges are engineering ones.
    """

    id = "radiation"
    code = "C11"
    title = "Ionising radiation"
    amplitude = Quantity("amplitude", "ppm", (1.0, 30.0), (0.1, 3.0), "c", (-1e5, 1e5), signed=True)
    shape = (
        Quantity("dose_exponent", "1", (0.5, 1.0), (0.5, 1.0), "f", (0.01, 2.0)),
        Quantity("rate_exponent", "1", (0.05, 0.3), (0.05, 0.3), "g", (1e-3, 2.0)),
    )
    needs = ("dose",)
    sources = ("J. Jin et al., Science China Technological Sciences 53 (2010) 3056",)
    shows = "a scale factor error that grows with the dose; absent in a chamber test"
    confused_with = {
        "source_wavelength": "temperature: this one follows the dose alone",
        "ageing": "the table's rate: this one is an error of the scale factor",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [ppm], shape (n,)."""
        dose = np.maximum(inputs.drive("dose"), 0.0)
        per_hour = 60.0 * np.maximum(inputs.rate_per_minute(self.id, dose), 0.0)
        return dose ** shape["dose_exponent"] * per_hour ** shape["rate_exponent"]
