"""Slips in the winding under thermal shock."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ThermalShock(BiasEffect):
    """The winding slips in a fast change of temperature, and partly creeps back.

    ::

        b = J q,      dq/dt = -q / tau + sign(dT/dt) max(|dT/dt| - threshold, 0)

    J in deg/h per degC that the temperature travels above the threshold [degC/min]: slips of a mean
    height, at a rate in proportion to the excess, in the direction of the change. Heights of single
    slips scatter, so J differs from one shock to the next. The reversible part of a shock, a large
    d(gradient)/dt, is ``shupe_pure``; that of the scale factor follows its own nodes.

    Source: slip events above about 5 degC/min (engineering, form and ranges); a published shock test
    for the scale factor, Telemetry and Remote Control 46 (2025) (read).
    """

    id = "thermal_shock"
    code = "B10"
    title = "Slips under thermal shock"
    amplitude = Quantity(
        "amplitude", "deg/h/degC", (1e-3, 2e-2), (2e-5, 5e-4), "J", (-100.0, 100.0), signed=True
    )
    shape = (
        Quantity("threshold", "degC/min", (3.0, 8.0), (3.0, 8.0), "rate without slips", (0.1, 100.0)),
        Quantity("time_constant", "s", (1800.0, 36000.0), (1800.0, 36000.0), "of creeping back", (1.0, 1e8)),
    )
    needs = ("T",)
    sources = ("Telemetry and Remote Control 46(3) (2025)",)
    shows = "steps that do not repeat while temperature changes faster than the threshold, then relaxation"
    confused_with = {
        "shupe_pure": "after the shock: shupe_pure is gone with the gradient",
        "stress_relaxation": "a slow ramp over the same range leaves no slips",
        "thermal_hysteresis": "a slow ramp over the same range leaves no slips",
    }
    drawn_per_run = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/degC [deg/h], shape (n,)."""
        rate = inputs.dT("T")
        excess = np.sign(rate) * np.maximum(np.abs(rate) - shape["threshold"], 0.0)
        step_min = (inputs.time - inputs.memory.previous(f"{self.id} time", inputs.time)) / 60.0
        travelled = inputs.memory.total(f"{self.id} travelled", excess * step_min)
        lagged = inputs.memory.lag(f"{self.id} relaxed", inputs.time, travelled, shape["time_constant"])
        return travelled - lagged
