"""The recording: clocks, counts, units, lost samples."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import LoggerEffect, NoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import shared, signed, unsigned
from fogml.twin.responses import slope_per_s


class LoggerSkew(LoggerEffect):
    """The gyro's samples carry the time of other sensors' samples d later.

    ::

        y_recorded(t) = y(t - d),      d = A (1 + growth * hours since the first sample)

    A clock that is 100 ppm off gains 0.36 s an hour; the product A ``growth`` is that. To first order the
    record lacks d dy/dt: edges of the table rate, and b'(T) dT/dt d of a static bias b(T).

    Source: derived; skews of 0.1 to 60 s are an engineering range.
    """

    code = "G10"
    family = "clock_skew"
    place = "logger"
    title = "Skew of the logger's clock"
    amplitude = signed("s", (0.1, 60.0), (0.1, 60.0), "A", 1e5)
    amplitudes = tuple(sorted([0.1, *(sign * 10.0 * 2.0**n for n in range(5) for sign in (-1.0, 1.0))]))
    shape = (shared("growth", "1/h", (0.0, 0.5), "of the skew", (-10.0, 10.0), default=0.0),)
    needs = ("output",)
    sources = ("First-order expansion of a delay",)
    shows = "edges of the table rate; during ramps in proportion to the slope of the static output"
    shown_on = "turns of half a minute"
    confused_with = {
        "sensor_lag": "edges of the table rate show the clock; a power step shows the lag",
        "averaging": "the shape of an edge: averaging makes a ramp of it, a skew shifts it",
        "loop_gain": "a skew also shifts temperature against the gyro",
        "shupe_mohr": "edges of the table rate",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        growing = self._growing(inputs, shape["growth"])
        return -growing * slope_per_s(inputs, self.id, inputs.met_output)

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], linear between samples, shape (n,).

        What lies before the first sample is taken for the first one, what lies after the last one, where d is
        negative, for that.
        """
        delay = amplitude * self._growing(inputs, shape["growth"])
        span = 2.0 * float(np.abs(delay).max(initial=0.0))
        time, held = inputs.memory.recent(f"{self.id} output", inputs.time, output, span)
        if amplitude == 0.0:
            return output
        return np.interp(inputs.time - delay, time, held)

    def ahead_s(self, hours: float, amplitude: float, **shape: float) -> float:
        return max(0.0, -amplitude, -amplitude * (1.0 + shape["growth"] * hours))

    def _growing(self, inputs: Inputs, growth: float) -> FloatArray:
        first = inputs.memory.first(f"{self.id} first", inputs.time)
        return 1.0 + growth / 3600.0 * (inputs.time - first)


