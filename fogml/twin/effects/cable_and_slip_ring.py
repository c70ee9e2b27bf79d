"""Cable and slip ring of the table."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class CableAndSlipRing(BiasEffect):
    """Supply that drops over brushes and cable while the table moves.

    ::

        b = A |rate| / (|rate| + half_rate)

    The amplitude is the shift at high table rates, half of which is there at ``half_rate``. Bursts of noise
    that come with it are those of ``outliers_dropouts``.

    Source: form and ranges are engineering ones, the latter from a drop of 0.1 to 1 V at the supply's
    sensitivity.
    """

    id = "cable_and_slip_ring"
    code = "F5"
    title = "Cable and slip ring"
    amplitude = Quantity("amplitude", "deg/h", (0.01, 1.0), (1e-4, 2e-2), "A", (-1e4, 1e4), signed=True)
    shape = (Quantity("half_rate", "deg/s", (0.1, 10.0), (0.1, 10.0), "rate of half the shift", (1e-6, 1e4)),)
    needs = ("rate",)
    sources = ("Engineering practice of rate tables",)
    shows = "a shift while the table moves, the same for both directions and nearly for all rates"
    shown_on = "turns of half a minute"
    confused_with = {
        "sf_asymmetry": "two rates: asymmetry grows with the rate",
        "vibration_rectification": "a vibration sensor on the table",
        "supply_ripple": "the supply's own record",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,), between 0 and 1."""
        rate = np.abs(inputs.turning_deg_s)
        return rate / (rate + shape["half_rate"])
