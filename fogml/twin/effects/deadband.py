"""Dead zone about zero rate."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output


class Deadband(LoopEffect):
    """Small rates that the loop swallows, locked in by cross-talk of its own modulation.

    ::

        out = sign(w) sqrt(max(w**2 - w_d**2, 0))

    The mean rate of an oscillator that is pulled by w and locked within w_d: nothing comes out within the
    zone, and beyond it the error fades as w_d**2 / (2 w). Only rates near zero show it; with the axis
    up and Earth rate well above w_d there is nearly nothing. The amplitude w_d is all that it has. It is
    0.01 to 1 deg/h; a closed loop with dither comes down to 1e-3 deg/h, several deg/h are those of an old
    design without. The dead zone of IEEE Std 952 is 2 w_d wide, and the threshold, where half of the rate
    shows, is 2 w_d / sqrt(3): `fogml lab rate` reads both.

    Source: Adler, Proceedings of the IRE 34 (1946) 351, for the locked oscillator (literature; mean beat
    rate derived); "Interferometric FOG dead band suppression" (read), whose suppressed designs show none at
    0.001 deg/h; ranges are engineering ones.
    """

    id = "deadband"
    code = "D6"
    place = "electronics"
    title = "Dead zone about zero rate"
    amplitude = Quantity("amplitude", "deg/h", (0.01, 1.0), (1e-3, 0.05), "w_d", (0.0, 1e3))
    amplitudes = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
    needs = ("output",)
    sources = (
        "R. Adler, Proceedings of the IRE 34 (1946) 351",
        "H. C. Lefevre, The Fiber-Optic Gyroscope",
        "Interferometric FOG dead band suppression",
    )
    shows = "only where the rate is small: axis to east or west, in north seeking, under slow turns"
    shown_on = "four-positions"
    confused_with = {
        "electronic_crosstalk": "a sweep of the rate through zero",
        "sf_asymmetry": "a ladder of rates of both signs, from hundredths of a deg/h up",
        "bias_polynomial": "a sweep of the rate through zero at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of w_d about its usual size [deg/h], shape (n,), between -1 and 1."""
        usual, met = self.amplitude.typical(), met_output(inputs)
        return (self.apply(met, inputs, usual) - met) / usual

    def apply(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The loop's output [deg/h] for an undistorted `output` [deg/h], both of shape (n,)."""
        size = np.abs(output)
        # As a product, a small zone costs no digits of a large rate.
        beyond = np.maximum(size - amplitude, 0.0) * (size + amplitude)
        return np.copysign(np.sqrt(beyond), output) if amplitude != 0.0 else output
