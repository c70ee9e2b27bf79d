"""Elasto-optic part of the Shupe effect."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ShupeMohr(BiasEffect):
    """Strain of the warming winding: a bias in proportion to the rate of temperature alone.

    ::

        b = S_m0 (1 + s1 u + s2 u**2) dT/dt,      u = T - 25

    S_m0 in deg/h per degC/min; ``linear_coefficient`` is s1 and ``quadratic_coefficient`` s2. T
    stands for the coil's mean. With s1 = s2 = 0 it is the nominal gyro's own term in DeltaT.

    Source: Mohr and Schadt, SPIE 5502 (2004) 410; Li et al., Chinese Optics Letters 13 (2015) 090603
    (literature); ranges are engineering ones.
    """

    id = "shupe_mohr"
    code = "B3"
    family = "rate"
    place = "coil"
    title = "Elasto-optic Shupe effect (Mohr effect)"
    amplitude = Quantity(
        "amplitude", "deg/h/(degC/min)", (0.2, 5.0), (0.01, 0.3), "S_m0", (-1e3, 1e3), signed=True
    )
    shape = (
        Quantity("linear_coefficient", "1/degC", (-0.02, 0.02), (-0.02, 0.02), "s1", (-1.0, 1.0)),
        Quantity("quadratic_coefficient", "1/degC2", (-2e-4, 2e-4), (-2e-4, 2e-4), "s2", (-0.1, 0.1)),
    )
    needs = ("T",)
    sources = (
        "F. Mohr and F. Schadt, SPIE 5502 (2004) 410; IEEE SIBIRCON (2008)",
        "Z. Li et al., Chinese Optics Letters 13 (2015) 090603",
    )
    shows = "a plateau during the whole of each ramp, proportional to the rate"
    confused_with = {
        "shupe_trim": "not from the output alone; trim the fibre ends, or find a slope over temperature",
        "shupe_pure": "long ramps with sharp start and stop: shupe_pure spikes, this one has a plateau",
        "sensor_lag": "a lag acts by the slope of the static bias, which changes sign at its extremum",
        "logger_skew": "as for a lag; and edges of the table rate show the clock's error",
        "temperature_rate_product": "ramps at cold and at hot: only the product's plateau changes",
        "bias_polynomial": "more than one ramp: in one, temperature, time and rate go together",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/(degC/min) [deg/h], shape (n,)."""
        u = inputs.u("T")
        growth = 1.0 + u * (shape["linear_coefficient"] + shape["quadratic_coefficient"] * u)
        return growth * inputs.dT("T")
