"""Offset and gain of the temperature sensors."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import unseen


class SensorOffset(SensorEffect):
    """Sensors that are off, all alike.

    ::

        T_s = T + A (1 + gain (T - 25))

    A is the offset at 25 degC; A times ``gain`` is the relative error of the gain, 0.1 to 0.5 % as a rule.
    Self-heating of a sensor, 0.02 to 0.2 degC, is such an offset. With the nominal constants free it is one
    with them.

    Source: data sheets of sensors (literature); ranges are engineering ones.
    """

    id = "sensor_offset"
    code = "G7"
    title = "Offset of the temperature sensors"
    amplitude = Quantity(
        "amplitude", "degC", (0.05, 0.5), (0.05, 0.5), "at 25 degC", (-20.0, 20.0), signed=True
    )
    shape = (Quantity("gain", "1/degC", (0.0, 0.02), (0.0, 0.02), "per offset", (-1.0, 1.0)),)
    needs = ("slopes", "T", "T_in", "T_out")
    sources = ("Data sheets of temperature sensors",)
    shows = "not in one run, as the calibration takes it up; in a run with another sensor"
    shown_on = "multi-point-cycle"
    confused_with = {
        "sensor_placement": "a soak: all places agree there, an offset stays",
        "bias_polynomial": "another sensor at the same place",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC [deg/h], shape (n,)."""
        return unseen(inputs, self.id, lambda name: -(1.0 + shape["gain"] * inputs.u(name)))

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""
        return temperature + amplitude * (1.0 + shape["gain"] * (temperature - 25.0))
