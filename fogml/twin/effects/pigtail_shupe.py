"""Shupe effect of the leads."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.coil import lead_sensitivity
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class PigtailShupe(BiasEffect):
    """Leads of unequal length or place: one near the electronics, the other near the case.

    ::

        b = n c_T (l_1 dT_electronics/dt - l_2 dT_case/dt) / D,      c_T = dn/dT + n alpha

    0.52 deg/h per degC/min and metre for the reference coil. The amplitude is l_1; ``length_ratio``
    is l_2 / l_1.

    Source: Shupe's integral at the fibre's ends (derived); ranges are engineering ones.
    """

    id = "pigtail_shupe"
    code = "B6"
    title = "Shupe effect of the leads"
    amplitude = Quantity("amplitude", "m", (0.1, 1.0), (0.1, 1.0), "l_1", (-100.0, 100.0), signed=True)
    shape = (Quantity("length_ratio", "1", (0.3, 3.0), (0.3, 3.0), "l_2 / l_1", (-100.0, 100.0)),)
    needs = ("T_electronics", "T_case")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "a fast answer, in seconds to minutes, to power-on and fans that follows the electronics' rate"
    confused_with = {
        "warmup_bias": "fans and ramps: a warm-up depends on the time since power-on alone",
        "shupe_pure": "a power step: the electronics move first",
        "shupe_mohr": "a power step: the electronics move first",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per metre of l_1 [deg/h], shape (n,)."""
        rate = inputs.dT("T_electronics") - shape["length_ratio"] * inputs.dT("T_case")
        return lead_sensitivity() * rate
