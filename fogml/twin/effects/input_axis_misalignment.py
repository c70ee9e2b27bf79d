"""Input axis off the table's axis."""

from __future__ import annotations

import math

from fogml.runs.run import FloatArray
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import tilt_response


class InputAxisMisalignment(RigEffect):
    """The input axis goes round the table's axis on a cone and meets Earth rate across it.

    ::

        w = sin(delta) E(direction, table angle) + (cos(delta) - 1) (3600 rate + earth)

    delta is the amplitude and E what a tilt picks up of the rates across it, as in ``mount_tilt``: Earth's,
    and with a horizontal axis the table's, 180 deg/h for 5 mrad at 10 deg/s. The signature is that pick-up
    for a small delta; `added_rate` is all of it. The loss of scale factor delta**2 / 2, 12.5 ppm at 5 mrad,
    can't be told from the nominal scale factor, nor changes with temperature of 0.1 to 5 urad/degC from its
    slope.

    Source: geometry (derived); 0.5 to 20 mrad (tactical) and 0.05 to 0.5 mrad (navigation) are engineering
    ranges.
    """

    id = "input_axis_misalignment"
    code = "G3"
    place = "mount"
    title = "Misalignment of the input axis"
    amplitude = Quantity("amplitude", "mrad", (0.5, 20.0), (0.05, 0.5), "delta", (0.0, 1500.0))
    shape = (
        Quantity("direction", "deg", (0.0, 360.0), (0.0, 360.0), "of the axis", (-720.0, 720.0), default=0.0),
    )
    needs = ("angle", "facts")
    sources = ("IEEE Std 952-1997", "Patent on decoupling scale factor and misalignment")
    shows = "once a turn of the table, and a loss of scale factor that goes with the cosine of tilt"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "table_wobble": "unmount and mount again turned by 180 deg: wobble stays with the table",
        "mount_tilt": "temperature: a tilt of the mount changes with it",
        "magnetic": "a Helmholtz coil, or a turned shield",
        "coil_expansion": "a series of tilts in four states separates scale factor and misalignment",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per mrad [deg/h], shape (n,)."""
        return 1e-3 * tilt_response(inputs, shape["direction"])

    def added_rate(
        self, signature: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        """What the misalignment adds to the rate about the input axis [deg/h], exactly; shape (n,)."""
        pick_up = 1e3 * math.sin(1e-3 * amplitude) * signature
        return pick_up + 1e-6 * scale_factor_loss_ppm(amplitude) * inputs.input_rate_deg_h


def scale_factor_loss_ppm(misalignment: float) -> float:
    """Change of the scale factor, cos(delta) - 1, for a misalignment in mrad [ppm]; never positive."""
    return -2e6 * math.sin(0.5e-3 * misalignment) ** 2
