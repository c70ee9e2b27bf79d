"""Set point of the chamber and air at the unit."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ChamberSetpointVsAir(ThermalEffect):
    """Air at the unit that falls short of the set point: stratification.

    ::

        T_air = T_set - A (T_set - 25) / 50 * (2 - fan)

    A is the shortfall 50 degC away from the room with the fan on; it doubles with the fan off. Sensors on
    the unit show all of it, so that a replay lacks nothing.

    Source: chamber practice; 1 to 3 degC is an engineering range.
    """

    id = "chamber_setpoint_vs_air"
    code = "G13"
    title = "Set point of the chamber against its air"
    amplitude = Quantity(
        "amplitude", "degC", (1.0, 3.0), (1.0, 3.0), "at 50 degC off the room", (-50.0, 50.0)
    )
    sources = ("Data sheets of climatic chambers",)
    shows = "between the set point and a sensor on the unit, most at the ends of the range"
    confused_with = {
        "sensor_offset": "a soak at room temperature: an offset stays",
        "airflow": "its end: stratification stays in a long soak",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC [deg/h], shape (n,): zeros."""
        return np.zeros(len(inputs))

    def change_chamber(
        self, chamber: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """Chamber air [degC] with the effect, shape (n,)."""
        return chamber - amplitude * (chamber - 25.0) / 50.0 * (2.0 - inputs.drive("fan"))
