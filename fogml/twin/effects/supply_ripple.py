"""Supply voltage and its ripple."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.signals.waves import sine
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class SupplyRipple(BiasEffect):
    """The bias follows the supply, and its ripple appears at an alias of its frequency.

    ::

        b = k_dc ((V - V_0) + a sin(2 pi f t + phase))

    The amplitude is k_dc; V_0 is the supply at the first sample. ``ripple`` a is the ripple as the
    samples hold it, k_ac / k_dc times its size after their averaging [V]; ``alias_frequency`` f is
    |f_r - m f_s| [Hz] for a ripple at f_r and samples at f_s. Where no supply is recorded to change, nothing
    tells it from any other line, and a diagnosis does not offer it.

    Source: aliasing of a line (derived); Lefevre (literature); ranges are engineering ones.
    """

    id = "supply_ripple"
    code = "C8"
    family = "supply"
    place = "electronics"
    title = "Supply voltage and ripple"
    amplitude = Quantity("amplitude", "deg/h/V", (0.05, 1.0), (1e-3, 2e-2), "k_dc", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("ripple", "V", (0.04, 0.5), (0.04, 0.5), "a", (0.0, 100.0), default=0.05),
        Quantity("alias_frequency", "Hz", (1e-4, 1e-2), (1e-4, 1e-2), "f", (1e-6, 1e3)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at time 0", (-720.0, 720.0), default=0.0),
    )
    needs = ("supply",)
    told_by = (("supply",),)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a narrow line at the alias frequency, and steps with the supply"
    confused_with = {
        "chamber_pickup": "the line's frequency: the chamber's cycle is its own clock",
        "chamber_ripple": "the line's frequency; a sensor in the chamber's air",
        "electronic_crosstalk": "steps of the supply at constant temperature",
        "sinusoidal": "another supply: this line goes with it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/V [deg/h], shape (n,)."""
        supply = inputs.drive("supply")
        change = supply - inputs.memory.first(f"{self.id} supply", supply)
        return change + shape["ripple"] * sine(
            shape["alias_frequency"] * inputs.time + shape["phase"] / 360.0
        )
