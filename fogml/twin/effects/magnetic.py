"""Sensitivity to magnetic fields."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.attitude import earth_field
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.set_up import EARTH_HORIZONTAL_UT, EARTH_VERTICAL_UT

_UT_PER_G = 100.0


class Magnetic(BiasEffect):
    """Faraday effect of a twisted fibre, radial, and its axial companion.

    ::

        b = s_r (B_x cos(psi) + B_y sin(psi)) + s_a B_z

    B in the gyro frame, z along the coil's axis [G]; s_r is the amplitude, after the shield, psi the
    shape's ``phase`` and ``axial_ratio`` is s_a / s_r. Where no field is recorded, it is Earth's in the
    gyro's attitude, in which the coil turns by the table's angle: 0.2 G to the north, and 0.4 G down in the
    northern hemisphere or up in the southern, or what the twin's surroundings state.

    Source: Hotate and Tabe, Applied Optics 25 (1986) and 26 (1987); IEEE Access 8 (2020) 222242, axial
    (read); ranges partly literature, partly engineering.
    """

    id = "magnetic"
    code = "C3"
    place = "coil and shield"
    title = "Magnetic sensitivity"
    amplitude = Quantity(
        "amplitude", "deg/h/G", (0.05, 1.0), (1e-3, 2e-2), "s_r", (-100.0, 100.0), signed=True
    )
    shape = (
        Quantity(
            "phase", "deg", (0.0, 360.0), (0.0, 360.0), "direction of s_r", (-720.0, 720.0), default=0.0
        ),
        Quantity("axial_ratio", "1", (0.1, 0.5), (0.1, 0.5), "s_a / s_r", (-100.0, 100.0)),
    )
    needs = ("B_x", "B_y", "B_z", "angle")
    sources = (
        "K. Hotate and K. Tabe, Applied Optics 25 (1986) 1086; 26 (1987)",
        "IEEE Access 8 (2020) 222242",
    )
    shows = "a sinusoid over the table's angle, once a turn; steps with currents near the unit"
    shown_on = "a turn of the table and back in two hours"
    confused_with = {
        "earth_rate": "a Helmholtz coil, or a turned shield: both are once a turn of heading",
        "mount_tilt": "a Helmholtz coil, or a turned shield",
        "table_wobble": "a Helmholtz coil, or a turned shield",
        "chamber_pickup": "a field sensor, or the same current in another loop",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/G [deg/h], shape (n,)."""
        psi = np.radians(shape["phase"])
        if any(name in inputs.drives for name in ("B_x", "B_y", "B_z")):
            radial = np.cos(psi) * inputs.drive("B_x") + np.sin(psi) * inputs.drive("B_y")
            axial = inputs.drive("B_z")
        else:
            field = earth_field(inputs.facts, inputs.angle_deg, EARTH_HORIZONTAL_UT, EARTH_VERTICAL_UT)
            radial = np.cos(psi) * field["B_x"] + np.sin(psi) * field["B_y"]
            axial = field["B_z"]
        return (radial + shape["axial_ratio"] * axial) / _UT_PER_G
