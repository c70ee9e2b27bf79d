"""Stray light in the unit: an effect that another package adds to the catalogue."""

from __future__ import annotations

from fogml.arrays import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class StrayLight(BiasEffect):
    """Light that reaches the diode beside the fibre, as it follows a slow node of the electronics.

    ::

        b = A (T_s - 25),      dT_s/dt = (T_electronics - T_s) / tau

    Source: an example (engineering).
    """

    id = "stray_light"
    code = "X1"
    title = "Stray light"
    amplitude = Quantity("amplitude", "deg/h/degC", (1e-3, 1e-2), (1e-5, 1e-3), "A", signed=True)
    shape = (Quantity("time_constant", "s", (60.0, 600.0), (60.0, 600.0), "tau", (1.0, 1e6)),)
    needs = ("T_electronics",)
    sources = ("Example",)
    shows = "a bias that follows the electronics late"
    confused_with = {"electronic_crosstalk": "cover the diode"}

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/degC [deg/h], shape (n,)."""
        u = inputs.u("T_electronics")
        return inputs.memory.lag(self.id, inputs.time, u, shape["time_constant"])
