"""Resolution of the temperature sensors."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import unseen

_USUAL_STEP_DEGC = 0.0625
_FINEST_STEP_DEGC = 5e-4
_LARGEST_STEP_DEGC = 2.0
_SMOOTHING_S = 60.0


class SensorQuantisation(SensorEffect):
    """Sensors that give whole steps of q.

    ::

        T_s = q round(T / q)

    q is the amplitude: 0.0625 degC (DS18B20), 0.01 or 0.001 degC. The signature is what a step hides, times
    the nominal output's slope: temperature smoothed over a minute, without lag in a ramp, less the recorded
    one, per step that the record has shown so far. A record that has none is put to steps of
    0.0625 degC.

    Source: rounding (derived); data sheets of sensors (literature).
    """

    id = "sensor_quantisation"
    code = "G8"
    title = "Resolution of the temperature sensors"
    amplitude = Quantity("amplitude", "degC", (1e-3, 0.0625), (1e-3, 0.0625), "q", (0.0, 10.0))
    needs = ("slopes", "T", "T_in", "T_out")
    sources = ("Data sheet of the DS18B20",)
    shows = "a saw-tooth in slow ramps, one tooth a step of the sensor"
    confused_with = {
        "polarization_nonreciprocity": "its period is one step of the sensor",
        "chamber_ripple": "its period goes with the ramp rate",
        "sensor_lag": "a slow ramp: teeth come one by one",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC of the step [deg/h], shape (n,)."""
        return unseen(inputs, lambda name: self._hidden(name, inputs))

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""
        if amplitude == 0.0:
            return temperature
        return amplitude * np.rint(temperature / amplitude)

    def _hidden(self, name: str, inputs: Inputs) -> FloatArray:
        """Temperature that a step hides, in steps, shape (n,); within one step either way."""
        memory, temperature = inputs.memory, inputs.temperature(name)
        change = np.abs(temperature - memory.previous(f"{self.id} {name}", temperature))
        change[change < 1e-9] = np.inf
        step = memory.least(f"{self.id} step {name}", change)
        # Two lags, the second one off the first, leave no lag in a ramp.
        once = memory.lag(f"{self.id} once {name}", inputs.time, temperature, _SMOOTHING_S)
        twice = memory.lag(f"{self.id} twice {name}", inputs.time, once, _SMOOTHING_S)
        whole = (step < _FINEST_STEP_DEGC) | ((step > _LARGEST_STEP_DEGC) & np.isfinite(step))
        usual = temperature / _USUAL_STEP_DEGC
        seen = np.clip((2.0 * once - twice - temperature) / step, -1.0, 1.0)
        return np.where(whole, usual - np.rint(usual), seen)
