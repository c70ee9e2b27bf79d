"""Resolution of the temperature sensors."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.runs.steps import FINEST_STEP_DEGC, recorded_step, to_steps
from fogml.signals.staircase import course_through_steps
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import unseen

_USUAL_STEP_DEGC = 0.0625
_SMOOTHED_S = 24.0
"""Time constant of the smoothing at samples of 1 s; it goes with the root of the interval."""


class SensorQuantisation(SensorEffect):
    """Sensors that give whole steps of q.

    ::

        T_s = q round(T / q)

    q is the amplitude: 0.0625 degC (DS18B20), 0.01 or 0.001 degC. The signature is what a step hides, times
    the nominal output's slope. Of a rounded record it is told by double exponential smoothing, which follows
    a steady ramp without delay; its step is the smallest change so far. In hindsight it is told by the
    smoothest course that runs through each sensor's steps. A record that is not rounded is put to steps of
    0.0625 degC.

    Source: rounding (derived); R. G. Brown, Smoothing, Forecasting and Prediction (1963), for the smoothing;
    data sheets of sensors (literature).
    """

    id = "sensor_quantisation"
    code = "G8"
    family = "sensor_steps"
    place = "sensor"
    digitises = True
    title = "Resolution of the temperature sensors"
    amplitude = Quantity("amplitude", "degC", (1e-3, 0.0625), (1e-3, 0.0625), "q", (0.0, 10.0))
    needs = ("slopes", "T", "T_in", "T_out")
    sources = ("Data sheet of the DS18B20",)
    shows = "a saw-tooth in slow ramps, one tooth a step of the sensor"
    shown_on = "the end of a ramp of 10 degC/h"
    confused_with = {
        "polarization_nonreciprocity": "its period is one step of the sensor",
        "chamber_ripple": "its period goes with the ramp rate",
        "sensor_lag": "a slow ramp: teeth come one by one",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC of the step [deg/h], shape (n,)."""
        return unseen(inputs, self.id, lambda name: self._hidden(name, inputs))

    def in_hindsight(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC of the step [deg/h], shape (n,), with what readings tell that came later."""

        def hidden(name: str) -> FloatArray:
            key = f"{self.id} in hindsight: {inputs.place(name)}"
            if key not in inputs.cache:
                inputs.cache[key] = self._hidden_in_hindsight(name, inputs)
            return inputs.cache[key]

        return unseen(inputs, self.id, hidden)

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""
        if amplitude == 0.0:
            return temperature
        return to_steps(temperature, amplitude)

    def _hidden(self, name: str, inputs: Inputs) -> FloatArray:
        """Temperature that a step hides, in steps, shape (n,); within half a step either way."""
        memory, time, temperature = inputs.memory, inputs.time, inputs.temperature(name)
        change = np.abs(temperature - memory.previous(f"{self.id} {name}", temperature))
        change[change < 1e-9] = np.inf
        step = memory.least(f"{self.id} step {name}", change)
        known = np.isfinite(step)
        interval = time - memory.previous(f"{self.id} time {name}", time)
        smoothed_s = _SMOOTHED_S * np.sqrt(interval)
        once = memory.lag(f"{self.id} once {name}", time, temperature, smoothed_s)
        twice = memory.lag(f"{self.id} twice {name}", time, once, smoothed_s)
        smooth = 2.0 * once - twice
        within = np.clip(np.where(known, smooth - temperature, 0.0) / np.where(known, step, 1.0), -0.5, 0.5)
        usual = temperature / _USUAL_STEP_DEGC
        return np.where(step < FINEST_STEP_DEGC, usual - np.rint(usual), within)

    def _hidden_in_hindsight(self, name: str, inputs: Inputs) -> FloatArray:
        """The same where the whole record is known: of all sensors at a place, in steps of the coarsest."""
        readings = inputs.readings(name)
        steps = [recorded_step(values) for values in readings]
        if max(steps) < FINEST_STEP_DEGC:
            return self._hidden(name, inputs)
        hidden = [
            course_through_steps(inputs.time, values, step) - values
            for values, step in zip(readings, steps)
            if step >= FINEST_STEP_DEGC
        ]
        return np.asarray(np.sum(hidden, axis=0) / len(readings) / max(steps))
