"""Polarisation non-reciprocity."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.signals.waves import sine
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class PolarizationNonreciprocity(BiasEffect):
    """Beat of cross-coupled light at the splices of the phase modulator: a ripple over temperature.

    ::

        b = A sin(2 pi (T_electronics - 25) / period + phase),      period = lambda / (L_m |dB/dT|)

    L_m is the fibre's length between the coupling points and dB/dT the slope of its birefringence,
    about 5e-7 per degC: 3.1 degC for 1 m, 10 degC for 0.3 m. One such beat; the place is the
    electronics and pigtails, not the coil.

    Source: Kintner, Optics Letters 6 (1981) 154; Chamoun and Digonnet, Journal of Lightwave
    Technology 33 (2015) 2839; Lefevre (literature). Period derived; ranges are engineering ones.
    """

    id = "polarization_nonreciprocity"
    code = "C2"
    family = "wave"
    place = "optics"
    title = "Polarisation non-reciprocity"
    amplitude = Quantity("amplitude", "deg/h", (0.02, 0.5), (5e-4, 1e-2), "A", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("period", "degC", (1.0, 15.0), (1.0, 15.0), "in temperature", (0.05, 500.0)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at 25 degC", (-720.0, 720.0), default=0.0),
    )
    needs = ("T_electronics",)
    sources = (
        "E. C. Kintner, Optics Letters 6 (1981) 154",
        "J. N. Chamoun and M. J. F. Digonnet, Journal of Lightwave Technology 33 (2015) 2839",
        "H. C. Lefevre, The Fiber-Optic Gyroscope",
    )
    shows = "a ripple over temperature that repeats in soaks and ramps and chirps in time with the rate"
    confused_with = {
        "chamber_ripple": "this one is periodic in temperature, chamber ripple in time",
        "bias_polynomial": "a slow sweep with at least 10 points a period",
        "glass_transition": "that one needs a moving temperature and has a single peak",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        return sine(inputs.u("T_electronics") / shape["period"] + shape["phase"] / 360.0)
