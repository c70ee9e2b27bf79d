"""A small synthetic chamber and gyro with a known truth, for experiments and tests.

It shares nothing with fogml but the run type: first-order thermal lags, a drift written out
term by term, white noise. Everything it makes is synthetic and says so in its facts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from fogml.arrays import FloatArray
from fogml.runs.facts import Facts
from fogml.runs.run import Run


@dataclass(frozen=True)
class World:
    """One synthetic unit: drift = polynomial(u) + gradient + rate + T*rate terms, u = T - 25 degC.

    `polynomial` in deg/h per degC**k, `gradient` in deg/h/degC, `rate` in deg/h per degC/min,
    `product` in deg/h per degC per degC/min, `noise` the white noise of one sample in deg/h,
    lags in s. `ripple` adds amplitude [deg/h] and period [degC] of a sine in T.
    """

    polynomial: tuple[float, ...] = (0.2, 4e-3, -3e-5, 4e-7)
    gradient: float = 0.05
    rate: float = 0.12
    product: float = 1.5e-3
    noise: float = 0.5
    ripple: tuple[float, float] = (0.0, 40.0)
    lag_case_s: float = 600.0
    lag_coil_s: float = 300.0
    lag_inner_s: float = 400.0
    window_s: float = 64.0

    def drift(self, time: FloatArray, inner: FloatArray, outer: FloatArray) -> FloatArray:
        """The noise-free drift [deg/h], shape (n,), from coil temperatures [degC]."""
        u = inner - 25.0
        slope = block_rate(inner, time, self.window_s)
        amplitude, period = self.ripple
        return (
            np.polynomial.polynomial.polyval(u, self.polynomial)
            + self.gradient * (inner - outer)
            + self.rate * slope
            + self.product * u * slope
            + amplitude * np.sin(2.0 * np.pi * u / period)
        )

    def run(self, chamber: FloatArray, sample_s: float, seed: int, name: str) -> tuple[Run, FloatArray]:
        """A run for a chamber temperature [degC] on a regular grid, and its noise-free drift."""
        case = lag(chamber, self.lag_case_s, sample_s)
        outer = lag(case, self.lag_coil_s, sample_s)
        inner = lag(outer, self.lag_inner_s, sample_s)
        time = sample_s * np.arange(len(chamber))
        drift = self.drift(time, inner, outer)
        noise = self.noise * np.random.default_rng(seed).standard_normal(len(time))
        facts = Facts(unit="synthetic", axis="x", notes="synthetic: made by experiments/synthetic_world.py")
        run = Run(name, {"time": time, "gyro": drift + noise, "T_in": inner, "T_out": outer}, facts)
        return run, drift


def lag(x: FloatArray, time_constant_s: float, sample_s: float) -> FloatArray:
    """First-order lag, exact for an input held over each sample, started at rest."""
    pole = np.exp(-sample_s / time_constant_s)
    out, _ = lfilter([1.0 - pole], [1.0, -pole], x, zi=[pole * x[0]])
    return np.asarray(out)


def block_rate(x: FloatArray, time: FloatArray, window_s: float) -> FloatArray:
    """Mean of the newest window less that of the one before, per minute [1/min]; regular grid.

    The start is padded with the first value, as if the past had been at rest.
    """
    width = max(1, round(window_s / (time[1] - time[0])))
    padded = np.concatenate([np.full(2 * width, x[0]), x])
    total = np.concatenate([[0.0], np.cumsum(padded - x[0])])
    newest = total[2 * width + 1 :] - total[width + 1 : -width]
    before = total[width + 1 : -width] - total[1 : -2 * width]
    return np.asarray((newest - before) / width / (window_s / 60.0))


def programme(steps: list[tuple[str, float, float]], start_degc: float, sample_s: float) -> FloatArray:
    """A chamber programme: ("ramp", to degC, degC/min) and ("soak", minutes, 0) in turn."""
    parts, temperature = [], start_degc
    for kind, first, second in steps:
        if kind == "soak":
            parts.append(np.full(round(first * 60.0 / sample_s), temperature))
        else:
            count = max(1, round(abs(first - temperature) / second * 60.0 / sample_s))
            parts.append(np.linspace(temperature, first, count + 1)[1:])
            temperature = first
    return np.concatenate(parts)


def cycle(rate_degc_min: float, sample_s: float = 1.0, hours: float | None = None) -> FloatArray:
    """25 -> -40 -> 60 -> 25 degC at one rate with soaks; cut or held to `hours` where given."""
    steps = [
        ("soak", 30.0, 0.0),
        ("ramp", -40.0, rate_degc_min),
        ("soak", 90.0, 0.0),
        ("ramp", 60.0, rate_degc_min),
        ("soak", 90.0, 0.0),
        ("ramp", 25.0, rate_degc_min),
        ("soak", 60.0, 0.0),
    ]
    chamber = programme(steps, 25.0, sample_s)
    if hours is None:
        return chamber
    count = round(hours * 3600.0 / sample_s)
    return np.concatenate([chamber, np.full(max(0, count - len(chamber)), chamber[-1])])[:count]
