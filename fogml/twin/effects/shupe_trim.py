"""Mid-point error of the coil."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.coil import midpoint_sensitivity
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ShupeTrim(BiasEffect):
    """Fibre ends of unequal length: the coil's middle is off by delta.

    ::

        b = 2 n c_T delta (dT_coil/dt - dT_leads/dt) / D,      c_T = dn/dT + n alpha

    1.05 deg/h per degC/min and metre for the reference coil (D = 0.1 m). A rate common to coil and
    leads gives nothing. The leads lie between electronics and case and have the mean of both; in a chamber
    they ramp as the coil does, so that starts and ends of ramps show it. T stands for the coil's mean.

    Source: Senol et al., Scientific Reports (2024), arXiv 2311.16908 and Honeywell CA2137463C (read)
    for trimming; the coefficient is derived; ranges are engineering ones.
    """

    id = "shupe_trim"
    code = "B2"
    title = "Mid-point error of the coil"
    amplitude = Quantity("amplitude", "m", (0.1, 2.0), (0.005, 0.1), "delta", (-1e3, 1e3), signed=True)
    needs = ("T", "T_leads")
    sources = ("M. Senol et al., Scientific Reports (2024), arXiv 2311.16908", "Honeywell, CA2137463C")
    shows = "at starts and ends of ramps, while coil and leads warm at different rates, and after power-on"
    confused_with = {
        "shupe_mohr": "long ramps: shupe_mohr has a plateau, this one only their starts and ends",
        "shupe_pure": "a power step: it warms the leads before any gradient across the coil",
        "sensor_lag": "a lag acts by the slope of the static bias, which changes sign at its extremum",
        "logger_skew": "edges of the table rate show the clock's error with no temperature in it",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per metre [deg/h], shape (n,)."""
        return midpoint_sensitivity(inputs.coil) * (inputs.dT("T") - inputs.dT("T_leads"))
