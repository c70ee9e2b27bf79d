"""Place of the temperature sensors."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import SensorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import unseen

_LARGEST_SHARE = 0.95
"""Of sensors that show hardly more than the case, nothing tells what they sit on."""


class SensorPlacement(SensorEffect):
    """Sensors on the coil that feel the case as well.

    ::

        T_s = T + A (T_case - T)

    A is the share of the case in what they show. Without a record of the case, or a plant that gives it,
    there is nothing to see of it.

    Source: mix of nodes (derived); ranges are engineering ones.
    """

    id = "sensor_placement"
    code = "G9"
    family = "sensor_placement"
    place = "sensor"
    title = "Place of the temperature sensors"
    amplitude = Quantity("amplitude", "1", (0.02, 0.3), (0.02, 0.3), "share of the case", (-2.0, 2.0))
    needs = ("slopes", "T", "T_in", "T_out", "T_case")
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
        """Response per share of 1 [deg/h], shape (n,)."""
        return unseen(inputs, self.id, lambda name: inputs.temperature(name) - inputs.temperature("T_case"))

    def sense(
        self, name: str, temperature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the sensor `name` gives [degC] where its place has `temperature` [degC]; shape (n,)."""
        if name in ("T_case", "T_chamber"):
            return temperature
        return temperature + amplitude * (inputs.temperature("T_case") - temperature)

    def replayed_amplitude(self, amplitude: float) -> float:
        """A / (1 - A): what is left of T - T_case in what the sensors show is 1 - A of it."""
        return amplitude / (1.0 - min(amplitude, _LARGEST_SHARE))
