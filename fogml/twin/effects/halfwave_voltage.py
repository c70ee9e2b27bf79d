"""Half-wave voltage of the phase modulator."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class HalfwaveVoltage(ScaleFactorEffect):
    """Half-wave voltage over temperature, as far as the 2 pi loop does not remove it.

    ::

        s = rho a_v (T_electronics - 25) (1 + (1 / rho - 1) exp(-t / tau))

    a_v = dV_pi / V_pi / dT is 300 to 1000 ppm/degC; ``residual`` rho is what the 2 pi loop leaves of it
    once it has converged, with ``time_constant`` tau from each power-on at t = 0. The amplitude is
    rho a_v. Resets come at D Omega / (n lambda), 1.6 Hz at 7.5 deg/h for the reference coil, which
    is what the loop learns from.

    Source: Lefevre (literature); ranges of 0.3 to 30 ppm/degC are engineering ones, split between grades.
    """

    id = "halfwave_voltage"
    code = "D3"
    family = "modulator"
    place = "optics"
    title = "Half-wave voltage of the modulator"
    amplitude = Quantity(
        "amplitude", "ppm/degC", (3.0, 30.0), (0.3, 3.0), "rho a_v", (-1e3, 1e3), signed=True
    )
    shape = (
        Quantity("residual", "1", (1e-3, 3e-2), (1e-3, 3e-2), "left by the 2 pi loop", (1e-6, 1.0)),
        Quantity("time_constant", "s", (1.0, 60.0), (1.0, 60.0), "of the 2 pi loop", (1e-3, 1e5)),
    )
    needs = ("T_electronics", "powered_on")
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a scale factor that follows the modulator, far off in the first seconds after power-on"
    confused_with = {
        "source_wavelength": "turn in the first minute after power-on, off 25 degC: only the loop shows",
        "coil_expansion": "turn the table during warm-up: the modulator heats first",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per ppm/degC of rho a_v [ppm], shape (n,)."""
        unlearned = np.exp(-inputs.time_on_s / shape["time_constant"])
        return inputs.u("T_electronics") * (1.0 + (1.0 / shape["residual"] - 1.0) * unlearned)
