"""Light at the receiver: its power, its noise, and what radiation takes of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import BiasEffect, ScaleFactorEffect, WhiteNoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.optics import phase_noise_to_walk
from fogml.twin.quantities import Quantity, shared, signed, unsigned


class LightPower(BiasEffect):
    """Light that falls off room temperature: noise, gain and cross-talk go with it together.

    ::

        b = e_0 (P_0 / P - 1),      P / P_0 = 10**(power_slope u / 1000 - power_loss |u| / 10)

    u = T_electronics - 25. The demodulated signal is in proportion to the light P, what leaks into it is not:
    the constant cross-talk e_0, the amplitude, weighs the more the less light there is. While this effect is
    on, P is the light of ``arw_physics``, ``loop_gain``, ``electronic_crosstalk`` and ``kerr`` too, in place
    of what each states of its own: noise grows, the loop slows down and cross-talk grows at the same
    temperatures. ``power_loss`` is that of coupling off 25 degC, ``power_slope`` that of source and fibre. A
    noise that the twin states as a number N knows no light; state ``arw_physics`` in its place.

    Source: demodulated signal R P sin(phi_m) against an offset (derived); losses of 0.02 to 0.05 dB/degC and
    0.5 to 3 dB over temperature are engineering ranges.
    """

    code = "C14"
    title = "Light over temperature"
    amplitude = signed("deg/h", (0.05, 1.0), (1e-3, 1e-2), "e_0", 1e3)
    shape = (
        shared("power_loss", "dB/degC", (0.02, 0.05), "off 25 degC", (0.0, 1.0)),
        shared("power_slope", "dB/(100 degC)", (-3.0, -0.5), "of the light", (-100.0, 100.0)),
    )
    needs = ("T_electronics",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "noise, edges of the rate and a bias, all of which are worst at the same temperatures"
    confused_with = {
        "electronic_crosstalk": "the noise: it grows with this one and not with that",
        "bias_polynomial": "the noise, or another light power at constant temperature",
        "arw_physics": "not apart in the noise: this one says how its light goes",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return 1.0 / inputs.light.level(inputs.u("T_electronics"), **shape) - 1.0


class ArwPhysics(WhiteNoiseEffect):
    """Shot, thermal and excess noise of the light at the receiver.

    ::

        S = (2 e I + 4 k T / R_f + I**2 RIN) / (R P_0 sin(phi_m) / 2)**2,      I = R P_0 (1 + cos phi_m) / 2
        RIN = 1.33 lambda**2 / (c dlambda),      N = A sqrt(S / 2) / K_S

    with P_0 = power 10**(-power_loss |T_electronics - 25| / 10), or by the course of ``light_power`` where
    that is on, for the unit's coil and receiver as the twin states them; the source is polarised and Gaussian
    (2 in place of 1.33 for a flat spectrum); ``modulation_depth`` is phi_m and the amplitude A the noise over
    that of physics. At 20 uW N is 1.89e-3, 8.2e-4 and 4.9e-4 deg/sqrt(h) for pi/2, 3 pi/4 and 7 pi/8 with the
    reference coil. Light that falls off room temperature raises N where shot or thermal noise leads, and not
    where excess noise does.

    Source: Lefevre (literature); numbers derived; ranges are engineering ones.
    """

    code = "E8"
    title = "Angle random walk from photon noise"
    amplitude = unsigned("1", (1.0, 3.0), (1.0, 1.5), "over photon noise", 1e4)
    shape = (
        Quantity("power", "uW", (5.0, 50.0), (10.0, 100.0), "P_0 at the receiver at 25 degC", (1e-3, 1e6)),
        shared("modulation_depth", "rad", (1.57, 2.75), "phi_m", (0.01, 3.13)),
        shared("power_loss", "dB/degC", (0.02, 0.05), "of the light off 25 degC", (0.0, 1.0)),
    )
    needs = ("T_electronics",)
    conflicts = ("angle_random_walk",)
    sources = (
        "H. C. Lefevre, The Fiber-Optic Gyroscope",
        "arXiv 2208.11213",
    )
    shows = "the Allan deviation at middle times, with slope -1/2; more off 25 degC unless excess noise leads"
    confused_with = {
        "angle_random_walk": "not apart: this one says where that one comes from",
    }
    candidate = False

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Angle random walk of the unit's coil [deg/sqrt(h)], shape (n,)."""
        depth, power = shape["modulation_depth"], 1e-6 * shape["power"]
        dimmed = power * inputs.light.level(inputs.u("T_electronics"), power_loss=shape["power_loss"])
        receiver = inputs.light.receiver
        return phase_noise_to_walk(receiver.phase_density(inputs.coil, dimmed, depth), inputs.coil)


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

    code = "C11"
    title = "Ionising radiation"
    amplitude = signed("ppm", (1.0, 30.0), (0.1, 3.0), "c", 1e5)
    shape = (
        shared("dose_exponent", "1", (0.5, 1.0), "f", (0.01, 2.0)),
        shared("permanent_share", "1", (0.1, 0.7), "p", (0.0, 1.0)),
        shared("annealing_time", "s", (3600.0, 36e4), "tau", (1.0, 1e9)),
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
        return effective_dose(inputs, self.id, shape) ** shape["dose_exponent"]


def effective_dose(inputs: Inputs, key: str, shape: Mapping[str, float]) -> FloatArray:
    """D_e [Gy], shape (n,): the dose whose colour centres are left; `key` names what is remembered."""
    dose = np.maximum(inputs.drive("dose"), 0.0)
    annealing = dose - inputs.memory.lag(key, inputs.time, dose, shape["annealing_time"])
    share = shape["permanent_share"]
    return np.maximum(share * dose + (1.0 - share) * annealing, 0.0)


class RadiationNoise(WhiteNoiseEffect):
    """White noise that is left to find where radiation darkened the fibre.

    ::

        N = A sqrt(10**(loss D_e**f / 10) - 1)

    with D_e and its parameters as in ``radiation``, and ``loss`` the induced absorption of the coil at 1 Gy
    [dB]. Shot noise has a variance inverse to the light; A is that of the unit's angle random walk which is
    shot noise, so that the two together have the noise of the light that is left.

    Source: shot noise (derived); absorption as in ``radiation``; ranges are engineering ones.
    """

    code = "E10"
    title = "Noise under ionising radiation"
    amplitude = unsigned("deg/sqrt(h)", (2e-3, 5e-2), (1e-4, 2e-3), "A", 1e6)
    shape = (
        shared("loss", "dB", (1e-3, 0.05), "at 1 Gy", (0.0, 10.0)),
        *Radiation.shape,
    )
    needs = ("dose",)
    sources = ("J. Jin et al., Science China Technological Sciences 53 (2010) 3056",)
    shows = "white noise that grows with the dose and comes back in part over hours"
    shown_on = "irradiation for two hours, turning at 10 deg/s"
    confused_with = {
        "angle_random_walk": "before the dose there is that one alone",
        "arw_physics": "temperature: this one follows the dose alone",
    }
    candidate = False

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Noise over that of the light before, shape (n,)."""
        lost = shape["loss"] * effective_dose(inputs, self.id, shape) ** shape["dose_exponent"]
        return np.sqrt(np.expm1(0.1 * np.log(10.0) * lost))
