"""Pick-up of the chamber's heater and compressor."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import line


class ChamberPickup(BiasEffect):
    """Electromagnetic pick-up of the chamber's switching: a bias that follows its machines.

    ::

        b = A (heater + compressor)

    with their duties, 0 to 1. Where neither is recorded they are taken for a cycle of their own,
    (1 + sin(2 pi t / period + phase)) / 2; nothing tells that from any other line, and a diagnosis does not
    offer it.

    Source: interference synchronous with the duty cycle; form and ranges are engineering ones.
    """

    id = "chamber_pickup"
    code = "F4"
    family = "machines"
    place = "chamber"
    title = "Pick-up of the chamber's machines"
    amplitude = Quantity("amplitude", "deg/h", (0.01, 0.5), (5e-4, 1e-2), "A", (-1e4, 1e4), signed=True)
    shape = (
        Quantity("period", "s", (60.0, 900.0), (60.0, 900.0), "of an unrecorded cycle", (0.1, 1e6)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at time 0", (-720.0, 720.0), default=0.0),
    )
    needs = ("compressor", "heater")
    told_by = (("compressor", "heater"),)
    sources = ("IEEE Std 952-1997",)
    shows = "steps and lines in step with heater and compressor, without delay"
    confused_with = {
        "vibration_rectification": "a vibration sensor; heater steps shake nothing",
        "chamber_ripple": "its delay: temperature comes late and smoothed",
        "magnetic": "a field sensor, or the same current in another loop",
        "supply_ripple": "the chamber off at the same supply",
        "acoustic": "heater and compressor off with the fan on",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        if "heater" in inputs.drives or "compressor" in inputs.drives:
            return inputs.drive("heater") + inputs.drive("compressor")
        return 0.5 + 0.5 * line(inputs, shape["period"], shape["phase"])
