"""Dead zone about zero rate."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output


class Deadband(LoopEffect):
    """Small rates that the loop swallows, by cross-talk of its own modulation.

    ::

        out = w - A tanh(w / width)

    A = width = w_d is the usual soft dead zone: nothing comes out near zero, and the output is w_d short far
    from it. Other forms of the same: the hard one, out = kappa w within w_d with kappa 0 to 0.2, and
    that of Adler, out = sqrt(w**2 - w_d**2) beyond w_d.

    Source: Lefevre (literature); "Interferometric FOG dead band suppression" (read), whose suppressed
    designs show none at 0.001 deg/h; ranges are engineering ones.
    """

    id = "deadband"
    code = "D6"
    title = "Dead zone about zero rate"
    amplitude = Quantity("amplitude", "deg/h", (0.1, 5.0), (0.0, 0.05), "w_d", (0.0, 1e3))
    shape = (Quantity("width", "deg/h", (0.1, 5.0), (1e-3, 0.05), "width of the zone", (1e-6, 1e4)),)
    needs = ("output",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope", "Interferometric FOG dead band suppression")
    shows = "only where the rate is small: axis to east or west, in north seeking, under slow turns"
    confused_with = {
        "electronic_crosstalk": "a sweep of the rate through zero",
        "sf_asymmetry": "a ladder of rates of both signs, from hundredths of a deg/h up",
        "bias_polynomial": "a sweep of the rate through zero at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of w_d [deg/h], shape (n,), between -1 and 1."""
        return -np.tanh(met_output(inputs) / shape["width"])
