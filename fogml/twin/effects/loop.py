"""The closed loop and its read-out."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.averages import covered_share
from fogml.twin.effect import LoopEffect, ReadoutEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import shared, signed, unsigned
from fogml.twin.responses import slope_per_s


class LoopGain(LoopEffect):
    """First-order closed loop whose gain goes with the light.

    ::

        tau(T) dy/dt = w - y (1 + tau(T) / leak_time),      tau(T) = tau 10**(-power_slope u / 1000)

    w is the rate that the loop meets, y what it gives, u = T_electronics - 25; tau = 1 / (G P_0) = 1 / (2 pi
    bandwidth) is the amplitude and ``power_slope`` the change of the light P_0 [dB per 100 degC], in whose
    place that of ``light_power`` counts where it is on. The integrator's ``leak_time`` makes the finite gain
    at rest: an error of 1 / (1 + leak_time / tau) of the rate, none for a perfect one. `fogml lab rate` reads
    the bandwidth off oscillations. An open loop has an error of -phi_s**2 / 6 and one like P_0 instead.

    Source: linear control (derived); bandwidths of 0.1 to 5 kHz and light changing by 0.5 to 3 dB over
    temperature are engineering ranges.
    """

    code = "D4"
    title = "Gain of the closed loop"
    amplitude = unsigned("s", (1e-4, 1.6e-3), (3e-5, 4e-4), "time constant at 25 degC", 1e3)
    shape = (
        shared("power_slope", "dB/(100 degC)", (-3.0, -0.5), "of the light", (-100.0, 100.0)),
        shared("leak_time", "s", (10.0, 1e5), "of the integrator", (1e-3, 1e12)),
    )
    needs = ("T_electronics", "output")
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "edges of the table rate; with a leak also a scale factor that follows the light"
    shown_on = "a step of the rate within a millisecond"
    confused_with = {
        "logger_skew": "both shift edges of the rate; a skew also shifts temperature against the gyro",
        "averaging": "the shape of an edge: exponential here, straight there",
        "source_wavelength": "the light's power at the detector",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        output = inputs.met_output
        return -self._dimming(inputs, shape["power_slope"]) * (
            slope_per_s(inputs, self.id, output) + output / shape["leak_time"]
        )

    def apply(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        if amplitude == 0.0:
            return output
        tau = amplitude * self._dimming(inputs, shape["power_slope"])
        gain = 1.0 / (1.0 + tau / shape["leak_time"])
        return inputs.memory.lag(self.id, inputs.time, gain * output, tau * gain)

    def _dimming(self, inputs: Inputs, power_slope: float) -> FloatArray:
        """Light at 25 degC over light now, shape (n,)."""
        return 1.0 / inputs.light.level(inputs.u("T_electronics"), power_slope=power_slope)


class Deadband(LoopEffect):
    """Small rates that the loop swallows, locked in by cross-talk of its own modulation.

    ::

        out = sign(w) sqrt(max(w**2 - w_d**2, 0))

    The mean rate of an oscillator that is pulled by w and locked within w_d: nothing comes out within the
    zone, and beyond it the error fades as w_d**2 / (2 w). Only rates near zero show it; with the axis
    up and Earth rate well above w_d there is nearly nothing. The amplitude w_d is all that it has. It is
    0.01 to 1 deg/h; a closed loop with dither comes down to 1e-3 deg/h, several deg/h are those of an old
    design without. The dead zone of IEEE Std 952 is 2 w_d wide, and the threshold, where half of the rate
    shows, is 2 w_d / sqrt(3): `fogml lab rate` reads both.

    Source: Adler, Proceedings of the IRE 34 (1946) 351, for the locked oscillator (literature; mean beat
    rate derived); "Interferometric FOG dead band suppression" (read), whose suppressed designs show none at
    0.001 deg/h; ranges are engineering ones.
    """

    code = "D6"
    place = "electronics"
    title = "Dead zone about zero rate"
    amplitude = unsigned("deg/h", (0.01, 1.0), (1e-3, 0.05), "w_d", 1e3)
    amplitudes = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
    needs = ("output",)
    sources = (
        "R. Adler, Proceedings of the IRE 34 (1946) 351",
        "H. C. Lefevre, The Fiber-Optic Gyroscope",
        "Interferometric FOG dead band suppression",
    )
    shows = "only where the rate is small: axis to east or west, in north seeking, under slow turns"
    shown_on = "four-positions"
    confused_with = {
        "electronic_crosstalk": "a sweep of the rate through zero",
        "sf_asymmetry": "a ladder of rates of both signs, from hundredths of a deg/h up",
        "bias_polynomial": "a sweep of the rate through zero at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h of w_d about its usual size [deg/h], shape (n,), between -1 and 1."""
        usual, met = self.amplitude.typical(), inputs.met_output
        return (self.apply(met, inputs, usual) - met) / usual

    def apply(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        size = np.abs(output)
        # As a product, a small zone costs no digits of a large rate.
        beyond = np.maximum(size - amplitude, 0.0) * (size + amplitude)
        return np.copysign(np.sqrt(beyond), output) if amplitude != 0.0 else output


class FringeJump(LoopEffect):
    """The loop loses its fringe at start-up or under shock and locks m fringes off.

    ::

        out = w + m lambda c / (L D)        from `onset` until the next power-on

    The amplitude m is a whole number of fringes, each 266 deg/s for 1 km on 0.1 m at 1550 nm, of the
    unit's coil else; ``onset`` is the time since power-on, since the first sample where that was long before.
    The sample in which it happens holds its share.

    Source: closed loop's operating points, Lefevre (literature); offset derived.
    """

    code = "D9"
    title = "Fringe jump"
    amplitude = signed("1", (1.0, 10.0), (1.0, 3.0), "m, fringes", 1e4, whole=True)
    shape = (shared("onset", "s", (1.0, 3600.0), "since power-on", (0.0, 1e9), default=905.0),)
    needs = ("powered_on",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a step of the output by whole fringes, hundreds of deg/s, that stays until power is cycled"
    confused_with = {
        "outliers_dropouts": "its length: an outlier is over after a few samples",
        "units_and_gaps": "the table at rest: a wrong unit leaves zero at zero",
        "turn_on_bias": "its size: whole fringes",
    }
    candidate = False
    drawn_per_run = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        time = inputs.time
        step = time - inputs.memory.previous(f"{self.id} time", time)
        step = step * covered_share(step)
        beginning = inputs.memory.first(f"{self.id} first time", time)
        since = np.where(np.isinf(inputs.time_on_s), time - beginning, inputs.time_on_s)
        late = since - shape["onset"]
        share = np.divide(late, step, out=(late > 0.0).astype(np.float64), where=step > 0.0)
        return 3600.0 * inputs.coil.fringe_offset_deg_s * np.clip(share, 0.0, 1.0)


class RateRange(ReadoutEffect):
    """Beyond its range the output stays where it is: feedback or register are at their end.

    ::

        out = w                                                     |w| <= range
        out = sign(w) (range + (1 - A) (|w| - range))               beyond

    ``range`` in deg/s. A is the share of what is beyond that is lost: 1 where the output is held at its end,
    as usual, less where it only flattens. A loop that counts no fringes can't have more than half of one,
    lambda c / (2 L D) = 133 deg/s for the reference coil.

    Source: half a fringe derived, Lefevre (literature); ranges are engineering ones.
    """

    code = "D11"
    title = "Range and saturation"
    amplitude = unsigned("1", (0.9, 1.0), (0.9, 1.0), "A, lost beyond", 1.0, default=1.0)
    shape = (shared("range", "deg/s", (100.0, 500.0), "largest rate", (1e-3, 1e5)),)
    needs = ("output",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope", "IEEE Std 952-1997")
    shows = "fast turns: the output no longer follows the table, of either sign alike"
    shown_on = "turns at 400 deg/s"
    confused_with = {
        "sf_nonlinearity": "a ladder of rates: nothing below the range, all of it above",
        "slew_limit": "a slow approach to the rate: a slew limit then shows nothing",
        "fringe_jump": "back at rest: a jump stays, saturation is gone",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        output = inputs.met_output
        beyond = np.maximum(np.abs(output) - 3600.0 * shape["range"], 0.0)
        return -np.copysign(beyond, output)


class SlewLimit(LoopEffect):
    """A loop whose feedback changes no faster than its slew.

    ::

        out = w + A (y - w),      y follows w with |dy/dt| <= slew

    ``slew`` in deg/s2; A is 1 for a loop that catches up once it can. The phase error, K_S times the rate not
    yet fed back, has to stay within half a fringe: a loop of time constant tau keeps its fringe up to an
    acceleration of pi / (K_S tau), and loses it beyond (`fringe_jump`). Samples much longer than the change
    don't show it.

    Source: linear control with a limit (derived); ranges are engineering ones.
    """

    code = "D12"
    title = "Slew of the closed loop"
    amplitude = unsigned("1", (0.9, 1.0), (0.9, 1.0), "A", 1.0, default=1.0)
    shape = (shared("slew", "deg/s2", (1e3, 1e5), "of the output", (1e-3, 1e9)),)
    needs = ("output",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "fast changes of the rate: straight flanks of the output, of one slope for every size of step"
    shown_on = "a step of the rate within a millisecond"
    confused_with = {
        "loop_gain": "the shape of an edge: straight here, exponential there",
        "averaging": "two steps: the flank's length goes with the step here, and not there",
        "rate_range": "a slow approach to the rate: saturation stays",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        output = inputs.met_output
        return inputs.memory.slew(self.id, inputs.time, output, 3600.0 * shape["slew"]) - output
