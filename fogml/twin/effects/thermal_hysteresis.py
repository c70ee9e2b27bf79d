"""Thermal hysteresis of the static bias."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ThermalHysteresis(BiasEffect):
    """Rate-independent memory of the bias: the branches up and down differ at equal temperature.

    ::

        b = A (s - T) / w,      s = min(max(s, T - w), T + w)

    with half width w [degC], a play operator. The amplitude is A = k_h w [deg/h], which is half of
    the opening of a full loop.

    Source: play operator of hysteresis (literature); ranges, from a loop opening of 0.05 to 1 deg/h
    (tactical) and 0.002 to 0.05 deg/h (navigation) over 100 degC, are engineering ones.
    """

    id = "thermal_hysteresis"
    code = "B8"
    family = "loops"
    place = "coil"
    title = "Thermal hysteresis of the bias"
    amplitude = Quantity(
        "amplitude", "deg/h", (0.025, 0.5), (0.001, 0.025), "k_h times half_width", (-1e3, 1e3), signed=True
    )
    shape = (
        Quantity("half_width", "degC", (3.0, 20.0), (3.0, 20.0), "half width of the loop", (0.01, 200.0)),
    )
    needs = ("T",)
    sources = ("A. Visintin, Differential Models of Hysteresis (1994): play operator",)
    shows = "soaks at equal temperature differ after warming and after cooling; minor loops close"
    confused_with = {
        "sensor_lag": "two ramp rates: the loop of a lag opens with the rate, this one does not",
        "stress_relaxation": "a soak of 4 to 6 h: relaxation decays, hysteresis stays",
        "hidden_thermal_node": "a soak of several time constants: the node comes to rest",
        "bias_polynomial": "both branches: a polynomial is one curve",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of k_h w [deg/h], shape (n,), between -1 and 1."""
        temperature = inputs.temperature("T")
        half_width = shape["half_width"]
        return (inputs.memory.play(self.id, temperature, half_width) - temperature) / half_width
