"""Static bias over temperature of higher order."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class BiasPolynomial(BiasEffect):
    """The orders of the static bias above those of the nominal gyro.

    ::

        b = p_3 (v**3 + r_4 v**4 + r_5 v**5),      v = (T - 25) / 50

    The amplitude is p_3; ``quartic_ratio`` r_4 and ``quintic_ratio`` r_5 are p_4 / p_3 and p_5 / p_3.

    Source: IEEE Std 952-1997 (literature): thermal terms of the output model; ranges, half of a swing
    of 0.5 to 10 deg/h (tactical) and 0.01 to 0.2 deg/h (navigation), are engineering ones.
    """

    id = "bias_polynomial"
    code = "C1"
    family = "static"
    place = "coil"
    title = "Static bias of third to fifth order in temperature"
    amplitude = Quantity("amplitude", "deg/h", (0.25, 5.0), (5e-3, 0.1), "p_3", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("quartic_ratio", "1", (-1.0, 1.0), (-1.0, 1.0), "p_4 / p_3", (-1e3, 1e3)),
        Quantity("quintic_ratio", "1", (-1.0, 1.0), (-1.0, 1.0), "p_5 / p_3", (-1e3, 1e3)),
    )
    needs = ("T",)
    sources = ("IEEE Std 952-1997",)
    shows = "values at soaks on a smooth curve over temperature, the same warming and cooling"
    confused_with = {
        "shupe_mohr": "more than one ramp: in one, temperature, time and rate go together",
        "mount_tilt": "yaw the fixture by 180 deg: only the tilt follows Earth's projection",
        "polarization_nonreciprocity": "a slow sweep with at least 10 points a period",
        "electronic_crosstalk": "a power step moves the electronics alone",
        "thermal_hysteresis": "both branches: a polynomial is one curve",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of p_3 [deg/h], shape (n,)."""
        v = inputs.u("T") / 50.0
        return v * v * v * (1.0 + v * (shape["quartic_ratio"] + v * shape["quintic_ratio"]))
