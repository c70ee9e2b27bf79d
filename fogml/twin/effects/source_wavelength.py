"""Wavelength of the source over temperature."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class SourceWavelength(ScaleFactorEffect):
    """Mean wavelength of the source, which the scale factor is inverse to.

    ::

        s = -alpha_lambda (T_electronics - 25)

    alpha_lambda in ppm/degC: 200 to 400 for a diode without cooler, 2 to 20 with one, 1 to 10 for an
    erbium source, below 1 with its filter or pump controlled. The place is the source's, so it
    follows self-heating.

    Source: US8254416, US7269190 (literature); Lefevre (literature); ranges partly engineering ones.
    """

    id = "source_wavelength"
    code = "D1"
    family = "scale_factor_node"
    place = "optics"
    title = "Wavelength of the source"
    amplitude = Quantity(
        "amplitude", "ppm/degC", (2.0, 400.0), (0.1, 10.0), "alpha_lambda", (-1e3, 1e3), signed=True
    )
    needs = ("T_electronics",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope", "US8254416", "US7269190")
    shows = "a scale factor that follows the electronics: self-heating first, then the chamber"
    confused_with = {
        "coil_expansion": "turn the table during warm-up, when the source heats first, and in soaks",
        "halfwave_voltage": "a sensor on the source and one on the modulator",
        "time_base": "another sensor on the same clock shows a time base",
        "sensor_lag": "at rest: a lag acts on the bias too",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm/degC [ppm], shape (n,)."""
        return -inputs.u("T_electronics")
