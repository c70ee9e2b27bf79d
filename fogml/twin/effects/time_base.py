"""Clock of the gyro over temperature."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_SPAN_DEGC = 50.0


class TimeBase(ScaleFactorEffect):
    """A crystal that runs slow off its turnover temperature, so that counts per second come out high.

    ::

        s = A ((T_electronics - turnover_temperature) / 50)**2

    A is the clock's error 50 degC away from the turnover [ppm].

    Source: parabola of a quartz cut (literature); 0.5 to 50 ppm over temperature is an engineering range.
    """

    id = "time_base"
    code = "D7"
    title = "Time base"
    amplitude = Quantity("amplitude", "ppm", (5.0, 50.0), (0.5, 5.0), "at 50 degC from turnover", (-1e4, 1e4))
    shape = (
        Quantity(
            "turnover_temperature", "degC", (20.0, 30.0), (20.0, 30.0), "of the crystal", (-100.0, 200.0)
        ),
    )
    needs = ("T_electronics",)
    sources = ("IEEE Std 952-1997", "J. R. Vig, Quartz Crystal Resonators and Oscillators")
    shows = "a scale factor error common to all sensors on the clock, for outputs in counts per second"
    confused_with = {
        "source_wavelength": "another sensor on the same clock; counts against a reference clock",
        "coil_expansion": "another sensor on the same clock",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [ppm], shape (n,)."""
        away = (inputs.temperature("T_electronics") - shape["turnover_temperature"]) / _SPAN_DEGC
        return np.square(away)
