"""Wobble of the table's axis."""

from __future__ import annotations

import math

from fogml.runs.run import FloatArray
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import tilt_response

_ARC_SECOND = math.pi / 180.0 / 3600.0


class TableWobble(RigEffect):
    """A table whose plate is not square to its axis tilts the unit round with it.

    ::

        w = eps E(phase, table angle),      and a loss of eps**2 / 2 of the rate

    eps is the amplitude: 1 to 10 arcsec for a good table, 30 to 60 for a shaft through a chamber's wall. E
    is what such a tilt picks up, as in ``mount_tilt``: Earth rate once a turn with the axis upright, with a
    horizontal one the table's rate too. The loss is below 0.1 ppm and left out.

    Source: geometry (derived); ranges are engineering ones.
    """

    id = "table_wobble"
    code = "G4"
    title = "Wobble of the table"
    amplitude = Quantity("amplitude", "arcsec", (1.0, 60.0), (1.0, 10.0), "eps", (0.0, 1e5))
    shape = (
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at angle 0", (-720.0, 720.0), default=0.0),
    )
    needs = ("angle", "facts")
    sources = ("IEEE Std 952-1997",)
    shows = "a sinusoid over the table's angle, once a turn"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "input_axis_misalignment": "mount the unit turned by 180 deg: wobble stays with the table",
        "magnetic": "a Helmholtz coil, or a turned shield",
        "mount_tilt": "temperature: a tilt of the mount changes with it",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per arcsec [deg/h], shape (n,)."""
        return _ARC_SECOND * tilt_response(inputs, shape["phase"])
