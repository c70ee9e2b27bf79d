"""The scale factor over temperature and rate."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.bases import sine
from fogml.twin.effect import ScaleFactorEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity, shared, signed


class SourceWavelength(ScaleFactorEffect):
    """Mean wavelength of the source, which the scale factor is inverse to.

    ::

        s = -alpha_lambda (T_electronics - 25)

    alpha_lambda in ppm/degC: 200 to 400 for a diode without cooler, 2 to 20 with one, 1 to 10 for an
    erbium source, below 1 with its filter or pump controlled. The place is the source's, so it
    follows self-heating.

    Source: US8254416, US7269190 (literature); Lefevre (literature); ranges partly engineering ones.
    """

    code = "D1"
    family = "scale_factor_node"
    place = "optics"
    title = "Wavelength of the source"
    amplitude = signed("ppm/degC", (2.0, 400.0), (0.1, 10.0), "alpha_lambda", 1e3)
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
        return -inputs.u("T_electronics")


class CoilExpansion(ScaleFactorEffect):
    """Length and diameter of the warming coil, which the scale factor is proportional to.

    ::

        s = (alpha_L + alpha_D) (T - 25)

    alpha_D is 0.55 ppm/degC for free silica and 5 to 25 on a former or in adhesive, alpha_L 0.5 to 5; a
    navigation gyro has a former of low expansion, which fibre and diameter follow. T stands for the
    coil's mean. It is one with the nominal gyro's own slope of the scale factor.

    Source: Lefevre (literature); ranges partly engineering ones.
    """

    code = "D2"
    place = "coil"
    title = "Expansion of the coil"
    amplitude = Quantity("amplitude", "ppm/degC", (1.0, 30.0), (0.1, 3.0), "alpha_L + alpha_D", (-1e3, 1e3))
    needs = ("T",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a scale factor in proportion to the coil's temperature"
    confused_with = {
        "source_wavelength": "turn the table during warm-up, when the source heats first, and in soaks",
        "halfwave_voltage": "turn the table during warm-up: the modulator heats first",
        "sf_hysteresis": "the rate table at each soak, on both branches",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return inputs.u("T")


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

    code = "D3"
    family = "modulator"
    place = "optics"
    title = "Half-wave voltage of the modulator"
    amplitude = signed("ppm/degC", (3.0, 30.0), (0.3, 3.0), "rho a_v", 1e3)
    shape = (
        shared("residual", "1", (1e-3, 3e-2), "left by the 2 pi loop", (1e-6, 1.0)),
        shared("time_constant", "s", (1.0, 60.0), "of the 2 pi loop", (1e-3, 1e5)),
    )
    needs = ("T_electronics", "powered_on")
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a scale factor that follows the modulator, far off in the first seconds after power-on"
    confused_with = {
        "source_wavelength": "turn in the first minute after power-on, off 25 degC: only the loop shows",
        "coil_expansion": "turn the table during warm-up: the modulator heats first",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        unlearned = np.exp(-inputs.time_on_s / shape["time_constant"])
        return inputs.u("T_electronics") * (1.0 + (1.0 / shape["residual"] - 1.0) * unlearned)


class SfNonlinearity(ScaleFactorEffect):
    """A scale factor error that depends on the size of the rate.

    ::

        s = c ((1 - q) x + q x**2 + r sin(2 pi |Omega| / Omega_q)),      x = |Omega| / (100 deg/s)

    The amplitude is c, the error at 100 deg/s; ``quadratic_share`` q, ``ripple_share`` r and
    ``ripple_period`` Omega_q give its course. The ripple is that of resets and their aliases.

    Source: Lefevre (literature); ranges are engineering ones.
    """

    code = "D5"
    family = "odd_in_rate"
    place = "electronics"
    title = "Non-linearity of the scale factor"
    amplitude = signed("ppm", (50.0, 500.0), (1.0, 20.0), "c", 1e5)
    shape = (
        shared("quadratic_share", "1", (0.0, 1.0), "q", (-10.0, 10.0)),
        shared("ripple_share", "1", (0.0, 0.2), "r", (-10.0, 10.0), default=0.0),
        shared("ripple_period", "deg/s", (5.0, 50.0), "Omega_q", (1e-3, 1e4)),
    )
    needs = ("rate", "earth")
    full_scale_deg_s = 100.0
    """Rate at which the amplitude holds."""
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope", "IEEE Std 952-1997")
    shows = "a ladder of table rates of both signs"
    confused_with = {
        "sf_asymmetry": "rates of both signs: this one is the same for both",
        "table_rate_error": "another table, or a count of whole turns",
        "deadband": "it shows near zero rate, this one far from it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        rate = np.abs(inputs.input_rate_deg_h) / 3600.0
        x = rate / self.full_scale_deg_s
        q = shape["quadratic_share"]
        ripple = sine(rate / shape["ripple_period"])
        return x * (1.0 - q + q * x) + shape["ripple_share"] * ripple


class SfAsymmetry(ScaleFactorEffect):
    """Scale factors of the two directions differ.

    ::

        s = k_a sign(Omega)

    so that K_plus - K_minus is 2 k_a of their mean, and the output gains k_a |Omega|, which looks like a
    bias that grows with the rate. Within about 1 deg/h of zero the sign goes over smoothly, as
    tanh(Omega / (1 deg/h)).

    Source: IEEE Std 952 (literature); ranges are engineering ones.
    """

    code = "D5"
    family = "even_in_rate"
    place = "electronics"
    title = "Asymmetry of the scale factor"
    amplitude = signed("ppm", (10.0, 200.0), (0.5, 10.0), "k_a", 1e5)
    needs = ("rate", "earth")
    turn_over_deg_h = 1.0
    """Rate about which the sign goes over."""
    sources = ("IEEE Std 952-1997", "H. C. Lefevre, The Fiber-Optic Gyroscope")
    shows = "turns of both signs: their sum does not vanish and grows with the rate"
    confused_with = {
        "sf_nonlinearity": "rates of both signs: this one changes sign",
        "deadband": "a ladder of rates of both signs down to a few deg/h",
        "cable_and_slip_ring": "two rates: this one grows with the rate",
        "vibration_rectification": "a vibration sensor on the turning table",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return np.tanh(inputs.input_rate_deg_h / self.turn_over_deg_h)


class TimeBase(ScaleFactorEffect):
    """A crystal whose frequency goes with temperature: where it runs slow, counts per second come out high.

    ::

        s = A ((1 - q) (r x - x**3) + q x**2),      x = (T_electronics - turnover_temperature) / 50

    An AT cut, the usual one, is a cubic about its inflection: A = 13 ppm, from 1.05e-4 ppm/degC3 at 50 degC,
    with ``linear_share`` r by the angle of the cut, fast and slow at turnovers 50 sqrt(r / 3) degC either
    side. The parabola of a tuning fork, -0.034 ppm/degC2, has ``parabolic_share`` q = 1 and A = 85 ppm.
    Smaller A are those of a compensated oscillator.

    Source: Bechmann, Proceedings of the IRE 44 (1956) 1600, for the AT cut; Vig (literature) for both; ranges
    are engineering ones.
    """

    code = "D7"
    title = "Time base"
    amplitude = Quantity("amplitude", "ppm", (5.0, 50.0), (0.5, 5.0), "of the clock 50 degC off", (-1e4, 1e4))
    shape = (
        shared("turnover_temperature", "degC", (20.0, 30.0), "inflection", (-100.0, 200.0)),
        shared("linear_share", "1", (0.0, 1.0), "r, by the angle of the cut", (-10.0, 10.0)),
        shared("parabolic_share", "1", (0.0, 1.0), "q", (0.0, 1.0), default=0.0),
    )
    needs = ("T_electronics",)
    sources = (
        "R. Bechmann, Proceedings of the IRE 44 (1956) 1600",
        "J. R. Vig, Quartz Crystal Resonators and Oscillators",
    )
    shows = "a scale factor error common to all sensors on the clock, for outputs in counts per second"
    confused_with = {
        "source_wavelength": "another sensor on the same clock; counts against a reference clock",
        "coil_expansion": "another sensor on the same clock",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        x = (inputs.temperature("T_electronics") - shape["turnover_temperature"]) / 50.0
        q, square = shape["parabolic_share"], np.square(x)
        return np.asarray((1.0 - q) * x * (shape["linear_share"] - square) + q * square)


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

    code = "D10"
    title = "Temperature sensitivity of the scale factor"
    amplitude = signed("ppm/degC", (5.0, 100.0), (0.5, 5.0), "eps_T", 1e4)
    shape = (shared("curvature", "1/degC", (-5e-3, 5e-3), "c", (-1.0, 1.0), default=0.0),)
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
        u = 0.5 * (inputs.u("T_in") + inputs.u("T_out"))
        return np.asarray(u * (1.0 + shape["curvature"] * u))
