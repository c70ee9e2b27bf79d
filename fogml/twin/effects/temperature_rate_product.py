"""Rate sensitivity that changes with temperature."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class TemperatureRateProduct(BiasEffect):
    """First-order change with temperature of the sensitivity to its rate.

    ::

        b = S_x (T - 25) dT/dt

    S_x in deg/h per degC and degC/min: the slope of elasto-optic strain, of dn/dT and of n.

    Source: first-order expansion of the Mohr effect (derived), the product that RBF networks take as
    an input; ranges, S_x / S_m0 of 0.001 to 0.02 per degC, are engineering ones.
    """

    id = "temperature_rate_product"
    code = "B4"
    family = "rate_product"
    place = "coil"
    title = "Temperature times its rate"
    amplitude = Quantity(
        "amplitude", "deg/h/degC/(degC/min)", (2e-4, 0.1), (1e-5, 6e-3), "S_x", (-1e3, 1e3), signed=True
    )
    needs = ("T",)
    sources = ("Expansion of F. Mohr and F. Schadt, SPIE 5502 (2004) 410",)
    shows = "plateaus in ramps that differ between cold and hot at the same rate"
    confused_with = {
        "shupe_mohr": "ramps at cold and at hot: only the product's plateau changes",
        "glass_transition": "that one is localised in temperature",
        "sensor_lag": "a power step; with a curved static bias a lag makes the same product",
        "logger_skew": "edges of the table rate; with a curved static bias a skew makes the same product",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/degC/(degC/min) [deg/h], shape (n,)."""
        return inputs.u("T") * inputs.dT("T")
