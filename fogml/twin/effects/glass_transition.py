"""Glass transition of coating or adhesive."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_PER_DECADE = 3.0
_SLOWEST = 0.01


class GlassTransition(BiasEffect):
    """The adhesive of the winding hardens at T_g: rate sensitivity peaks there, the bias steps.

    ::

        b = A dT/dt / cosh((T - T_g) / w)**2  +  A r (1 + tanh((T - T_g) / w)) / 2
        T_g = transition_temperature + 3 log10(|dT/dt|)

    A in deg/h per degC/min, with ``width`` w and, as ``static_ratio`` r, the step over A in degC/min.
    The rate in T_g is in degC/min, 0.01 at least.

    Source: Cordova, US5546482 (read) for spikes and crossings of the bias; ranges are engineering ones:
    -60 to -20 degC for silicone and acrylate, 40 to 90 degC for epoxy.
    """

    id = "glass_transition"
    code = "B5"
    family = "transition"
    place = "coil"
    title = "Glass transition of coating or adhesive"
    amplitude = Quantity(
        "amplitude", "deg/h/(degC/min)", (0.1, 25.0), (5e-3, 1.5), "A", (-1e3, 1e3), signed=True
    )
    shape = (
        Quantity(
            "transition_temperature",
            "degC",
            (-60.0, 90.0),
            (-60.0, 90.0),
            "T_g at 1 degC/min",
            (-150.0, 200.0),
            default=-25.0,
        ),
        Quantity("width", "degC", (3.0, 10.0), (3.0, 10.0), "w", (0.1, 100.0)),
        Quantity("static_ratio", "degC/min", (0.0, 0.2), (0.0, 0.2), "r", (-100.0, 100.0)),
    )
    needs = ("T",)
    sources = ("A. Cordova et al., US5546482", "A. Cordova et al., US5847829")
    shows = "a peak and a step of the bias at one temperature in ramps; only the step in soaks"
    confused_with = {
        "polarization_nonreciprocity": "this one needs a moving temperature and has a single peak",
        "temperature_rate_product": "this one is localised in temperature",
        "shupe_mohr": "ramps over the whole range: the plateau of shupe_mohr has no peak",
        "bias_polynomial": "soaks: only a step is left of this one",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/(degC/min) [deg/h], shape (n,)."""
        rate = inputs.dT("T")
        transition = shape["transition_temperature"] + _PER_DECADE * np.log10(np.hypot(rate, _SLOWEST))
        risen = np.tanh((inputs.temperature("T") - transition) / shape["width"])
        return rate * (1.0 - risen * risen) + 0.5 * shape["static_ratio"] * (1.0 + risen)
