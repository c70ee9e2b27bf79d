"""Time constants of the thermal network."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin import effect
from fogml.twin.inputs import Inputs
from fogml.twin.plant import network
from fogml.twin.quantities import Quantity


class ThermalNetwork(effect.ThermalEffect):
    """Nodes that take up more heat than stated: every time constant of the plant is another one.

    ::

        (1 + A) C_i dT_i/dt = sum_j G_ij (T_j - T_i) + P_i(t)

    for chamber air, case, coil, hub, electronics and plate (`fogml.twin.plant`). Chamber to case takes 5
    to 30 min, case to coil 2 to 15, outer to inner face 1 to 10, electronics to case 3 to 10 min; A is how
    far those of one unit are off. Sensors show what the nodes do, so that a replay lacks nothing.

    Source: heat equation (derived); ranges are engineering ones.
    """

    id = "thermal_network"
    code = "A1"
    title = "Time constants of the thermal network"
    amplitude = Quantity("amplitude", "1", (0.05, 0.5), (0.05, 0.5), "A", (-0.9, 0.9), signed=True)
    sources = ("Heat equation of a network of nodes",)
    shows = "a low pass and a delay of the chamber's temperature at every sensor"
    confused_with = {
        "airflow": "the fan, or another table rate: capacities don't care",
        "sensor_lag": "a power step: it reaches the sensor from the other side",
        "hidden_thermal_node": "a soak of several hours",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per 1 [deg/h], shape (n,): zeros."""
        return np.zeros(len(inputs))

    def change_plant(
        self, plant: network.ThermalNetwork, amplitude: float, **shape: float
    ) -> network.ThermalNetwork:
        """The plant with the effect."""
        capacities = {name: (1.0 + amplitude) * value for name, value in plant.capacities.items()}
        return replace(plant, capacities=capacities)
