"""Optics of the bias: polarisation, modulation, Kerr effect."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.bases import sine
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import phase, shared, signed


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

    code = "C2"
    family = "wave"
    place = "optics"
    title = "Polarisation non-reciprocity"
    amplitude = signed("deg/h", (0.02, 0.5), (5e-4, 1e-2), "A", 1e3)
    shape = (
        shared("period", "degC", (1.0, 15.0), "in temperature", (0.05, 500.0)),
        phase("phase", "at 25 degC"),
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
        return sine(inputs.u("T_electronics") / shape["period"] + shape["phase"] / 360.0)


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

    code = "C15"
    title = "Polarisation non-reciprocity, two periods"
    amplitude = signed("deg/h", (0.02, 0.5), (5e-4, 1e-2), "A", 1e3)
    shape = (
        shared("period", "degC", (5.0, 15.0), "of the shorter fibre", (0.05, 500.0)),
        shared("second_period", "degC", (1.0, 5.0), "of the longer fibre", (0.05, 500.0)),
        shared("second_share", "1", (0.2, 0.8), "q", (0.0, 1.0)),
        phase("phase", "at 25 degC"),
        phase("second_phase", "at 25 degC"),
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
        u, q = inputs.u("T_electronics"), shape["second_share"]
        first = sine(u / shape["period"] + shape["phase"] / 360.0)
        second = sine(u / shape["second_period"] + shape["second_phase"] / 360.0)
        return (1.0 - q) * first + q * second


class IntensityModulation(BiasEffect):
    """The phase modulator modulates the intensity as well, which demodulates as a phase.

    ::

        b = m cot(phi_b / 2) / K_S,      phi_b = depth / (1 + 1e-6 a_v (T_electronics - 25))

    The two states of the bias modulation have powers in proportion to (1 + m) (1 + cos(phi_b + phi)) and (1
    - m) (1 + cos(phi_b - phi)); their difference vanishes at phi = m (1 + cos phi_b) / sin phi_b, which is
    read as a rate: a deeper modulation takes less of it. m in microradian; ``modulation_depth`` at 25 degC
    in degrees, and ``halfwave_coefficient`` a_v [ppm/degC] by which the modulator's half-wave voltage grows.
    6.56 microradian are 1 deg/h.

    Source: Lefevre (literature) for size, 1e-7 to 1e-6 rad, a tenth of it with a better modulator; form
    for square-wave bias modulation derived.
    """

    code = "C5"
    title = "Spurious intensity modulation"
    amplitude = signed("urad", (0.1, 1.0), (5e-3, 0.05), "m", 1e3)
    shape = (
        shared("modulation_depth", "deg", (90.0, 157.5), "phi_b at 25 degC", (1.0, 175.0)),
        shared("halfwave_coefficient", "ppm/degC", (300.0, 1000.0), "a_v", (-5e3, 5e3)),
    )
    needs = ("T_electronics",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias, nearly linear in the electronics' temperature, that falls with the modulation depth"
    confused_with = {
        "electronic_crosstalk": "change the light's power: only cross-talk changes",
        "bias_polynomial": "a power step moves the electronics alone",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        growth = 1.0 + 1e-6 * shape["halfwave_coefficient"] * inputs.u("T_electronics")
        phase = 1e-6 / np.tan(0.5 * np.radians(shape["modulation_depth"]) / growth)
        return np.asarray(phase / inputs.coil.phase_per_deg_h)


class Kerr(BiasEffect):
    """Two beams of unequal power change the index for each other.

    ::

        b = k_K (P_1 - P_2) (1 - <I**2> / (2 <I>**2)) = A 10**(c (T_electronics - 25) / 10)

    The amplitude A is the bias at 25 degC; it is about zero for a broadband source, whose intensity
    has <I**2> = 2 <I>**2. ``power_coefficient`` c [dB/degC] is that of the light's power, which P_1 - P_2
    follows; where ``light_power`` is on, the light is the one that it states.

    Source: Bergh, Lefevre and Shaw, Optics Letters 7 (1982) 282 (literature); below 1e-3 deg/h with a
    broadband source (engineering).
    """

    code = "C6"
    title = "Kerr effect"
    amplitude = signed("deg/h", (1e-5, 1e-3), (1e-6, 1e-4), "A", 100.0)
    shape = (shared("power_coefficient", "dB/degC", (-0.05, -0.02), "c", (-1.0, 1.0)),)
    needs = ("T_electronics",)
    sources = ("R. A. Bergh, H. C. Lefevre and H. J. Shaw, Optics Letters 7 (1982) 282",)
    shows = "a bias in proportion to the light's power; none with a broadband source"
    confused_with = {
        "electronic_crosstalk": "change the coherence or the power split: only this one changes",
        "bias_polynomial": "change the coherence or the power split",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        # Per 100 degC, as the unit's light has it.
        slope = 100.0 * shape["power_coefficient"]
        return inputs.light.level(inputs.u("T_electronics"), power_slope=slope)


class ProperFrequencyMismatch(BiasEffect):
    """The modulation stays at its frequency while the coil's proper frequency drifts.

    ::

        b = q (f_m / f_p(T) - 1) = q (dn/dT / n + alpha) (T - 25)

    q in deg/h per unit; f_m is the proper frequency at 25 degC, which falls by 7.2 ppm/degC. Another
    f_m adds a constant to the bias.

    Source: proper frequency c / (2 n L) (derived); Lefevre (literature); q before gating of the demodulator
    is an engineering range.
    """

    code = "C7"
    title = "Modulation off the proper frequency"
    amplitude = signed("deg/h", (100.0, 1000.0), (10.0, 100.0), "q", 1e6)
    needs = ("T",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias linear in the coil's temperature"
    confused_with = {
        "bias_polynomial": "a sweep of the modulation frequency",
        "electronic_crosstalk": "a sweep of the modulation frequency",
        "mount_tilt": "a sweep of the modulation frequency, or a yaw of the fixture",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return inputs.coil.proper_frequency_slope * inputs.u("T")
