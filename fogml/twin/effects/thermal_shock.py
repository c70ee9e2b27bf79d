"""Slips in the winding under thermal shock."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.quantities import Quantity


class ThermalShock(BiasEffect):
    """The winding slips in a fast change of temperature, and partly creeps back.

    ::

        b = J q,      dq/dt = -q / tau + ds/dt,      E[ds/dt] = sign(dT/dt) max(|dT/dt| - threshold, 0)

    J in deg/h per degC that the temperature travels above the threshold [degC/min]. In a simulation s
    is a sum of slips in the direction of the change, drawn from its seed: Poisson in number,
    ``slips`` of them per degC of the excess, and exponential in height, 1 / ``slips`` degC in the mean. A
    replay, which can't know them, has their mean, a smooth course. The reversible part of a shock, a large
    d(gradient)/dt, is ``shupe_pure``; that of the scale factor follows its own nodes.

    Source: slip events above about 5 degC/min (engineering, form and ranges); a published shock test
    for the scale factor, Telemetry and Remote Control 46 (2025) (read).
    """

    id = "thermal_shock"
    code = "B10"
    place = "coil"
    title = "Slips under thermal shock"
    amplitude = Quantity(
        "amplitude", "deg/h/degC", (1e-3, 2e-2), (2e-5, 5e-4), "J", (-100.0, 100.0), signed=True
    )
    shape = (
        Quantity("threshold", "degC/min", (3.0, 8.0), (3.0, 8.0), "rate without slips", (0.1, 100.0)),
        Quantity("time_constant", "s", (1800.0, 36000.0), (1800.0, 36000.0), "of creeping back", (1.0, 1e8)),
    )
    slips: ClassVar[float] = 4.0
    """Slips per degC that the temperature travels above the threshold: some tens in a shock."""
    needs = ("T",)
    sources = ("Telemetry and Remote Control 46(3) (2025)",)
    shows = "steps that do not repeat while temperature changes faster than the threshold, then relaxation"
    shown_on = "thermal shocks of 60 degC/min with a threshold of 3 degC/min"
    confused_with = {
        "shupe_pure": "after the shock: shupe_pure is gone with the gradient",
        "stress_relaxation": "a slow ramp over the same range leaves no slips",
        "thermal_hysteresis": "a slow ramp over the same range leaves no slips",
    }
    drawn_per_run = True
    seeded = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/degC [deg/h], shape (n,)."""
        rate = inputs.dT("T")
        excess = np.sign(rate) * np.maximum(np.abs(rate) - shape["threshold"], 0.0)
        step_min = (inputs.time - inputs.memory.previous(f"{self.id} time", inputs.time)) / 60.0
        slipped = excess * step_min
        if inputs.seed is not None:
            slipped = self._drawn(slipped, inputs.seed, inputs.memory)
        travelled = inputs.memory.total(f"{self.id} travelled", slipped)
        lagged = inputs.memory.lag(f"{self.id} relaxed", inputs.time, travelled, shape["time_constant"])
        return travelled - lagged

    def _drawn(self, mean: FloatArray, seed: int, memory: Memory) -> FloatArray:
        """Sums of slips [degC] whose expected value is `mean` at each sample, shape (n,)."""
        counts = memory.generator(f"{self.id} counts", seed).poisson(self.slips * np.abs(mean))
        # A sum of exponential heights is gamma distributed; samples without a slip draw none.
        found, some = np.zeros(len(mean)), counts > 0
        heights = memory.generator(f"{self.id} heights", seed).standard_gamma(counts[some])
        found[some] = heights / self.slips
        return np.copysign(found, mean)
