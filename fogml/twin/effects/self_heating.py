"""Heat of the electronics."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.quantities import Quantity


class SelfHeating(ThermalEffect):
    """Power that the electronics turn into heat from each power-on.

    ::

        P(t) = P_inf + (P_0 - P_inf) exp(-t / time_constant)

    The amplitude is the electronics' rise in the end [degC], P_inf times what the plant makes of a watt;
    ``initial_ratio`` is P_0 / P_inf. 1.5 to 4 W for a tactical gyro, 4 to 12 W for a navigation one with
    erbium source. It takes the place of any heating that the plant states. Sensors show it, so that a replay
    lacks nothing.

    Source: heat equation (derived); ranges are engineering ones.
    """

    id = "self_heating"
    code = "A2"
    title = "Self-heating of the electronics"
    amplitude = Quantity("amplitude", "degC", (5.0, 20.0), (5.0, 20.0), "steady rise", (0.0, 100.0))
    shape = (
        Quantity("initial_ratio", "1", (1.0, 2.0), (1.0, 2.0), "P_0 / P_inf", (0.0, 20.0)),
        Quantity("time_constant", "s", (300.0, 2400.0), (300.0, 2400.0), "of the power", (0.1, 1e6)),
    )
    sources = ("Heat equation of a network of nodes",)
    shows = "an exponential after power-on at constant chamber temperature, from hub to coil"
    confused_with = {
        "warmup_bias": "a sensor on the electronics",
        "ageing": "a power cycle in a soak starts it again",
        "stress_relaxation": "a power cycle in a soak starts it again",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per degC [deg/h], shape (n,): zeros."""
        return np.zeros(len(inputs))

    def change_plant(self, plant: ThermalNetwork, amplitude: float, **shape: float) -> ThermalNetwork:
        """The plant with the effect."""
        if amplitude == 0.0:
            return plant
        steady = amplitude / plant.steady_rises()[plant.heating.node]
        return plant.with_heating(steady, shape["initial_ratio"] * steady, shape["time_constant"])
