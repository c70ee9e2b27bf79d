"""The temperature sensors."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.runs.steps import FINEST_STEP_DEGC, recorded_step, to_steps
from fogml.signals.smoothing import course_through_steps
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity, shared, signed, unsigned
from fogml.twin.responses import unseen


class SensorLag(SensorEffect):
    """Sensors that follow the place they sit on late.

    ::

        tau_s dT_s/dt = T - T_s

    tau_s is the amplitude: 5 to 60 s for a bonded sensor, 1 to 5 min for one on the case. To first order the
    output owes slope * tau_s * dT/dt to what the sensor misses, with the slope of the nominal output.

    Source: first-order sensor (derived); ranges are engineering ones.
    """

    code = "G6"
    family = "sensor_lag"
    place = "sensor"
    title = "Lag of the temperature sensors"
    amplitude = unsigned("s", (5.0, 300.0), (5.0, 60.0), "tau_s", 1e5)
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
        return unseen(inputs, self.id, lambda name: inputs.dT(name) / 60.0)

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        if amplitude == 0.0:
            return temperature
        return inputs.memory.lag(f"{self.id} {name}", inputs.time, temperature, amplitude)


class SensorOffset(SensorEffect):
    """Sensors that are off, all alike.

    ::

        T_s = T + A (1 + gain (T - 25))

    A is the offset at 25 degC; A times ``gain`` is the relative error of the gain, 0.1 to 0.5 % as a rule.
    Self-heating of a sensor, 0.02 to 0.2 degC, is such an offset. With the nominal constants free it is one
    with them.

    Source: data sheets of sensors (literature); ranges are engineering ones.
    """

    code = "G7"
    title = "Offset of the temperature sensors"
    amplitude = signed("degC", (0.05, 0.5), (0.05, 0.5), "at 25 degC", 20.0)
    shape = (shared("gain", "1/degC", (0.0, 0.02), "per offset", (-1.0, 1.0)),)
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
        return unseen(inputs, self.id, lambda name: -(1.0 + shape["gain"] * inputs.u(name)))

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        return temperature + amplitude * (1.0 + shape["gain"] * (temperature - 25.0))


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

    code = "G8"
    family = "sensor_steps"
    place = "sensor"
    digitises = True
    title = "Resolution of the temperature sensors"
    amplitude = unsigned("degC", (1e-3, 0.0625), (1e-3, 0.0625), "q", 10.0)
    needs = ("slopes", "T", "T_in", "T_out")
    usual_step_degc = 0.0625
    """Step that a record which is not rounded is put to."""
    smoothed_s = 24.0
    """Time constant of the smoothing at samples of 1 s; it goes with the root of the interval."""
    sources = ("Data sheet of the DS18B20",)
    shows = "a saw-tooth in slow ramps, one tooth a step of the sensor"
    shown_on = "the end of a ramp of 10 degC/h"
    confused_with = {
        "polarization_nonreciprocity": "its period is one step of the sensor",
        "chamber_ripple": "its period goes with the ramp rate",
        "sensor_lag": "a slow ramp: teeth come one by one",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
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
        smoothed_s = self.smoothed_s * np.sqrt(interval)
        once = memory.lag(f"{self.id} once {name}", time, temperature, smoothed_s)
        twice = memory.lag(f"{self.id} twice {name}", time, once, smoothed_s)
        smooth = 2.0 * once - twice
        within = np.clip(np.where(known, smooth - temperature, 0.0) / np.where(known, step, 1.0), -0.5, 0.5)
        usual = temperature / self.usual_step_degc
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


class SensorPlacement(SensorEffect):
    """Sensors on the coil that feel the case as well.

    ::

        T_s = T + A (T_case - T)

    A is the share of the case in what they show. Without a record of the case, or a plant that gives it,
    there is nothing to see of it.

    Source: mix of nodes (derived); ranges are engineering ones.
    """

    code = "G9"
    family = "sensor_placement"
    place = "sensor"
    title = "Place of the temperature sensors"
    amplitude = Quantity("amplitude", "1", (0.02, 0.3), (0.02, 0.3), "share of the case", (-2.0, 2.0))
    needs = ("slopes", "T", "T_in", "T_out", "T_case")
    largest_share = 0.95
    """Of sensors that show hardly more than the case, nothing tells what they sit on."""
    sources = ("Heat conduction along a sensor's leads",)
    shows = "during ramps and after power-on, in proportion to the slope of the static output"
    shown_on = "multi-point-cycle"
    confused_with = {
        "sensor_lag": "a power step: it heats the case from inside",
        "hidden_thermal_node": "sensors in more places",
        "sensor_offset": "a soak: all places agree there",
        "shupe_mohr": "the slope of the output over temperature changes this one's sign at its extremum",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return unseen(inputs, self.id, lambda name: inputs.temperature(name) - inputs.temperature("T_case"))

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        if name in ("T_case", "T_chamber"):
            return temperature
        return temperature + amplitude * (inputs.temperature("T_case") - temperature)

    def replayed_amplitude(self, amplitude: float) -> float:
        """A / (1 - A): what is left of T - T_case in what the sensors show is 1 - A of it."""
        return amplitude / (1.0 - min(amplitude, self.largest_share))
