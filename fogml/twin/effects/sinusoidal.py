"""A line in the noise."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.quantities import Quantity


class Sinusoidal(NoiseEffect):
    """A line of unknown phase, such as of compressor, table or mains.

    ::

        y = Omega_0 sin(2 pi frequency t + phase)

    with a phase drawn anew for each realisation. The Allan variance is Omega_0**2 (sin(x)**2 / x)**2 with x =
    pi frequency tau, greatest where tan x = 2 x. Samples are means over their interval, so that lines
    above the Nyquist frequency come weakened and aliased.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    id = "sinusoidal"
    code = "E6"
    family = "line"
    place = "electronics"
    title = "Sinusoidal noise"
    amplitude = Quantity("amplitude", "deg/h", (0.01, 1.0), (1e-4, 2e-2), "Omega_0", (0.0, 1e6))
    shape = (Quantity("frequency", "Hz", (1e-3, 10.0), (1e-3, 10.0), "of the line", (1e-9, 1e6)),)
    sources = ("IEEE Std 952-1997",)
    shows = "a hump of the Allan deviation at 0.371 of its period, with dips at whole periods"
    shown_on = "rest for an hour"
    confused_with = {
        "supply_ripple": "another supply: that line goes with it",
        "chamber_ripple": "a sensor in the air",
        "table_jitter": "the table's servo off",
        "gauss_markov": "the spectrum: a line is narrow",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        """One realisation [deg/h], shape (count,)."""
        from fogml.signals.random_noise import sinusoid

        phase = float(rng.uniform(0.0, 2.0 * np.pi))
        return sinusoid(count, sample_s, amplitude, shape["frequency"], phase)
