"""Shupe effect of a gradient across the coil's diameter."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class AzimuthalGradient(BiasEffect):
    """Air that blows from one side warms one side of the coil first.

    ::

        b = S_az cos(psi - psi_0) d(T_out - T_in)/dt

    psi is the table's angle, psi_0 the shape's ``phase``; the cosine is its mean over the sample. The
    gradient from face to face stands for the horizontal one, which the same heat flow drives. S_az in
    deg/h per degC/min.

    Source: Shupe's integral for a side-on gradient (derived); range 0.1 to 0.3 of S_g of shupe_pure
    (engineering).
    """

    id = "azimuthal_gradient"
    code = "B7"
    place = "coil"
    title = "Shupe effect of a side-on gradient"
    amplitude = Quantity(
        "amplitude", "deg/h/(degC/min)", (0.01, 0.6), (4e-4, 0.03), "S_az", (-1e3, 1e3), signed=True
    )
    shape = (
        Quantity(
            "phase", "deg", (0.0, 360.0), (0.0, 360.0), "angle of the airflow", (-720.0, 720.0), default=0.0
        ),
    )
    needs = ("T_in", "T_out", "angle")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "spikes at the ends of ramps whose size and sign change as the unit is turned in the airflow"
    confused_with = {
        "shupe_pure": "turn the unit in the airflow: shupe_pure does not change",
        "magnetic": "in soaks only the magnetic part goes on",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/(degC/min) [deg/h], shape (n,)."""
        return inputs.table_cosine(-shape["phase"]) * (inputs.dT("T_out") - inputs.dT("T_in"))
