"""Earth rate that the reference lacks."""

from __future__ import annotations

import numpy as np

from fogml.runs.facts import EARTH_RATE_DEG_H
from fogml.runs.run import FloatArray
from fogml.twin.effect import RigEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class EarthRate(RigEffect):
    """Earth rate along the input axis, as far as the reference does not hold it.

    ::

        w_e = 15.041067 (cos(lat) a_north + sin(lat) a_up),      a the unit vector along the input axis

    so 15.041067 sin(lat) for an axis that points up, 15.041067 cos(lat) cos(heading) for a horizontal one.
    Where latitude and attitude are stated it is part of the reference and of every replay; this is what is
    missing where they are not, or are wrong, and the amplitude is its size. At a fixed attitude it is one
    with the nominal bias.

    Source: Earth rate, derived.
    """

    id = "earth_rate"
    code = "G1"
    place = "mount"
    title = "Earth rate outside the reference"
    amplitude = Quantity(
        "amplitude",
        "deg/h",
        (0.0, EARTH_RATE_DEG_H),
        (0.0, EARTH_RATE_DEG_H),
        "missing Earth rate",
        (-EARTH_RATE_DEG_H, EARTH_RATE_DEG_H),
        signed=True,
    )
    sources = ("IEEE Std 952-1997",)
    shows = "a constant offset, and another one in another attitude"
    confused_with = {
        "magnetic": "a Helmholtz coil, or a turned shield: both are once a turn of heading",
        "turn_on_bias": "power cycles at the same attitude; then another attitude",
        "mount_tilt": "constant temperature: a tilt moves with it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,): ones."""
        return np.ones(len(inputs))
