"""Thermal hysteresis of the scale factor."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class SfHysteresis(ScaleFactorEffect):
    """Rate-independent memory of the scale factor, as that of the bias in ``thermal_hysteresis``.

    ::

        s = A (p - T) / w,      p = min(max(p, T - w), T + w)

    with half width w [degC]. The amplitude A = k w [ppm] is half of the opening of a full loop.

    Source: play operator of hysteresis (literature). Sizes from a published peak-to-peak change over
    temperature of 835 ppm raw and 38 ppm after correction (read), taken as full loops.
    """

    id = "sf_hysteresis"
    code = "D8"
    family = "scale_factor_loops"
    place = "coil"
    title = "Thermal hysteresis of the scale factor"
    amplitude = Quantity(
        "amplitude", "ppm", (10.0, 400.0), (1.0, 20.0), "k times half_width", (-1e5, 1e5), signed=True
    )
    shape = (
        Quantity("half_width", "degC", (3.0, 20.0), (3.0, 20.0), "half width of the loop", (0.01, 200.0)),
    )
    needs = ("T",)
    sources = (
        "A. Visintin, Differential Models of Hysteresis (1994): play operator",
        "Telemetry and Remote Control 46(3) (2025): scale factor over temperature",
    )
    shows = "turns in soaks at equal temperature differ after warming and after cooling"
    confused_with = {
        "thermal_hysteresis": "turning and at rest: this one needs a rate",
        "coil_expansion": "turns at each soak on both branches: expansion is one curve",
        "source_wavelength": "turns at each soak on both branches",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm of k w [ppm], shape (n,), between -1 and 1."""
        temperature = inputs.temperature("T")
        half_width = shape["half_width"]
        return (inputs.memory.play(self.id, temperature, half_width) - temperature) / half_width
