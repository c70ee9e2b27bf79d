"""The gyro's random errors: quantisation, white noise, flicker, random walk and ramp (IEEE Std 952).

Allan variances over an averaging time tau::

    Q: 3 Q**2 / tau**2    N: N**2 / tau    B: (2 ln 2 / pi) B**2    K: K**2 tau / 3    R: R**2 tau**2 / 2
"""

from __future__ import annotations

import math
import zlib
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.settings_check import check_whole
from fogml.twin.quantities import Quantity, check_all

URAD_S_IN_DEG_H = math.degrees(1e-6) * 3600.0
"""A rate of one microradian per second [deg/h]."""
_TOP = 1e6
# Steps of a random walk's means over neighbouring samples have variance 2/3 and covariance 1/6.
_NEWEST, _BEFORE = 0.5 * (1.0 + 3.0**-0.5), 0.5 * (1.0 - 3.0**-0.5)

QUANTITIES: tuple[Quantity, ...] = (
    Quantity("Q", "urad", (0.05, 5.0), (0.005, 0.5), "quantisation", (0.0, _TOP)),
    Quantity("N", "deg/sqrt(h)", (5e-3, 0.1), (2e-4, 3e-3), "angle random walk", (0.0, _TOP)),
    Quantity("B", "deg/h", (0.05, 2.0), (5e-4, 1e-2), "bias instability", (0.0, _TOP)),
    Quantity("K", "deg/h/sqrt(h)", (0.02, 1.0), (1e-4, 5e-3), "rate random walk", (0.0, _TOP)),
    Quantity("R", "deg/h/h", (1e-3, 0.1), (1e-5, 1e-3), "rate ramp", (-_TOP, _TOP)),
)
"""Coefficients of the noise terms, with the ranges of the grades."""


def amplitude_of(term: str, **more: Any) -> Quantity:
    """The amplitude of the effect that a noise term is in the catalogue."""
    return replace(next(q for q in QUANTITIES if q.name == term), name="amplitude", meaning=term, **more)


@dataclass(frozen=True)
class NoiseConstants:
    """Coefficients: ``Q`` urad, ``N`` deg/sqrt(h), ``B`` deg/h, ``K`` deg/h/sqrt(h), ``R`` deg/h/h.

    Raises
    ------
    InputError
        If one is not physical.
    """

    Q: float = 0.0
    N: float = 0.0
    B: float = 0.0
    K: float = 0.0
    R: float = 0.0

    def __post_init__(self) -> None:
        check_all(self, QUANTITIES, "noise")

    def as_dict(self) -> dict[str, float]:
        """The coefficients by name."""
        return asdict(self)


TERM_EFFECTS = {
    "quantisation": "Q",
    "angle_random_walk": "N",
    "bias_instability": "B",
    "rate_random_walk": "K",
    "rate_ramp": "R",
}
"""Effects of the catalogue whose amplitude is one of the coefficients."""
NAMES = tuple(field.name for field in fields(NoiseConstants))


def stream(seed: int, name: str) -> np.random.Generator:
    """A generator of its own for a named source, so that adding a source leaves the others alone."""
    return generator(seed, zlib.crc32(name.encode()))


def generator(seed: int, number: int) -> np.random.Generator:
    """The generator of this number out of a seed's."""
    return np.random.default_rng([_checked(seed), number])


def _checked(seed: int) -> int:
    check_whole("seed", seed)
    return seed


class Streams(dict[str, np.random.Generator]):
    """The generators of a kind of source by their names, each made when it is first asked for.

    `kind`, what they are for, is the first word of their names in `stream`.

    Raises
    ------
    InputError
        If the seed is negative.
    """

    def __init__(self, seed: int, kind: str) -> None:
        self._seed, self._kind = _checked(seed), kind

    def __missing__(self, name: str) -> np.random.Generator:
        self[name] = stream(self._seed, f"{self._kind} {name}")
        return self[name]


class NoiseSource:
    """Realisations of all terms, block after block on one clock.

    Parameters
    ----------
    constants
        The coefficients.
    seed
        The same seed gives the same noise, whatever the blocks.
    sample_s
        Sample interval [s]; samples are averages over it.
    source
        What makes the noise; sources of other names are independent of it.
    """

    def __init__(self, constants: NoiseConstants, seed: int, sample_s: float, source: str = "noise") -> None:
        self.constants = constants
        self._sample_s = sample_s
        self._rng = Streams(seed, source)
        self._walked, self._passed = 0.0, 0
        self._angle = float(self._rng["Q"].uniform(-0.5, 0.5)) if constants.Q > 0.0 else 0.0
        self._flicker = None
        if constants.B > 0.0:
            from fogml.signals.random_noise import Flicker

            self._flicker = Flicker(constants.B, sample_s, self._rng["B"])

    def block(self, count: int) -> FloatArray:
        """The next `count` samples [deg/h], shape (count,)."""
        c, hours = self.constants, self._sample_s / 3600.0
        noise = np.zeros(count)
        if self._flicker is not None:
            noise += self._flicker.block(count)
        if c.N > 0.0:
            white = self._rng["N"].standard_normal(count)
            white *= c.N / math.sqrt(hours)
            noise += white
        if c.K > 0.0 and count:
            steps = self._rng["K"].standard_normal(count)
            steps *= c.K * math.sqrt(hours)
            steps[0] += self._walked
            np.cumsum(steps, out=steps)
            before = np.concatenate([[self._walked], steps[:-1]])
            self._walked = float(steps[-1])
            noise += _NEWEST * steps + _BEFORE * before
        if c.R != 0.0:
            noise += c.R * hours * np.arange(self._passed, self._passed + count)
        if c.Q > 0.0 and count:
            # What the angle's last digit leaves over, uniform; the rate takes its difference.
            left = self._rng["Q"].uniform(-0.5, 0.5, count)
            before = np.concatenate([[self._angle], left[:-1]])
            self._angle = float(left[-1])
            noise += math.sqrt(12.0) * c.Q * URAD_S_IN_DEG_H / self._sample_s * (left - before)
        self._passed += count
        return noise
