"""Wrong unit or sign of a column."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoggerEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output


class UnitsAndGaps(LoggerEffect):
    """The gyro's column in another unit or of the other sense than it says.

    ::

        y_recorded = (1 + A) y

    A = -2 for a clockwise axis, 1/3600 - 1 for deg/s taken for deg/h. Gaps and repeated rows, the other
    damage of this kind, leave no trace in the rows that remain; reading a run reports them.

    Source: derived.
    """

    id = "units_and_gaps"
    code = "G12"
    title = "Wrong unit or sign"
    amplitude = Quantity(
        "amplitude", "1", (0.99, 2.0), (0.99, 2.0), "A", (-1e5, 1e5), signed=True, default=-2.0
    )
    needs = ("output",)
    sources = ("Logger files",)
    shows = "everywhere, in proportion to the output"
    shown_on = "turns of half a minute"
    confused_with = {
        "sf_asymmetry": "its size: scale factors are not off by a half",
        "fringe_jump": "the table at rest: a jump stays there",
        "coil_expansion": "its size",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per 1 [deg/h], shape (n,)."""
        return 1.0 * met_output(inputs)

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], shape (n,)."""
        return (1.0 + amplitude) * output
