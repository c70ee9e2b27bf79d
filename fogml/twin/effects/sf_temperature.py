"""Temperature sensitivity of the scale factor as one number."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class SfTemperature(ScaleFactorEffect):
    """The scale factor over temperature, whatever the cause, as a data sheet states it.

    ::

        s = eps_T u (1 + c u),      u = (T_in + T_out) / 2 - 25

    eps_T is the temperature sensitivity of IEEE Std 952 in ppm/degC, ``curvature`` c in 1/degC: between 25
    degC and T the scale factor changes by eps_T (1 + c u) per degC in the mean. The coil's mean temperature
    counts, as all of its fibre makes the Sagnac phase; with both faces alike, in soaks, it is one with ``k1``
    and ``k2`` of the nominal gyro. `source_wavelength`, `coil_expansion` and `halfwave_voltage` are its
    causes, each with a place of its own. `fogml lab rate` reads eps_T off turns in soaks.

    Source: IEEE Std 952-1997 (literature); ranges are engineering ones.
    """

    id = "sf_temperature"
    code = "D10"
    title = "Temperature sensitivity of the scale factor"
    amplitude = Quantity("amplitude", "ppm/degC", (5.0, 100.0), (0.5, 5.0), "eps_T", (-1e4, 1e4), signed=True)
    shape = (Quantity("curvature", "1/degC", (-5e-3, 5e-3), (-5e-3, 5e-3), "c", (-1.0, 1.0), default=0.0),)
    needs = ("T_in", "T_out")
    sources = ("IEEE Std 952-1997",)
    shows = "turns at several soak temperatures"
    confused_with = {
        "coil_expansion": "not apart: this one is the sum of the causes",
        "source_wavelength": "turn the table during warm-up, when the source heats first, and in soaks",
        "sf_hysteresis": "the rate table at each soak, on both branches",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm/degC [ppm], shape (n,)."""
        u = 0.5 * (inputs.u("T_in") + inputs.u("T_out"))
        return np.asarray(u * (1.0 + shape["curvature"] * u))
