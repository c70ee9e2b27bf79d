"""Ripple and overshoot of the chamber."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import line

_FAST_SHARE = 0.25
# Peak of exp(-t) - exp(-4 t).
_PEAK = 0.75 * 4.0 ** (-1.0 / 3.0)


class ChamberRipple(ThermalEffect):
    """Air that swings about its set point, and overshoots it at the end of a ramp.

    ::

        T_air = T_set + a (sin(2 pi t / period + phase) + overshoot * o(t))
        o = (lag(dT_set/dt, period) - lag(dT_set/dt, period / 4)) / 0.472

    o rises to 1 per degC/min of a ramp that ends, and fades with the period. a is 0.1 to 1 degC, overshoots
    are 1 to 5 degC. Sensors on the unit show it as far as it reaches them.

    Source: two-term control of a chamber; form and ranges are engineering ones.
    """

    id = "chamber_ripple"
    code = "A3"
    title = "Ripple of the chamber"
    amplitude = Quantity("amplitude", "degC", (0.1, 1.0), (0.1, 1.0), "a", (0.0, 20.0))
    shape = (
        Quantity("period", "s", (60.0, 600.0), (60.0, 600.0), "of the chamber's control", (1.0, 1e5)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at time 0", (-720.0, 720.0), default=0.0),
        Quantity("overshoot", "1/(degC/min)", (1.0, 20.0), (1.0, 20.0), "in units of a", (0.0, 1e3)),
    )
    sources = ("Data sheets of climatic chambers",)
    shows = "a narrow line at the chamber's period through rates of temperature, not in slow sensors"
    confused_with = {
        "chamber_pickup": "its delay: pick-up has none",
        "polarization_nonreciprocity": "this one is periodic in time, that one in temperature",
        "sinusoidal": "a sensor in the air: coherent with this one",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC [deg/h], shape (n,): zeros."""
        return np.zeros(len(inputs))

    def change_chamber(
        self, chamber: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """Chamber air [degC] with the effect, shape (n,)."""
        memory, time, period = inputs.memory, inputs.time, shape["period"]
        rate = memory.rate(f"{self.id} rate", time, chamber, 0.0)
        slow = memory.lag(f"{self.id} slow", time, rate, period)
        fast = memory.lag(f"{self.id} fast", time, rate, _FAST_SHARE * period)
        swing = line(inputs, period, shape["phase"])
        return chamber + amplitude * (swing + shape["overshoot"] / _PEAK * (slow - fast))
