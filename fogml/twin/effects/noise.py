"""Random errors of a stated Allan deviation."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import NoiseEffect, WhiteNoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import URAD_S_IN_DEG_H, amplitude_of
from fogml.twin.quantities import shared, unsigned


class Quantisation(NoiseEffect):
    """The angle is read in whole steps.

    ::

        y = q diff(round(theta / q)) / dt,      q = sqrt(12) Q,      sigma(tau) = sqrt(3) Q / tau

    What rounding leaves over is drawn as uniform and white, as it is for a rate of several steps a sample.
    1 urad is 0.206 arcsec.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E1"
    title = "Quantisation"
    amplitude = amplitude_of("Q")
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at short times, with slope -1"
    shown_on = "rest for an hour"
    confused_with = {
        "angle_random_walk": "the slope of the Allan deviation: -1 here, -1/2 there",
        "sensor_quantisation": "it does not go with temperature",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        from fogml.signals.random_noise import quantisation_noise

        return quantisation_noise(rng, count, sample_s, amplitude * URAD_S_IN_DEG_H)


class AngleRandomWalk(WhiteNoiseEffect):
    """White noise of the rate, which walks the angle.

    ::

        sigma(tau) = N / sqrt(tau)

    with N in deg/sqrt(h) and tau in hours: N / sqrt(dt) for samples of dt.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E2"
    title = "Angle random walk"
    amplitude = amplitude_of("N")
    conflicts = ("arw_physics",)
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at middle times, with slope -1/2"
    shown_on = "rest for an hour"
    confused_with = {
        "quantisation": "the slope of the Allan deviation: -1/2 here, -1 there",
        "gauss_markov": "times beyond its correlation: only then are the two alike",
        "arw_physics": "not apart: that one says where this one comes from",
    }
    candidate = True


class BiasInstability(NoiseEffect):
    """Flicker: noise with a density of 1/f, without end at either side.

    ::

        S(f) = B**2 / (pi f) one-sided,      sigma(tau) = sqrt(2 ln 2 / pi) B = 0.664 B

    A simulation draws it sample after sample, with 1/f down to 1 / (2 pi 1e7 s).

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E3"
    title = "Bias instability"
    amplitude = amplitude_of("B")
    sources = ("IEEE Std 952-1997",)
    shows = "the flat part of the Allan deviation"
    shown_on = "rest for an hour"
    confused_with = {
        "gauss_markov": "two decades of averaging time: that one has a hump",
        "rate_random_walk": "longer times: that one rises",
        "chamber_ripple": "coherence with temperature",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        from fogml.signals.random_noise import flicker_noise

        return flicker_noise(rng, count, amplitude)


class RateRandomWalk(NoiseEffect):
    """The bias walks at random.

    ::

        sigma(tau) = K sqrt(tau / 3)

    with K in deg/h/sqrt(h) and tau in hours. Not to be read from a run whose temperature moves.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E4"
    title = "Rate random walk"
    amplitude = amplitude_of("K")
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at long times, with slope +1/2"
    shown_on = "rest for an hour"
    confused_with = {
        "rate_ramp": "several runs: a ramp is the same in each",
        "bias_instability": "longer times: this one rises",
        "stress_relaxation": "a repeat of the run: relaxation repeats",
        "ageing": "a repeat of the run",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        from fogml.signals.random_noise import random_walk

        # From deg/h/sqrt(h) to deg/h/sqrt(s).
        return random_walk(rng, count, sample_s, amplitude / 60.0)


class RateRamp(NoiseEffect):
    """The bias drifts steadily.

    ::

        y = R t,      sigma(tau) = R tau / sqrt(2)

    with t in hours from the first sample on, of the first run where runs of a unit follow one another. It is
    the same each time, and so in a replay. A thermal ramp that is left looks exactly like it: not to be read
    from a run whose temperature moves.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E5"
    place = "electronics"
    title = "Rate ramp"
    amplitude = amplitude_of("R", signed=True)
    sources = ("IEEE Std 952-1997",)
    shows = "the Allan deviation at long times, with slope +1"
    confused_with = {
        "ageing": "days: ageing slows down",
        "rate_random_walk": "several runs: a ramp is the same in each",
        "bias_polynomial": "a soak of more than 6 h",
        "stress_relaxation": "a soak of more than 6 h: relaxation dies away",
    }
    candidate = True
    steady = True

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Hours since the first sample, shape (n,)."""
        return np.asarray((inputs.time - inputs.memory.first(f"{self.id} start", inputs.time)) / 3600.0)

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        return amplitude * sample_s / 3600.0 * np.arange(count, dtype=np.float64)


class Sinusoidal(NoiseEffect):
    """A line of unknown phase, such as of compressor, table or mains.

    ::

        y = Omega_0 sin(2 pi frequency t + phase)

    with a phase drawn anew for each realisation. The Allan variance is Omega_0**2 (sin(x)**2 / x)**2 with x =
    pi frequency tau, greatest where tan x = 2 x. Samples are means over their interval, so that lines
    above the Nyquist frequency come weakened and aliased.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E6"
    family = "line"
    place = "electronics"
    title = "Sinusoidal noise"
    amplitude = unsigned("deg/h", (0.01, 1.0), (1e-4, 2e-2), "Omega_0", 1e6)
    shape = (shared("frequency", "Hz", (1e-3, 10.0), "of the line", (1e-9, 1e6)),)
    sources = ("IEEE Std 952-1997",)
    shows = "a hump of the Allan deviation at 0.371 of its period, with dips at whole periods"
    shown_on = "rest for an hour"
    confused_with = {
        "supply_ripple": "another supply: that line goes with it",
        "chamber_ripple": "a sensor in the air",
        "table_jitter": "the table's servo off",
        "gauss_markov": "the spectrum: a line is narrow",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        from fogml.signals.random_noise import sinusoid

        phase = float(rng.uniform(0.0, 2.0 * np.pi))
        return sinusoid(count, sample_s, amplitude, shape["frequency"], phase)


class GaussMarkov(NoiseEffect):
    """A first-order Gauss-Markov process.

    ::

        dy/dt = -y / T_c + q_c white(t),      standard deviation A = q_c sqrt(T_c / 2)

    A is the amplitude and ``time_constant`` is T_c. The Allan deviation rises to a hump of 0.437 q_c
    sqrt(T_c) at 1.89 T_c.

    Source: IEEE Std 952, annex C (literature); ranges are engineering ones.
    """

    code = "E7"
    title = "Gauss-Markov noise"
    amplitude = unsigned("deg/h", (0.05, 2.0), (5e-4, 1e-2), "standard deviation", 1e6)
    shape = (shared("time_constant", "s", (10.0, 1e4), "T_c", (1e-6, 1e9)),)
    sources = ("IEEE Std 952-1997",)
    shows = "a hump of the Allan deviation at about twice its correlation time"
    shown_on = "rest for an hour"
    confused_with = {
        "bias_instability": "two decades of averaging time: flicker is flat",
        "sinusoidal": "the spectrum: a line is narrow",
        "rate_random_walk": "longer times: this one falls again",
    }
    candidate = True

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        from fogml.signals.random_noise import gauss_markov

        return gauss_markov(rng, count, sample_s, amplitude, shape["time_constant"])
