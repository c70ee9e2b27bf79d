"""A closed loop that settles on another fringe."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class FringeJump(LoopEffect):
    """The loop loses its fringe at start-up or under shock and locks m fringes off.

    ::

        out = w + m lambda c / (L D)        from `onset` until the next power-on

    The amplitude m is a whole number of fringes, each 266 deg/s for 1 km on 0.1 m at 1550 nm, of the
    unit's coil else; ``onset`` is the time since power-on, since the first sample where that was long before.
    The sample in which it happens holds its share.

    Source: closed loop's operating points, Lefevre (literature); offset derived.
    """

    id = "fringe_jump"
    code = "D9"
    title = "Fringe jump"
    amplitude = Quantity(
        "amplitude", "1", (1.0, 10.0), (1.0, 3.0), "m, fringes", (-1e4, 1e4), signed=True, whole=True
    )
    shape = (
        Quantity("onset", "s", (1.0, 3600.0), (1.0, 3600.0), "since power-on", (0.0, 1e9), default=905.0),
    )
    needs = ("powered_on",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a step of the output by whole fringes, hundreds of deg/s, that stays until power is cycled"
    confused_with = {
        "outliers_dropouts": "its length: an outlier is over after a few samples",
        "units_and_gaps": "the table at rest: a wrong unit leaves zero at zero",
        "turn_on_bias": "its size: whole fringes",
    }
    candidate = False
    drawn_per_run = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per fringe [deg/h], shape (n,)."""
        time = inputs.time
        step = time - inputs.memory.previous(f"{self.id} time", time)
        beginning = inputs.memory.first(f"{self.id} first time", time)
        since = np.where(np.isinf(inputs.time_on_s), time - beginning, inputs.time_on_s)
        late = since - shape["onset"]
        share = np.divide(late, step, out=(late > 0.0).astype(np.float64), where=step > 0.0)
        return 3600.0 * inputs.coil.fringe_offset_deg_s * np.clip(share, 0.0, 1.0)
