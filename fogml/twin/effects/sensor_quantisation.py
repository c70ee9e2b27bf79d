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


class SensorQuantisation(SensorEffect):
    """Sensors that give whole steps of q.

    ::

        T_s = q round(T / q)

    q is the amplitude: 0.0625 degC (DS18B20), 0.01 or 0.001 degC. The signature is what a step hides, times
    the nominal output's slope. A rounded record tells it where steps can be told apart: half a step when it
    changes, then on by the rate of temperature; its step is the smallest change so far. A record that is
    not rounded is put to steps of 0.0625 degC.

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
        return unseen(inputs, self.id, lambda name: self._hidden(name, inputs))

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""
        if amplitude == 0.0:
            return temperature
        return amplitude * np.rint(temperature / amplitude)

    def _hidden(self, name: str, inputs: Inputs) -> FloatArray:
        """Temperature that a step hides, in steps, shape (n,); within half a step either way."""
        memory, time, temperature = inputs.memory, inputs.time, inputs.temperature(name)
        change = np.abs(temperature - memory.previous(f"{self.id} {name}", temperature))
        change[change < 1e-9] = np.inf
        step = memory.least(f"{self.id} step {name}", change)
        changed = -memory.least(f"{self.id} changed {name}", np.where(np.isfinite(change), -time, np.inf))
        interval = time - memory.previous(f"{self.id} time {name}", time)
        known = np.isfinite(step)
        rate = np.where(known, inputs.dT(name) / 60.0, 0.0) / np.where(known, step, 1.0)
        # As the record changes, temperature is half of a step behind it, and goes on from there.
        within = np.clip(np.abs(rate) * np.where(known, time - changed, 0.0) - 0.5, -0.5, 0.5)
        # Not to be told from steps that are rarer than the window of the rate, or as dense as samples.
        told = np.clip(np.abs(rate) * inputs.rate_window_s - 0.5, 0.0, 1.0)
        # A hair below, so that rounding tells nothing of one step a sample.
        told *= np.clip(2.0 - 2.0 * np.abs(rate) * interval - 1e-9, 0.0, 1.0)
        usual = temperature / _USUAL_STEP_DEGC
        return np.where(step < _FINEST_STEP_DEGC, usual - np.rint(usual), np.sign(rate) * within * told)
