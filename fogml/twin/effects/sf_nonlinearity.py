"""Scale factor over the size of the rate."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.signals.waves import sine
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

FULL_SCALE_DEG_S = 100.0
"""Rate at which the amplitude holds."""


class SfNonlinearity(ScaleFactorEffect):
    """A scale factor error that depends on the size of the rate.

    ::

        s = c ((1 - q) x + q x**2 + r sin(2 pi |Omega| / Omega_q)),      x = |Omega| / (100 deg/s)

    The amplitude is c, the error at 100 deg/s; ``quadratic_share`` q, ``ripple_share`` r and
    ``ripple_period`` Omega_q give its course. The ripple is that of resets and their aliases.

    Source: Lefevre (literature); ranges are engineering ones.
    """

    id = "sf_nonlinearity"
    code = "D5"
    family = "odd_in_rate"
    place = "electronics"
    title = "Non-linearity of the scale factor"
    amplitude = Quantity("amplitude", "ppm", (50.0, 500.0), (1.0, 20.0), "c", (-1e5, 1e5), signed=True)
    shape = (
        Quantity("quadratic_share", "1", (0.0, 1.0), (0.0, 1.0), "q", (-10.0, 10.0)),
        Quantity("ripple_share", "1", (0.0, 0.2), (0.0, 0.2), "r", (-10.0, 10.0), default=0.0),
        Quantity("ripple_period", "deg/s", (5.0, 50.0), (5.0, 50.0), "Omega_q", (1e-3, 1e4)),
    )
    needs = ("rate", "earth")
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope", "IEEE Std 952-1997")
    shows = "a ladder of table rates of both signs"
    confused_with = {
        "sf_asymmetry": "rates of both signs: this one is the same for both",
        "table_rate_error": "another table, or a count of whole turns",
        "deadband": "it shows near zero rate, this one far from it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [ppm], shape (n,)."""
        rate = np.abs(inputs.input_rate_deg_h) / 3600.0
        x = rate / FULL_SCALE_DEG_S
        q = shape["quadratic_share"]
        ripple = sine(rate / shape["ripple_period"])
        return x * (1.0 - q + q * x) + shape["ripple_share"] * ripple
