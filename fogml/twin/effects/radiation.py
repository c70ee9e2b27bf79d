"""Ionising radiation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class Radiation(ScaleFactorEffect):
    """Absorption that radiation induces in the fibre shifts the mean wavelength.

    ::

        eps = c D_e**f,      D_e = p D + (1 - p) q,      dq/dt = dD/dt - q / tau

    eps in ppm of the scale factor, D the absorbed dose [Gy]: the colour centres grow with it, and a share of
    them anneals over hours, so that a dose taken faster leaves more. c in ppm at 1 Gy,
    ``dose_exponent`` f, ``permanent_share`` p and ``annealing_time`` tau. What was absorbed before the
    recording has annealed. The light that is lost besides raises the noise, ``radiation_noise``. Nothing
    without the column ``dose``.

    Source: Jin et al., Science China Technological Sciences 53 (2010) 3056 (read): power law of the
    induced absorption over the dose; annealing of first order and ranges are engineering ones.
    """

    id = "radiation"
    code = "C11"
    title = "Ionising radiation"
    amplitude = Quantity("amplitude", "ppm", (1.0, 30.0), (0.1, 3.0), "c", (-1e5, 1e5), signed=True)
    shape = (
        Quantity("dose_exponent", "1", (0.5, 1.0), (0.5, 1.0), "f", (0.01, 2.0)),
        Quantity("permanent_share", "1", (0.1, 0.7), (0.1, 0.7), "p", (0.0, 1.0)),
        Quantity("annealing_time", "s", (3600.0, 36e4), (3600.0, 36e4), "tau", (1.0, 1e9)),
    )
    needs = ("dose",)
    sources = ("J. Jin et al., Science China Technological Sciences 53 (2010) 3056",)
    shows = "a scale factor error that grows with the dose and comes back in part over hours"
    shown_on = "irradiation for two hours, turning at 10 deg/s"
    confused_with = {
        "radiation_noise": "the mean: noise has none",
        "source_wavelength": "temperature: this one follows the dose alone",
        "ageing": "the table's rate: this one is an error of the scale factor",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm [ppm], shape (n,)."""
        return effective_dose(inputs, self.id, shape) ** shape["dose_exponent"]


def effective_dose(inputs: Inputs, key: str, shape: Mapping[str, float]) -> FloatArray:
    """D_e [Gy], shape (n,): the dose whose colour centres are left; `key` names what is remembered."""
    dose = np.maximum(inputs.drive("dose"), 0.0)
    annealing = dose - inputs.memory.lag(key, inputs.time, dose, shape["annealing_time"])
    share = shape["permanent_share"]
    return np.maximum(share * dose + (1.0 - share) * annealing, 0.0)
