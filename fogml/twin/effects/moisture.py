"""Moisture in the coil."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_REFERENCE = 50.0


class Moisture(BiasEffect):
    """Coating and adhesive swell as they take up water.

    ::

        b = S_w dRH_c/dt + S_w0 (RH_c - 50),      dRH_c/dt = (RH - RH_c) / tau

    RH_c is the coil's relative humidity [%], ``time_constant`` tau its delay behind that of the air.
    The amplitude is S_w [deg/h per %/h]; ``static_ratio`` is S_w0 / S_w [1/h].

    Source: moisture-induced strain in gyroscope coils (read): a step of 60 % acts like 1 degC/min over
    15 degC, about 0.1 deg/h; first-order uptake for Fick's law, and ranges, are engineering.
    """

    id = "moisture"
    code = "B11"
    family = "moisture"
    place = "coil"
    title = "Moisture in the coil"
    amplitude = Quantity(
        "amplitude", "deg/h/(%/h)", (5e-3, 5e-2), (5e-4, 5e-3), "S_w", (-100.0, 100.0), signed=True
    )
    shape = (
        Quantity("time_constant", "s", (36e3, 864e3), (36e3, 864e3), "tau", (60.0, 1e8)),
        Quantity("static_ratio", "1/h", (0.0, 0.1), (0.0, 0.1), "S_w0 / S_w", (-10.0, 10.0)),
    )
    needs = ("humidity",)
    sources = ("Moisture-induced strain in fibre-optic gyroscope coils",)
    shows = "a drift over days that follows humidity, which collapses as the chamber cools below dew point"
    confused_with = {
        "stress_relaxation": "a step of humidity, or a dry purge, at constant temperature",
        "ageing": "a step of humidity at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h/(%/h) [deg/h], shape (n,)."""
        air = inputs.drive("humidity")
        coil = inputs.memory.lag(self.id, inputs.time, air, shape["time_constant"])
        uptake = 3600.0 * (air - coil) / shape["time_constant"]
        return uptake + shape["static_ratio"] * (coil - _REFERENCE)
