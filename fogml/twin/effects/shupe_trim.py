"""Mid-point error of the coil."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.coil import midpoint_sensitivity
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_LEADS = "T_leads"


class ShupeTrim(BiasEffect):
    """Fibre ends of unequal length: the coil's middle is off by delta.

    ::

        b = 2 n c_T delta (dT_coil/dt - dT_leads/dt) / D,      c_T = dn/dT + n alpha

    1.05 deg/h per degC/min and metre for the reference coil (D = 0.1 m). A rate common to coil and
    leads gives nothing; leads without a node ``T_leads`` of their own are taken to lie where the
    temperature stays. T stands for the coil's mean.

    Source: Senol et al., Scientific Reports (2024), arXiv 2311.16908 and Honeywell CA2137463C (read)
    for trimming; the coefficient is derived; ranges are engineering ones.
    """

    id = "shupe_trim"
    code = "B2"
    title = "Mid-point error of the coil"
    amplitude = Quantity("amplitude", "m", (0.1, 2.0), (0.005, 0.1), "delta", (-1e3, 1e3), signed=True)
    needs = ("T", _LEADS)
    sources = ("M. Senol et al., Scientific Reports (2024), arXiv 2311.16908", "Honeywell, CA2137463C")
    shows = "a plateau in each ramp, proportional to the rate, that changes sign with it"
    confused_with = {
        "shupe_mohr": "not from the output alone; trim the fibre ends, or find a slope over temperature",
        "shupe_pure": "long ramps with sharp start and stop: shupe_pure spikes, this one has a plateau",
        "sensor_lag": "a lag acts by the slope of the static bias, which changes sign at its extremum",
        "logger_skew": "edges of the table rate show the clock's error with no temperature in it",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per metre [deg/h], shape (n,)."""
        rate = inputs.dT("T")
        if inputs.place(_LEADS) is not None:
            rate = rate - inputs.dT(_LEADS)
        return midpoint_sensitivity() * rate