class Averaging(LoggerEffect):
    """The logger gives the mean over a window that ends at the time it states.

    ::

        y_recorded(t) = mean of the samples in t - W to t

    W is the amplitude, 1 to 100 s. Samples are means over their interval already, so that of n = W / dt of
    them the mean is the one over W, with white noise lower by sqrt(n): a window of one sample changes
    nothing. To first order it is a delay by half of W - dt, half of W for a long window, which a time
    stamp in the middle would not show.

    Source: derived; 1 to 100 s is an engineering range.
    """

    code = "G11"
    title = "Averaging by the logger"
    amplitude = unsigned("s", (1.0, 100.0), (1.0, 100.0), "W", 1e5)
    needs = ("output",)
    sources = ("First-order expansion of a moving mean",)
    shows = "edges of the table rate become ramps; white noise falls below its slope at short times"
    shown_on = "turns of half a minute"
    confused_with = {
        "logger_skew": "the shape of an edge: averaging makes a ramp of it, a skew shifts it",
        "loop_gain": "the shape of an edge: straight here, exponential there",
        "sensor_lag": "edges of the table rate",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return -0.5 * slope_per_s(inputs, self.id, inputs.met_output)

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The output as logged [deg/h], shape (n,); windows cut by the start take what there is."""
        if amplitude == 0.0 or len(output) == 0:
            return output
        time, held = inputs.memory.recent(f"{self.id} output", inputs.time, output, amplitude)
        total = np.concatenate([[0.0], np.cumsum(held - held[0])])
        stop = np.arange(len(time) - len(output), len(time)) + 1
        # A sample as old as the window has just left it, but for the clock's rounding.
        left = inputs.time - amplitude * (1.0 - 1e-9) + 2.0 * np.spacing(np.abs(inputs.time))
        first = np.searchsorted(time, left, side="left")
        first = np.minimum(first, stop - 1)
        mean = held[0] + (total[stop] - total[first]) / (stop - first)
        return np.where(stop - first == 1, output, mean)


class UnitsAndGaps(LoggerEffect):
    """The gyro's column in another unit or of the other sense than it says.

    ::

        y_recorded = (1 + A) y

    A = -2 for a clockwise axis, 1/3600 - 1 for deg/s taken for deg/h. Gaps and repeated rows, the other
    damage of this kind, leave no trace in the rows that remain; reading a run reports them.

    Source: derived.
    """

    code = "G12"
    title = "Wrong unit or sign"
    amplitude = signed("1", (0.99, 2.0), (0.99, 2.0), "A", 1e5, default=-2.0)
    needs = ("output",)
    sources = ("Logger files",)
    shows = "everywhere, in proportion to the output"
    shown_on = "turns of half a minute"
    confused_with = {
        "sf_asymmetry": "its size: scale factors are not off by a half",
        "fringe_jump": "the table at rest: a jump stays there",
        "coil_expansion": "its size",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return 1.0 * inputs.met_output

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        return (1.0 + amplitude) * output


class OutputCounts(LoggerEffect):
    """The gyro gives whole counts of angle, and what is left over goes on into the next sample.

    ::

        count_k = floor(theta_k / q) - floor(theta_k-1 / q),      theta = integral of output and noise

    q, the amplitude, is the angle of a count [arcsec]. Nothing is lost: after n samples the sum of the counts
    is the angle to within one of them, so the mean rate has no error, and a mean over tau resolves q / tau. A
    simulation then records the column ``gyro`` in counts a sample, with the fact ``scale_factor`` = dt / q
    counts per deg/h. Its noise is that of ``quantisation`` with Q = q / sqrt(12), 1 arcsec being 4.85 urad,
    where noise moves the angle by a count or more a sample; with less of it what is left over beats with the
    rate, as that of a true counter does. A twin that counts states no Q.

    Source: derived; IEEE Std 952, annex C (literature), for its noise; ranges are engineering ones.
    """

    code = "E12"
    title = "Output in counts"
    amplitude = unsigned("arcsec", (0.01, 1.0), (1e-3, 0.1), "q, one count", 1e6)
    conflicts = ("quantisation",)
    gap = 1.5
    """Of the sample interval: what is longer is a gap, and a sample after it as long as usual."""
    sources = ("IEEE Std 952-1997",)
    shows = "whole numbers in the column of the gyro; the Allan deviation at short times, with slope -1"
    shown_on = "rest for an hour"
    confused_with = {
        "quantisation": "that one is its noise alone",
        "angle_random_walk": "the slope of the Allan deviation: -1 here, -1/2 there",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Zeros: what a count leaves over comes with the next one."""
        return np.zeros(len(inputs))

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The rate of the counts [deg/h], shape (n,)."""
        if amplitude == 0.0 or len(output) == 0:
            return output
        step = inputs.time - inputs.memory.previous(f"{self.id} time", inputs.time)
        # The first sample is as long as the next one.
        usual = inputs.memory.first(f"{self.id} step", step[1:] if step[0] <= 0.0 else step)
        if np.isnan(usual):
            # Nothing tells how long a sample is that stands alone: it is no count yet.
            return output
        step = np.where((step > 0.0) & (step <= self.gap * usual), step, usual)
        # 1 deg/h is 1 arcsec per second.
        per_rate = step / amplitude
        angle = inputs.memory.total(f"{self.id} angle", output * per_rate)
        whole = np.floor(angle)
        return (whole - inputs.memory.previous(f"{self.id} whole", whole, 0.0)) / per_rate


class OutliersDropouts(NoiseEffect):
    """Samples that are far off, alone or in short bursts.

    ::

        y = A normal        for a burst that begins with `probability` at each sample

    and lasts ``mean_length`` samples on average: 1 for lone outliers, more for frames that stick at a
    wrong value.

    Source: logger practice; a probability of 1e-6 to 1e-4 is an engineering range.
    """

    code = "E9"
    title = "Outliers and dropouts"
    amplitude = unsigned("deg/h", (10.0, 1000.0), (1.0, 100.0), "standard deviation of their size", 1e9)
    shape = (
        shared("probability", "1", (1e-6, 1e-4), "of a burst at a sample", (0.0, 1.0)),
        shared("mean_length", "1", (1.0, 10.0), "of a burst in samples", (1.0, 1e6)),
    )
    sources = ("IEEE Std 952-1997",)
    shows = "single rows far from their neighbours; reading a run reports them"
    confused_with = {
        "fringe_jump": "its length: a jump stays",
        "thermal_shock": "its length: a slip stays",
        "cable_and_slip_ring": "the table at rest",
    }
    candidate = False

    def draw(
        self, rng: np.random.Generator, count: int, sample_s: float, amplitude: float, **shape: float
    ) -> FloatArray:
        from fogml.signals.random_noise import bursts

        return bursts(rng, count, amplitude, shape["probability"], shape["mean_length"])
