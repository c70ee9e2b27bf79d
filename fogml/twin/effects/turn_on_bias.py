"""Bias that differs from one power-on to the next."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import stream
from fogml.twin.quantities import Quantity


class TurnOnBias(BiasEffect):
    """The bias is another one after each power-on.

    ::

        b = sigma_on xi_k,      xi_k ~ N(0, 1),      k = 0, 1, 2 ... the power cycle

    A simulation draws xi_k from its seed. A replay does not know them: there the amplitude is what the
    run's first power cycle has, xi_0 = 1, and those of later cycles are taken for what is expected, 0.

    Source: IEEE Std 952-1997 (literature): bias repeatability over at least six power cycles; ranges are
    engineering ones.
    """

    id = "turn_on_bias"
    code = "C9"
    family = "power_cycles"
    place = "electronics"
    title = "Turn-on bias"
    amplitude = Quantity(
        "amplitude", "deg/h", (0.05, 1.0), (5e-4, 5e-3), "sigma_on", (-1e3, 1e3), signed=True
    )
    needs = ("powered_on",)
    sources = ("IEEE Std 952-1997",)
    shows = "a constant within a run that differs between runs, and a step at a power cycle"
    confused_with = {
        "earth_rate": "turn the unit over, or several power cycles",
        "g_sensitivity": "several power cycles",
        "ageing": "several power cycles on one day",
    }
    drawn_per_run = True
    seeded = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        cycles = len(inputs.power_ons_s) + 1
        if inputs.seed is None:
            return np.eye(1, cycles)[0][inputs.power_cycle]
        return stream(inputs.seed, self.id).standard_normal(cycles)[inputs.power_cycle]
