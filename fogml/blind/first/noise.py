"""Thermometers, which lag and step, and the gyro's noise: white, true 1/f by spectral synthesis, random walk.

One-sided densities over f [1/h]: N**2 * 2, B**2 / (pi f), K**2 / (2 pi**2 f**2); the Allan variance is
N**2 / tau + (2 ln 2 / pi) B**2 + K**2 tau / 3 (IEEE Std 952). As states, the flicker is a ladder of
Ornstein-Uhlenbeck processes fitted to its sampled spectrum, which is within 2 % of it in d' (checked
against the dense covariance).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.optimize import nnls

from fogml.arrays import FloatArray
from fogml.blind.frame.noise import States
from fogml.blind.frame.operators import lag
from fogml.blind.frame.record import World
from fogml.blind.frame.thermometers import places_of
from fogml.blind.frame.unit import Instruments, Sensed, Thermometer

_REST, _TURN, _LAGGING = 0.04, 0.3, 0.05
"""What the sensors' noise at rest, in turns, and their lag in turns may add, relative to white noise."""
_SOAK_RATE = 0.1 / 60.0
"""Rate of temperature in the soaks that turns lie in [degC/s]."""


def draw_instruments(
    rng: np.random.Generator, faces: bool, fine: bool, needed: tuple[str, ...]
) -> Instruments:
    """A unit's instruments: what its effects need, and others by chance.

    `faces` asks for both faces of the coil, `fine` for good sensors, `needed` for further columns.
    """
    layout = str(rng.choice(["two", "four"] if faces else ["one", "two", "two", "four"]))
    chance = {"T_case": 0.5, "T_chamber": 0.5, "T_electronics": 0.35, "supply": 0.2, "humidity": 0.2}
    chance |= {"compressor": 0.2, "heater": 0.2, "vibration": 0.15, "power": 0.25}
    others = tuple(name for name, p in chance.items() if (rng.random() < p) | (name in needed))
    others += tuple(name for name in needed if name not in chance)
    noise = float(rng.uniform(0.0005, 0.002) if fine else rng.uniform(0.002, 0.008))
    resolution = float(rng.choice([0.001, 0.001 if fine else 0.01]))
    each = _thermometers(layout, others, float(rng.uniform(0.3, 2.0)))
    return Instruments(layout, others, noise, resolution, each)


def _thermometers(layout: str, others: tuple[str, ...], lag_s: float) -> dict[str, Thermometer]:
    """Thermometers that are off by nothing but their lag; those beside the coil lag three times as much."""
    return {
        name: Thermometer(place, 0.0, 0.0, lag_s * (3.0 if name in others else 1.0))
        for name, place in places_of(layout, others).items()
    }


def finer(tools: Instruments, slope: float, turning_slope: float, white: float) -> Instruments:
    """Sensors so good that a replay's error is lost in the gyro's white noise.

    A lab that measures a better gyro takes better sensors.

    Parameters
    ----------
    tools
        The sensors at hand.
    slope, turning_slope
        What a degree does to a replay's output, rms, at rest and in a fast turn [deg/h/degC].
    white
        The gyro's white noise in a sample, rms [deg/h].
    """
    noise = np.hypot(tools.noise, tools.resolution / np.sqrt(12.0))
    share = min(1.0, _REST * white / (noise * slope), _TURN * white / (noise * turning_slope + 1e-30))
    wanted = tools.resolution * max(share, 1e-3)
    steps = [q for q in (1e-2, 1e-3, 1e-4) if q <= wanted]
    lag_s = next(iter(tools.each.values())).lag_s
    lag_share = min(1.0, _LAGGING * white / (lag_s * _SOAK_RATE * turning_slope + 1e-30))
    each = _thermometers(tools.layout, tools.others, lag_s * lag_share)
    return replace(tools, noise=tools.noise * share, resolution=steps[0] if steps else 1e-5, each=each)


def sense(rng: np.random.Generator, world: World, instruments: Instruments) -> Sensed:
    """The coil's sensors and the further temperatures of one run."""
    felt, noise = {}, {}
    for name, one in instruments.each.items():
        felt[name] = lag(world.sample_s, world.nodes[one.place], one.lag_s)
        noise[name] = instruments.noise * rng.standard_normal(len(world.time))
    return Sensed(felt, noise, instruments)


BASE = {"N": 0.005, "B": 0.01, "K": 0.005}
"""Middles of the log-normal draws: deg/sqrt(h), deg/h, deg/h/sqrt(h)."""
UNITS = {"N": "deg/sqrt(h)", "B": "deg/h", "K": "deg/h/sqrt(h)"}
_PER_DECADE = 1.5
_RECORDS = 8
"""The flicker is cut from a record this many times longer than the run, at least."""


