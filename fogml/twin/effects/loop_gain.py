"""Finite gain and bandwidth of the closed loop."""

from __future__ import annotations

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity
from fogml.twin.responses import met_output, slope_per_s


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

    id = "loop_gain"
    code = "D4"
    title = "Gain of the closed loop"
    amplitude = Quantity(
        "amplitude", "s", (1e-4, 1.6e-3), (3e-5, 4e-4), "time constant at 25 degC", (0.0, 1e3)
    )
    shape = (
        Quantity("power_slope", "dB/(100 degC)", (-3.0, -0.5), (-3.0, -0.5), "of the light", (-100.0, 100.0)),
        Quantity("leak_time", "s", (10.0, 1e5), (10.0, 1e5), "of the integrator", (1e-3, 1e12)),
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
        """Response per second of the time constant [deg/h], shape (n,)."""
        output = met_output(inputs)
        return -self._dimming(inputs, shape["power_slope"]) * (
            slope_per_s(inputs, self.id, output) + output / shape["leak_time"]
        )

    def apply(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The loop's output [deg/h] for an undistorted `output` [deg/h], both of shape (n,)."""
        if amplitude == 0.0:
            return output
        tau = amplitude * self._dimming(inputs, shape["power_slope"])
        gain = 1.0 / (1.0 + tau / shape["leak_time"])
        return inputs.memory.lag(self.id, inputs.time, gain * output, tau * gain)

    def _dimming(self, inputs: Inputs, power_slope: float) -> FloatArray:
        """Light at 25 degC over light now, shape (n,)."""
        return 1.0 / inputs.light.level(inputs.u("T_electronics"), power_slope=power_slope)
