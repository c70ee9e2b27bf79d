"""Clock of the logger."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoggerEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output, slope_per_s

_HOUR_S = 3600.0


class LoggerSkew(LoggerEffect):
    """The gyro's samples carry the time of other sensors' samples d later.

    ::

        y_recorded(t) = y(t - d),      d = A (1 + growth * hours since the first sample)

    A clock that is 100 ppm off gains 0.36 s an hour; the product A ``growth`` is that. To first order the
    record lacks d dy/dt: edges of the table rate, and b'(T) dT/dt d of a static bias b(T).

    Source: derived; skews of 0.1 to 60 s are an engineering range.
    """

    id = "logger_skew"
    code = "G10"
    family = "clock_skew"
    place = "logger"
    title = "Skew of the logger's clock"
    amplitude = Quantity("amplitude", "s", (0.1, 60.0), (0.1, 60.0), "A", (-1e5, 1e5), signed=True)
    shape = (Quantity("growth", "1/h", (0.0, 0.5), (0.0, 0.5), "of the skew", (-10.0, 10.0), default=0.0),)
    needs = ("output",)
    sources = ("First-order expansion of a delay",)
    shows = "edges of the table rate; during ramps in proportion to the slope of the static output"
    shown_on = "turns of half a minute"
    confused_with = {
        "sensor_lag": "edges of the table rate show the clock; a power step shows the lag",
        "averaging": "the shape of an edge: averaging makes a ramp of it, a skew shifts it",
        "loop_gain": "a skew also shifts temperature against the gyro",
        "shupe_mohr": "edges of the table rate",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per second [deg/h], shape (n,)."""
        growing = self._growing(inputs, shape["growth"])
        return -growing * slope_per_s(inputs, self.id, met_output(inputs))

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], linear between samples, shape (n,).

        What lies before the first sample is taken for the first one; what lies after the last one of
        these samples, where d is negative, for the last one.
        """
        delay = amplitude * self._growing(inputs, shape["growth"])
        span = 2.0 * float(np.abs(delay).max(initial=0.0))
        time, held = inputs.memory.recent(f"{self.id} output", inputs.time, output, span)
        if amplitude == 0.0:
            return output
        return np.interp(inputs.time - delay, time, held)

    def _growing(self, inputs: Inputs, growth: float) -> FloatArray:
        first = inputs.memory.first(f"{self.id} first", inputs.time)
        return 1.0 + growth / _HOUR_S * (inputs.time - first)