@dataclass(frozen=True)
class NoiseConstants:
    """``N`` deg/sqrt(h), ``B`` deg/h, ``K`` deg/h/sqrt(h)."""

    N: float
    B: float
    K: float

    def scaled(self, rng: np.random.Generator, factor: float) -> NoiseConstants:
        """Each constant times a log-normal draw whose standard deviation is `factor`, cut at two."""
        draws = np.clip(rng.standard_normal(3), -2.0, 2.0) * np.log(factor)
        return NoiseConstants(*(float(v * np.exp(d)) for v, d in zip(asdict(self).values(), draws)))

    def states(self, count: int, sample_s: float, before: int) -> States:
        """Ladder of the flicker and the walk of a run's rows from number `before` on."""
        hours = sample_s / 3600.0
        ladder = flicker_ladder(record_length(count))
        variance = self.B**2 * ladder.variance
        return States(
            decay=np.concatenate([ladder.decay, [1.0]]),
            step=np.concatenate([variance * (1.0 - ladder.decay**2), [self.K**2 * hours]]),
            first=np.concatenate([variance, [self.K**2 * hours * (before + 1)]]),
            white=self.N**2 / hours + self.B**2 * ladder.white,
        )

    def mean_square_of_means(self, count: int, sample_s: float, before: int, width: int) -> float:
        """Expected mean square of means over `width` rows, over all whole blocks [(deg/h)^2]."""
        blocks = count // width
        length = record_length(count)
        half = np.pi * np.arange(1, length // 2 + 1) / length
        means = (np.sin(width * half) / (width * np.sin(half))) ** 2
        flicker = self.B**2 / np.pi * float(np.sum(means / np.arange(1, length // 2 + 1)))
        hours = sample_s / 3600.0
        step = self.K**2 * hours
        first = before + width * np.arange(blocks)
        pair = np.minimum.outer(np.arange(1, width + 1), np.arange(1, width + 1)).mean()
        white = self.N**2 / hours / width
        return float(white + flicker + step * np.mean(first + pair))

    def amounts(self) -> dict[str, tuple[float, str]]:
        """Each constant with its unit."""
        return {name: (value, UNITS[name]) for name, value in asdict(self).items()}


@dataclass(frozen=True)
class Ladder:
    """States of first order, sampled: ``decay`` per sample, stationary ``variance``; and ``white``."""

    decay: FloatArray
    variance: FloatArray
    white: float


def flicker_ladder(length: int) -> Ladder:
    """A ladder for flicker with B = 1, as it is cut from a record of `length` samples."""
    slowest = 0.5 * length
    taus = np.geomspace(0.7, slowest, int(np.ceil(np.log10(slowest / 0.7) * _PER_DECADE)) + 1)
    decay = np.exp(-1.0 / taus)
    f = np.geomspace(1.0 / length, 0.5, 200)
    wanted = 1.0 / (np.pi * f)
    shapes = (1.0 - decay**2) / (1.0 - 2.0 * decay * np.cos(2.0 * np.pi * f)[:, None] + decay**2)
    design = 2.0 * np.concatenate([shapes, np.ones((len(f), 1))], axis=1) / wanted[:, None]
    weights, _ = nnls(design, np.ones(len(f)))
    kept = weights[:-1] > 1e-12
    return Ladder(decay[kept], weights[:-1][kept], float(weights[-1]))


def draw_noise(rng: np.random.Generator) -> NoiseConstants:
    """A unit's noise: log-normal about `BASE` by a factor of 3, as the nominal twin's priors have it."""
    return NoiseConstants(**BASE).scaled(rng, 3.0)


def record_length(count: int) -> int:
    """Samples of the record that the flicker of a run of `count` samples is cut from."""
    return 1 << int(np.ceil(np.log2(_RECORDS * max(count, 2))))


def flicker(rng: np.random.Generator, count: int, coefficient: float) -> FloatArray:
    """Flicker noise with one-sided density B**2 / (pi f) up to the Nyquist frequency, shape (count,).

    Fourier components are independent normal draws of just that density; the mean of the long
    record is zero, that of the part taken from it is not.
    """
    length = record_length(count)
    k = np.arange(1, length // 2 + 1)
    # Density times the spacing of frequencies is the variance of a component: B^2 / (pi k).
    sigma = coefficient / np.sqrt(np.pi * k)
    parts = np.zeros(length // 2 + 1, dtype=np.complex128)
    parts[1:] = sigma * (rng.standard_normal(len(k)) + 1j * rng.standard_normal(len(k)))
    parts[-1] = parts[-1].real
    return np.fft.irfft(0.5 * length * parts, length)[:count]


def draw_series(
    rng: np.random.Generator, count: int, sample_s: float, constants: NoiseConstants
) -> FloatArray:
    """One realisation of all terms [deg/h], shape (count,); the walk starts at zero with the run."""
    hours = sample_s / 3600.0
    white = constants.N / np.sqrt(hours) * rng.standard_normal(count)
    walk = np.cumsum(constants.K * np.sqrt(hours) * rng.standard_normal(count))
    return white + walk + flicker(rng, count, constants.B)
