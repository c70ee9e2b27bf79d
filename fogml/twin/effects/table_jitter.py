"""Jitter of the table's servo."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import line


class TableJitter(RigEffect):
    """A true oscillation of the table about the input axis, as the samples alias it.

    ::

        w = a sin(2 pi t / alias_period + phase),      1 / alias_period = |f - m f_s|

    for jitter at f and samples at f_s. The amplitude a is that in the recording, after the samples'
    averaging of the jitter, sinc(f / f_s) of its size.

    Source: aliasing of a line (derived); ranges are engineering ones.
    """

    id = "table_jitter"
    code = "F2"
    title = "Jitter of the table"
    amplitude = Quantity("amplitude", "deg/h", (0.01, 10.0), (1e-3, 1.0), "a", (0.0, 1e6))
    shape = (
        Quantity("alias_period", "s", (30.0, 600.0), (30.0, 600.0), "in the recording", (1e-3, 1e7)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at time 0", (-720.0, 720.0), default=0.0),
    )
    sources = ("IEEE Std 952-1997",)
    shows = "a narrow line at any temperature, gone with the table's servo off"
    confused_with = {
        "acoustic": "the fan off: this line stays",
        "supply_ripple": "another supply, or the table's servo off",
        "chamber_ripple": "the chamber off",
        "sinusoidal": "the table's servo off",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        return line(inputs, shape["alias_period"], shape["phase"])
