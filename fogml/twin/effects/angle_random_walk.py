"""White noise of the rate."""

from __future__ import annotations

from fogml.twin.effect import WhiteNoiseEffect
from fogml.twin.quantities import Quantity


class AngleRandomWalk(WhiteNoiseEffect):
    """White noise of the rate, which walks the angle.

    ::

        sigma(tau) = N / sqrt(tau)

    with N in deg/sqrt(h) and tau in hours: N / sqrt(dt) for samples of dt.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "angle_random_walk"
    code = "E2"
    title = "Angle random walk"
    amplitude = Quantity("amplitude", "deg/sqrt(h)", (5e-3, 0.1), (2e-4, 3e-3), "N", (0.0, 1e6))
    conflicts = ("arw_physics",)
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at middle times, with slope -1/2"
    shown_on = "rest for an hour"
    confused_with = {
        "quantisation": "the slope of the Allan deviation: -1/2 here, -1 there",
        "gauss_markov": "times beyond its correlation: only then are the two alike",
        "arw_physics": "not apart: that one says where this one comes from",
    }
    candidate = True
