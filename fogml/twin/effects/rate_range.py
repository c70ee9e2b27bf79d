"""The range of rates that the read-out can hold."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ReadoutEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output


class RateRange(ReadoutEffect):
    """Beyond its range the output stays where it is: feedback or register are at their end.

    ::

        out = w                                                     |w| <= range
        out = sign(w) (range + (1 - A) (|w| - range))               beyond

    ``range`` in deg/s. A is the share of what is beyond that is lost: 1 where the output is held at its end,
    as usual, less where it only flattens. A loop that counts no fringes can't have more than half of one,
    lambda c / (2 L D) = 133 deg/s for the reference coil.

    Source: half a fringe derived, Lefevre (literature); ranges are engineering ones.
    """

    id = "rate_range"
    code = "D11"
    title = "Range and saturation"
    amplitude = Quantity("amplitude", "1", (0.9, 1.0), (0.9, 1.0), "A, lost beyond", (0.0, 1.0), default=1.0)
    shape = (Quantity("range", "deg/s", (100.0, 500.0), (100.0, 500.0), "largest rate", (1e-3, 1e5)),)
    needs = ("output",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope", "IEEE Std 952-1997")
    shows = "fast turns: the output no longer follows the table, of either sign alike"
    shown_on = "turns at 400 deg/s"
    confused_with = {
        "sf_nonlinearity": "a ladder of rates: nothing below the range, all of it above",
        "slew_limit": "a slow approach to the rate: a slew limit then shows nothing",
        "fringe_jump": "back at rest: a jump stays, saturation is gone",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per share lost [deg/h], shape (n,)."""
        output = met_output(inputs)
        beyond = np.maximum(np.abs(output) - 3600.0 * shape["range"], 0.0)
        return -np.copysign(beyond, output)
