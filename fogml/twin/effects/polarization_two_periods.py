"""Two polarisation beats over temperature at once."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.signals.waves import sine
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity


class PolarizationTwoPeriods(BiasEffect):
    """Cross-coupled light of two pairs of splices: two ripples over temperature that beat with each other.

    ::

        b = A ((1 - q) sin(2 pi u / period + phase) + q sin(2 pi u / second_period + second_phase))

    u = T_electronics - 25, each period = lambda / (L_m |dB/dT|) as in ``polarization_nonreciprocity``, of the
    lengths of fibre between the two pairs of coupling points, such as 1 m and 0.3 m; ``second_share`` is q.
    The envelope comes back after period second_period / |period - second_period| degC.

    Source: Kintner, Optics Letters 6 (1981) 154; Chamoun and Digonnet, Journal of Lightwave Technology 33
    (2015) 2839; Lefevre (literature). Sum over splices derived; ranges are engineering ones.
    """

    id = "polarization_two_periods"
    code = "C15"
    title = "Polarisation non-reciprocity, two periods"
    amplitude = Quantity("amplitude", "deg/h", (0.02, 0.5), (5e-4, 1e-2), "A", (-1e3, 1e3), signed=True)
    shape = (
        Quantity("period", "degC", (5.0, 15.0), (5.0, 15.0), "of the shorter fibre", (0.05, 500.0)),
        Quantity("second_period", "degC", (1.0, 5.0), (1.0, 5.0), "of the longer fibre", (0.05, 500.0)),
        Quantity("second_share", "1", (0.2, 0.8), (0.2, 0.8), "q", (0.0, 1.0)),
        Quantity("phase", "deg", (0.0, 360.0), (0.0, 360.0), "at 25 degC", (-720.0, 720.0), default=0.0),
        Quantity(
            "second_phase", "deg", (0.0, 360.0), (0.0, 360.0), "at 25 degC", (-720.0, 720.0), default=0.0
        ),
    )
    needs = ("T_electronics",)
    sources = (
        "E. C. Kintner, Optics Letters 6 (1981) 154",
        "J. N. Chamoun and M. J. F. Digonnet, Journal of Lightwave Technology 33 (2015) 2839",
    )
    shows = "a ripple over temperature whose size comes and goes, the same in soaks and ramps"
    confused_with = {
        "polarization_nonreciprocity": "a slow sweep over several periods: two lines in its spectrum, or one",
        "chamber_ripple": "this one is periodic in temperature, chamber ripple in time",
        "bias_polynomial": "a slow sweep with at least 10 points a period",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,)."""
        u, q = inputs.u("T_electronics"), shape["second_share"]
        first = sine(u / shape["period"] + shape["phase"] / 360.0)
        second = sine(u / shape["second_period"] + shape["second_phase"] / 360.0)
        return (1.0 - q) * first + q * second
