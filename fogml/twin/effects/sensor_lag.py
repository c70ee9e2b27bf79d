"""Lag of the temperature sensors."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import unseen


class SensorLag(SensorEffect):
    """Sensors that follow the place they sit on late.

    ::

        tau_s dT_s/dt = T - T_s

    tau_s is the amplitude: 5 to 60 s for a bonded sensor, 1 to 5 min for one on the case. To first order the
    output owes slope * tau_s * dT/dt to what the sensor misses, with the slope of the nominal output.

    Source: first-order sensor (derived); ranges are engineering ones.
    """

    id = "sensor_lag"
    code = "G6"
    family = "sensor_lag"
    place = "sensor"
    title = "Lag of the temperature sensors"
    amplitude = Quantity("amplitude", "s", (5.0, 300.0), (5.0, 60.0), "tau_s", (0.0, 1e5))
    needs = ("slopes", "T", "T_in", "T_out")
    sources = ("First-order response of a sensor to its surroundings",)
    shows = "during ramps, in proportion to the slope of the static output over temperature"
    shown_on = "multi-point-cycle"
    confused_with = {
        "shupe_mohr": "the slope of the output over temperature: a lag changes sign at its extremum",
        "logger_skew": "edges of the table rate show the clock; a power step shows the lag",
        "thermal_hysteresis": "two ramp rates: a lag's loop opens with the rate",
        "shupe_pure": "long ramps: a lag stays for all of them",
        "sensor_placement": "a power step, or sensors in more places",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per second [deg/h], shape (n,)."""
        return unseen(inputs, self.id, lambda name: inputs.dT(name) / 60.0)

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""
        if amplitude == 0.0:
            return temperature
        return inputs.memory.lag(f"{self.id} {name}", inputs.time, temperature, amplitude)
