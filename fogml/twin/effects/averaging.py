"""Averaging by the logger."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoggerEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output, slope_per_s


class Averaging(LoggerEffect):
    """The logger gives the mean over a window that ends at the time it states.

    ::

        y_recorded(t) = (1 / W) * integral of y from t - W to t

    W is the amplitude, 1 to 100 s. To first order it is a delay by half of the window, which a time stamp in
    the middle would not show. Samples further apart than W leave parts of the signal out; lines
    above half of the sample rate then appear elsewhere.

    Source: derived; 1 to 100 s is an engineering range.
    """

    id = "averaging"
    code = "G11"
    title = "Averaging by the logger"
    amplitude = Quantity("amplitude", "s", (1.0, 100.0), (1.0, 100.0), "W", (0.0, 1e5))
    needs = ("output",)
    sources = ("First-order expansion of a moving mean",)
    shows = "edges of the table rate become ramps; white noise falls below its slope at short times"
    confused_with = {
        "logger_skew": "the shape of an edge: averaging makes a ramp of it, a skew shifts it",
        "loop_gain": "the shape of an edge: straight here, exponential there",
        "sensor_lag": "edges of the table rate",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per second of the window [deg/h], shape (n,)."""
        return -0.5 * slope_per_s(inputs, self.id, met_output(inputs))

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], shape (n,); windows cut by the start take what there is."""
        if amplitude == 0.0 or len(output) == 0:
            return output
        time, held = inputs.memory.recent(f"{self.id} output", inputs.time, output, amplitude)
        steps = np.diff(time)
        integral = np.concatenate([[0.0], np.cumsum(0.5 * steps * (held[1:] + held[:-1]))])
        begin = np.maximum(inputs.time - amplitude, time[0])
        piece = np.clip(np.searchsorted(time, begin, side="right") - 1, 0, max(len(time) - 2, 0))
        since = begin - time[piece]
        at_begin = np.interp(begin, time, held)
        before = integral[piece] + 0.5 * since * (held[piece] + at_begin)
        width = inputs.time - begin
        area = integral[len(time) - len(output) :] - before
        return np.divide(area, width, out=output.copy(), where=width > 0.0)
