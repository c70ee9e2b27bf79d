"""Ageing of the bias."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class Ageing(BiasEffect):
    """The bias creeps with time, ever more slowly.

    ::

        b = b_1 ln(1 + t / tau)

    t is the time since the unit's first run began [s]: by the facts ``in_use_since`` and ``started``, or by
    ``started`` alone where several runs are told together; else it is the recording's time. tau is the
    shape's ``time_constant``; well before tau it is a straight line. That of the scale factor is too small
    for a recording to show.

    Source: logarithmic ageing (engineering); ranges of b_1 give 0.1 to 1 deg/h (tactical) and 0.002 to
    0.02 deg/h (navigation) in the first year for tau = 100 h.
    """

    id = "ageing"
    code = "C10"
    family = "ageing"
    place = "unit"
    title = "Ageing of the bias"
    amplitude = Quantity("amplitude", "deg/h", (0.02, 0.2), (4e-4, 4e-3), "b_1", (-100.0, 100.0), signed=True)
    shape = (Quantity("time_constant", "s", (3600.0, 36e5), (3600.0, 36e5), "tau", (1.0, 1e9)),)
    needs = ()
    sources = ("Engineering ranges of the catalogue",)
    shows = "a slow drift with time, whatever the temperature does"
    confused_with = {
        "warmup_bias": "a power cycle at constant temperature, twice: only the warm-up starts again",
        "stress_relaxation": "a ramp restarts relaxation, not ageing",
        "moisture": "a step of humidity at constant temperature",
        "rate_ramp": "a soak of more than 6 h: a ramp of the noise is no logarithm",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of b_1 [deg/h], shape (n,)."""
        return np.log1p(np.maximum(inputs.time + inputs.epoch_s, 0.0) / shape["time_constant"])
