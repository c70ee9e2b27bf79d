"""Light over temperature, and what goes with it."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class LightPower(BiasEffect):
    """Light that falls off room temperature: noise, gain and cross-talk go with it together.

    ::

        b = e_0 (P_0 / P - 1),      P / P_0 = 10**(power_slope u / 1000 - power_loss |u| / 10)

    u = T_electronics - 25. The demodulated signal is in proportion to the light P, what leaks into it is not:
    the constant cross-talk e_0, the amplitude, weighs the more the less light there is. While this effect is
    on, P is the light of ``arw_physics``, ``loop_gain``, ``electronic_crosstalk`` and ``kerr`` too, in place
    of what each states of its own: noise grows, the loop slows down and cross-talk grows at the same
    temperatures. ``power_loss`` is that of coupling off 25 degC, ``power_slope`` that of source and fibre. A
    noise that the twin states as a number N knows no light; state ``arw_physics`` in its place.

    Source: demodulated signal R P sin(phi_m) against an offset (derived); losses of 0.02 to 0.05 dB/degC and
    0.5 to 3 dB over temperature are engineering ranges.
    """

    id = "light_power"
    code = "C14"
    title = "Light over temperature"
    amplitude = Quantity("amplitude", "deg/h", (0.05, 1.0), (1e-3, 1e-2), "e_0", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("power_loss", "dB/degC", (0.02, 0.05), (0.02, 0.05), "off 25 degC", (0.0, 1.0)),
        Quantity("power_slope", "dB/(100 degC)", (-3.0, -0.5), (-3.0, -0.5), "of the light", (-100.0, 100.0)),
    )
    needs = ("T_electronics",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "noise, edges of the rate and a bias, all of which are worst at the same temperatures"
    confused_with = {
        "electronic_crosstalk": "the noise: it grows with this one and not with that",
        "bias_polynomial": "the noise, or another light power at constant temperature",
        "arw_physics": "not apart in the noise: this one says how its light goes",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of e_0 [deg/h], shape (n,)."""
        return 1.0 / inputs.light.level(inputs.u("T_electronics"), **shape) - 1.0
