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

        b = n c_T (l_1 (dT_electronics/dt - dT/dt) - l_2 (dT_case/dt - dT/dt)) / D,    c_T = dn/dT + n alpha

    0.52 deg/h per degC/min and metre for the reference coil; T is the coil's. A rate common to all fibre
    gives nothing, as the integral of 2 z - L vanishes: in a long ramp of the chamber there is none of it.
    The amplitude is l_1; ``length_ratio`` is l_2 / l_1.

    Source: Shupe's integral over the fibre's ends and what lies between (derived); ranges are engineering
    ones, a navigation gyro's leads lying together but for some centimetres.
    """

    id = "pigtail_shupe"
    code = "B6"
    family = "leads"
    place = "leads"
    title = "Shupe effect of the leads"
    amplitude = Quantity("amplitude", "m", (0.1, 1.0), (0.005, 0.1), "l_1", (-100.0, 100.0), signed=True)
    shape = (Quantity("length_ratio", "1", (0.3, 3.0), (0.3, 3.0), "l_2 / l_1", (-100.0, 100.0)),)
    needs = ("T_electronics", "T_case", "T")
    sources = ("D. M. Shupe, Applied Optics 19 (1980) 654",)
    shows = "fast answers to power-on and fans, and spikes at starts and ends of ramps; none along a ramp"
    confused_with = {
        "warmup_bias": "fans and ramps: a warm-up depends on the time since power-on alone",
        "shupe_pure": "a power step: the electronics move first",
        "shupe_mohr": "a long ramp: shupe_mohr has a plateau, this one none",
        "shupe_trim": "a sensor on the case: leads side by side feel the same",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per metre of l_1 [deg/h], shape (n,)."""
        coil = inputs.dT("T")
        first, second = inputs.dT("T_electronics") - coil, inputs.dT("T_case") - coil
        return lead_sensitivity(inputs.coil) * (first - shape["length_ratio"] * second)
