"""Error of the table's rate."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class TableRateError(RigEffect):
    """The table turns unevenly: its true rate is not the recorded one.

    ::

        w = 1e-6 A rate cos(harmonic angle + phase)

    A [ppm] is 1 to 100 over whole turns and up to 1e4 within a degree; ``harmonic`` is 1 for the
    encoder's eccentricity, or the number of the motor's poles. A constant part is one with the
    nominal scale factor.

    Source: rate table practice; ranges are engineering ones.
    """

    id = "table_rate_error"
    code = "G5"
    place = "table"
    title = "Error of the table's rate"
    amplitude = Quantity("amplitude", "ppm", (1.0, 100.0), (1.0, 100.0), "A", (0.0, 1e5))
    shape = (
        Quantity("harmonic", "1", (1.0, 36.0), (1.0, 36.0), "periods a turn", (0.01, 1e4), default=1.0),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at angle 0", (-720.0, 720.0), default=0.0),
    )
    needs = ("rate", "angle")
    sources = ("IEEE Std 952-1997",)
    shows = "an error in proportion to the rate, periodic over the table's angle"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "sf_nonlinearity": "another table, or the time of whole turns",
        "logger_skew": "between the edges of the rate: a skew shows at edges alone",
        "sf_asymmetry": "the time of whole turns of both signs",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [deg/h], shape (n,)."""
        uneven = inputs.table_cosine(shape["phase"], shape["harmonic"])
        return 3600e-6 * inputs.table_rate * uneven
