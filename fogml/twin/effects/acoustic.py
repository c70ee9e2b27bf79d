"""Sound in the chamber."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import line


class Acoustic(BiasEffect):
    """Elasto-optic phase of sound at a resonance of the coil, as the samples alias it.

    ::

        b = a fan sin(2 pi t / alias_period + phase),      1 / alias_period = |f - m f_s|

    for a resonance at f, 0.5 to 5 kHz, and samples at f_s; the fan's duty stands for the sound's level. The
    amplitude a is that in the recording with the fan fully on.

    Source: aliasing of a line (derived); ranges are engineering ones.
    """

    id = "acoustic"
    code = "F3"
    title = "Sound in the chamber"
    amplitude = Quantity("amplitude", "deg/h", (1e-3, 0.1), (1e-4, 5e-3), "a", (0.0, 1e5))
    shape = (
        Quantity("alias_period", "s", (30.0, 600.0), (30.0, 600.0), "in the recording", (1e-3, 1e7)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at time 0", (-720.0, 720.0), default=0.0),
    )
    needs = ("fan",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a narrow line that is gone with the fan off"
    confused_with = {
        "table_jitter": "the fan off: only this line goes",
        "supply_ripple": "the fan off at the same supply",
        "chamber_pickup": "the fan off with heater and compressor as they were",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        return inputs.drive("fan") * line(inputs, shape["alias_period"], shape["phase"])
