"""Bias that differs from one power-on to the next."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class TurnOnBias(BiasEffect):
    """The bias is another one after each power-on.

    ::

        b = sigma_on xi_k,      xi_k ~ N(0, 1),      k = 0, 1, 2 ... the power cycle

    The amplitude is what the run's first power cycle has, so xi_0 = 1; those of later cycles in the
    same run are a fixed draw.

    Source: IEEE Std 952-1997 (literature): bias repeatability over at least six power cycles; ranges are
    engineering ones.
    """

    id = "turn_on_bias"
    code = "C9"
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

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        later = np.random.default_rng(0).standard_normal(len(inputs.power_ons_s))
        return np.concatenate([[1.0], later])[inputs.power_cycle]
