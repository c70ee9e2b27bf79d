"""Outliers and stuck frames."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.quantities import Quantity


class OutliersDropouts(NoiseEffect):
    """Samples that are far off, alone or in short bursts.

    ::

        y = A normal        for a burst that begins with `probability` at each sample

    and lasts ``mean_length`` samples on average: 1 for lone outliers, more for frames that stick at a
    wrong value.

    Source: logger practice; a probability of 1e-6 to 1e-4 is an engineering range.
    """

    id = "outliers_dropouts"
    code = "E9"
    title = "Outliers and dropouts"
    amplitude = Quantity(
        "amplitude", "deg/h", (10.0, 1000.0), (1.0, 100.0), "standard deviation of their size", (0.0, 1e9)
    )
    shape = (
        Quantity("probability", "1", (1e-6, 1e-4), (1e-6, 1e-4), "of a burst at a sample", (0.0, 1.0)),
        Quantity("mean_length", "1", (1.0, 10.0), (1.0, 10.0), "of a burst in samples", (1.0, 1e6)),
    )
    sources = ("IEEE Std 952-1997",)
    shows = "single rows far from their neighbours; reading a run reports them"
    confused_with = {
        "fringe_jump": "its length: a jump stays",
        "thermal_shock": "its length: a slip stays",
        "cable_and_slip_ring": "the table at rest",
    }
    candidate = False

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        from fogml.signals.random_noise import bursts

        return bursts(rng, count, amplitude, shape["probability"], shape["mean_length"])
