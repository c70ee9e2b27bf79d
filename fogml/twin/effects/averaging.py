"""Averaging by the logger."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoggerEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output, slope_per_s

_SLACK = 1e-9
"""Of the window, for the rounding of times."""


class Averaging(LoggerEffect):
    """The logger gives the mean over a window that ends at the time it states.

    ::

        y_recorded(t) = mean of the samples in t - W to t

    W is the amplitude, 1 to 100 s. Samples are means over their interval already, so that of n = W / dt of
    them the mean is the one over W, with white noise lower by sqrt(n): a window of one sample changes
    nothing. To first order it is a delay by half of W - dt, half of W for a long window, which a time
    stamp in the middle would not show.

    Source: derived; 1 to 100 s is an engineering range.
    """

    id = "averaging"
    code = "G11"
    title = "Averaging by the logger"
    amplitude = Quantity("amplitude", "s", (1.0, 100.0), (1.0, 100.0), "W", (0.0, 1e5))
    needs = ("output",)
    sources = ("First-order expansion of a moving mean",)
    shows = "edges of the table rate become ramps; white noise falls below its slope at short times"
    shown_on = "turns of half a minute"
    confused_with = {
        "logger_skew": "the shape of an edge: averaging makes a ramp of it, a skew shifts it",
        "loop_gain": "the shape of an edge: straight here, exponential there",
        "sensor_lag": "edges of the table rate",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per second of a window much longer than a sample [deg/h], shape (n,)."""
        return -0.5 * slope_per_s(inputs, self.id, met_output(inputs))

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], shape (n,); windows cut by the start take what there is."""
        if amplitude == 0.0 or len(output) == 0:
            return output
        time, held = inputs.memory.recent(f"{self.id} output", inputs.time, output, amplitude)
        total = np.concatenate([[0.0], np.cumsum(held - held[0])])
        stop = np.arange(len(time) - len(output), len(time)) + 1
        # A sample as old as the window has just left it, but for the clock's rounding.
        first = np.searchsorted(time, inputs.time - amplitude * (1.0 - _SLACK), side="left")
        first = np.minimum(first, stop - 1)
        mean = held[0] + (total[stop] - total[first]) / (stop - first)
        return np.where(stop - first == 1, output, mean)
