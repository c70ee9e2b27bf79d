"""Clock of the gyro over temperature."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_SPAN_DEGC = 50.0


class TimeBase(ScaleFactorEffect):
    """A crystal whose frequency goes with temperature: where it runs slow, counts per second come out high.

    ::

        s = A ((1 - q) (r x - x**3) + q x**2),      x = (T_electronics - turnover_temperature) / 50

    An AT cut, the usual one, is a cubic about its inflection: A = 13 ppm, from 1.05e-4 ppm/degC3 at 50 degC,
    with ``linear_share`` r by the angle of the cut, fast and slow at turnovers 50 sqrt(r / 3) degC either
    side. The parabola of a tuning fork, -0.034 ppm/degC2, has ``parabolic_share`` q = 1 and A = 85 ppm.
    Smaller A are those of a compensated oscillator.

    Source: Bechmann, Proceedings of the IRE 44 (1956) 1600, for the AT cut; Vig (literature) for both; ranges
    are engineering ones.
    """

    id = "time_base"
    code = "D7"
    title = "Time base"
    amplitude = Quantity("amplitude", "ppm", (5.0, 50.0), (0.5, 5.0), "of the clock 50 degC off", (-1e4, 1e4))
    shape = (
        Quantity("turnover_temperature", "degC", (20.0, 30.0), (20.0, 30.0), "inflection", (-100.0, 200.0)),
        Quantity("linear_share", "1", (0.0, 1.0), (0.0, 1.0), "r, by the angle of the cut", (-10.0, 10.0)),
        Quantity("parabolic_share", "1", (0.0, 1.0), (0.0, 1.0), "q", (0.0, 1.0), default=0.0),
    )
    needs = ("T_electronics",)
    sources = (
        "R. Bechmann, Proceedings of the IRE 44 (1956) 1600",
        "J. R. Vig, Quartz Crystal Resonators and Oscillators",
    )
    shows = "a scale factor error common to all sensors on the clock, for outputs in counts per second"
    confused_with = {
        "source_wavelength": "another sensor on the same clock; counts against a reference clock",
        "coil_expansion": "another sensor on the same clock",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [ppm], shape (n,)."""
        x = (inputs.temperature("T_electronics") - shape["turnover_temperature"]) / _SPAN_DEGC
        q, square = shape["parabolic_share"], np.square(x)
        return np.asarray((1.0 - q) * x * (shape["linear_share"] - square) + q * square)
