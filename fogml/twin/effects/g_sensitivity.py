"""Sensitivity to acceleration."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.attitude import UP
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class GSensitivity(BiasEffect):
    """The winding's weight deforms the coil.

    ::

        b = g_1 a_ia + g_2 a_x

    a in g along the input axis and along the gyro's x axis, 1 where an axis points up; x does so when the
    input axis is horizontal. The attitude is the set-up's, and changes where a table turns about a horizontal
    axis. The amplitude is g_1 [deg/h/g], ``cross_ratio`` g_2 / g_1.

    Source: IEEE Std 952-1997 (literature); ranges are engineering ones, usually 0 in a fibre-optic gyro.
    """

    id = "g_sensitivity"
    code = "C13"
    title = "Sensitivity to acceleration"
    amplitude = Quantity(
        "amplitude", "deg/h/g", (1e-3, 2e-2), (2e-5, 1e-3), "g_1", (-100.0, 100.0), signed=True
    )
    shape = (Quantity("cross_ratio", "1", (-1.0, 1.0), (-1.0, 1.0), "g_2 / g_1", (-1e3, 1e3)),)
    needs = ("facts",)
    sources = ("IEEE Std 952-1997",)
    shows = "a constant that changes with attitude: a tumble test over several positions"
    shown_on = "a turn about a horizontal axis in an hour"
    confused_with = {
        "earth_rate": "positions with equal Earth projection and another weight",
        "turn_on_bias": "several power cycles",
        "mount_tilt": "positions with equal Earth projection and another weight",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/g [deg/h], shape (n,)."""
        if inputs.facts.input_axis is None:
            return np.zeros(len(inputs))
        held = inputs.attitude
        sensitive = held.z + shape["cross_ratio"] * held.x
        return np.zeros(len(inputs)) + inputs.carried(UP, sensitive, mean=False)
