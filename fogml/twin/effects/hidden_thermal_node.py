"""A slow node that no sensor shows."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class HiddenThermalNode(ThermalEffect):
    """A second boundary, such as the table's plate, that follows the air slowly and acts on the bias.

    ::

        b = A (T_h - T),      time_constant dT_h/dt = T_chamber - T_h

    with the coil's temperature T, and the nearest sensor to the air in place of T_chamber where that is not
    recorded.

    Source: heat equation (derived); a lag of 20 to 60 min is an engineering range.
    """

    id = "hidden_thermal_node"
    code = "A5"
    family = "hidden_node"
    place = "chamber"
    title = "Hidden thermal node"
    amplitude = Quantity("amplitude", "deg/h/degC", (0.01, 0.5), (2e-4, 1e-2), "A", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("time_constant", "s", (1200.0, 3600.0), (1200.0, 3600.0), "of the hidden node", (1.0, 1e6)),
    )
    needs = ("T", "T_chamber")
    sources = ("Heat equation of a network of nodes",)
    shows = "a tail of tens of minutes after each ramp, with all sensors at rest"
    confused_with = {
        "stress_relaxation": "a power step with sensors flat; relaxation is quicker when hot",
        "thermal_hysteresis": "a soak of several time constants: the node comes to rest",
        "shupe_mohr": "the end of a ramp: this one has a tail",
        "warmup_bias": "a power cycle at constant temperature",
        "moisture": "its time scale: hours to days",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/degC [deg/h], shape (n,)."""
        air = inputs.temperature("T_chamber")
        node = inputs.memory.lag(self.id, inputs.time, air, shape["time_constant"])
        return node - inputs.temperature("T")
