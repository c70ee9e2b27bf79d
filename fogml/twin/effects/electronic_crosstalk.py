"""Modulation that leaks into the demodulator."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class ElectronicCrosstalk(BiasEffect):
    """Leakage of the modulation into the demodulator, as it follows electronics and supply.

    ::

        b = e_1 (T_electronics - 25) + e_2 (V - V_0)

    The amplitude is e_1; ``supply_ratio`` is e_2 / e_1. V_0 is the supply at the first sample. What leaks
    weighs the more the less light there is: where ``light_power`` is on, b is over the light left. The
    constant part e_0 is one of the bias itself. Where no supply is recorded to change, nothing tells it from
    whatever else follows the electronics, and where their temperature is not, from `supply_ripple`: a
    diagnosis does not offer it.

    Source: Lefevre (literature); ranges, 0.05 to 1 deg/h (tactical) and 1e-3 to 1e-2 deg/h (navigation)
    over 50 degC, are engineering ones.
    """

    id = "electronic_crosstalk"
    code = "C4"
    place = "electronics"
    title = "Electronic cross-talk"
    amplitude = Quantity(
        "amplitude", "deg/h/degC", (1e-3, 2e-2), (2e-5, 2e-4), "e_1", (-100.0, 100.0), signed=True
    )
    shape = (Quantity("supply_ratio", "degC/V", (-20.0, 20.0), (-20.0, 20.0), "e_2 / e_1", (-1e4, 1e4)),)
    needs = ("T_electronics", "supply")
    told_by = (("supply",), ("T_electronics",))
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias that follows the electronics: self-heating after power-on, then the chamber"
    confused_with = {
        "bias_polynomial": "a power step moves the electronics alone",
        "proper_frequency_mismatch": "a sweep of the modulation frequency",
        "deadband": "a sweep of the rate through zero",
        "warmup_bias": "a ramp of the chamber moves this one too",
        "supply_ripple": "steps of the supply at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/degC [deg/h], shape (n,)."""
        supply = inputs.drive("supply")
        change = supply - inputs.memory.first(f"{self.id} supply", supply)
        u = inputs.u("T_electronics")
        return (u + shape["supply_ratio"] * change) / inputs.light.level(u)
