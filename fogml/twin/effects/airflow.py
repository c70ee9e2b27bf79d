"""Air about the unit."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.quantities import Quantity


class Airflow(ThermalEffect):
    """How well the chamber's air reaches the unit depends on fan and table rate.

    ::

        G_air = G (1 + k fan) / (1 + k) * (1 + rotation_share k sqrt(|rate| / 100 deg/s))

    relative to fan on and table at rest, for which time constants are stated. k is the amplitude. Sensors
    show it, so that a replay lacks nothing.

    Source: convection (literature); ranges are engineering ones.
    """

    id = "airflow"
    code = "A4"
    title = "Airflow about the unit"
    amplitude = Quantity("amplitude", "1", (0.2, 2.0), (0.2, 2.0), "k", (0.0, 100.0))
    shape = (
        Quantity("rotation_share", "1", (0.0, 0.5), (0.0, 0.5), "of the table, in units of k", (0.0, 10.0)),
    )
    sources = ("F. P. Incropera and D. P. DeWitt, Fundamentals of Heat and Mass Transfer",)
    shows = "time constants that change with fan and table rate"
    confused_with = {
        "thermal_network": "the fan off and on in a ramp",
        "chamber_setpoint_vs_air": "the end of a soak: airflow leaves no difference there",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per 1 [deg/h], shape (n,): zeros."""
        return np.zeros(len(inputs))

    def change_plant(self, plant: ThermalNetwork, amplitude: float, **shape: float) -> ThermalNetwork:
        """The plant with the effect."""
        return plant.with_airflow(amplitude, shape["rotation_share"] * amplitude)
