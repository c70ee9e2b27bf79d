"""The fastest change of rate that the loop follows."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output


class SlewLimit(LoopEffect):
    """A loop whose feedback changes no faster than its slew.

    ::

        out = w + A (y - w),      y follows w with |dy/dt| <= slew

    ``slew`` in deg/s2; A is 1 for a loop that catches up once it can. The phase error, K_S times the rate not
    yet fed back, has to stay within half a fringe: a loop of time constant tau keeps its fringe up to an
    acceleration of pi / (K_S tau), and loses it beyond (`fringe_jump`). Samples much longer than the change
    don't show it.

    Source: linear control with a limit (derived); ranges are engineering ones.
    """

    id = "slew_limit"
    code = "D12"
    title = "Slew of the closed loop"
    amplitude = Quantity("amplitude", "1", (0.9, 1.0), (0.9, 1.0), "A", (0.0, 1.0), default=1.0)
    shape = (Quantity("slew", "deg/s2", (1e3, 1e5), (1e3, 1e5), "of the output", (1e-3, 1e9)),)
    needs = ("output",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "fast changes of the rate: straight flanks of the output, of one slope for every size of step"
    shown_on = "a step of the rate within a millisecond"
    confused_with = {
        "loop_gain": "the shape of an edge: straight here, exponential there",
        "averaging": "two steps: the flank's length goes with the step here, and not there",
        "rate_range": "a slow approach to the rate: saturation stays",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per share [deg/h], shape (n,)."""
        output = met_output(inputs)
        return inputs.memory.slew(self.id, inputs.time, output, 3600.0 * shape["slew"]) - output
