"""Shupe effect of a gradient along the coil's axis."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class AxialGradient(BiasEffect):
    """The coil's top, under the lid, and its bottom, on the plate, warm at different rates.

    ::

        b = S_ax d(T_top - T_bottom)/dt

    The axial form of Shupe's integral: a winding that is symmetric layer by layer is not turn by turn. S_ax
    in deg/h per degC/min. Top and bottom are nodes of the plant (`fogml.twin.plant.ends`), which the effect
    brings along where the twin states none: the bottom follows the plate, the top the lid. Zero in soaks and
    on the plateau of a long ramp, and zero where top and bottom are alike.

    Source: Shupe, Applied Optics 19 (1980) 654 (form derived for a gradient along the axis); 0.1 to 0.5 of
    S_g of shupe_pure (engineering).
    """

    id = "axial_gradient"
    code = "B13"
    title = "Shupe effect of an axial gradient"
    amplitude = Quantity(
        "amplitude", "deg/h/(degC/min)", (0.02, 1.0), (1e-3, 0.05), "S_ax", (-1e3, 1e3), signed=True
    )
    needs = ("T_top", "T_bottom")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "slow spikes at start and stop of a ramp, as long as the plate takes to follow the air"
    confused_with = {
        "shupe_pure": "sensors on top and bottom; a warm plate under a cold unit moves this one alone",
        "azimuthal_gradient": "turn the unit in the airflow: only azimuthal_gradient changes",
        "hidden_thermal_node": "a sensor on the plate; that one acts on the static bias",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/(degC/min) [deg/h], shape (n,)."""
        return inputs.dT("T_top") - inputs.dT("T_bottom")
