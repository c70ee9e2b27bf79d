"""Temperature sensors: a small lag, noise, resolution; and what of a run gets recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fogml.blind.first.recurrences import lag
from fogml.blind.frame.record import FloatArray, World

Layout = str
"""``one`` for T, ``two`` for T_in and T_out, ``four`` for T1 to T4."""
_REST, _TURN, _LAGGING = 0.04, 0.3, 0.05
"""What the sensors' noise at rest, in turns, and their lag in turns may add, relative to white noise."""
_SOAK_RATE = 0.1 / 60.0
"""Rate of temperature in the soaks that turns lie in [degC/s]."""


@dataclass(frozen=True)
class Instruments:
    """What is recorded of a unit, and how well.

    Attributes
    ----------
    layout
        Sensors on the coil: ``one``, ``two`` or ``four``.
    others
        Further columns of the run format.
    noise, resolution
        Of the temperature sensors [degC].
    lag_s
        Of the coil's sensors [s].
    """

    layout: Layout
    others: tuple[str, ...]
    noise: float
    resolution: float
    lag_s: float

    @property
    def coil(self) -> dict[str, str]:
        """Recorded coil sensors to the face each sits on."""
        if self.layout == "one":
            return {"T": "T_in"}
        if self.layout == "two":
            return {"T_in": "T_in", "T_out": "T_out"}
        return {"T1": "T_in", "T2": "T_out", "T3": "T_in", "T4": "T_out"}

    @property
    def two_faces(self) -> bool:
        """Whether there is a sensor on the outer face."""
        return self.layout != "one"

    def finer(self, slope: float, turning_slope: float, white: float) -> Instruments:
        """Sensors so good that a replay's error is lost in the gyro's white noise.

        A lab that measures a better gyro takes better sensors.

        Parameters
        ----------
        slope, turning_slope
            What a degree does to a replay's output, rms, at rest and in a fast turn [deg/h/degC].
        white
            The gyro's white noise in a sample, rms [deg/h].
        """
        noise = np.hypot(self.noise, self.resolution / np.sqrt(12.0))
        share = min(1.0, _REST * white / (noise * slope), _TURN * white / (noise * turning_slope + 1e-30))
        wanted = self.resolution * max(share, 1e-3)
        steps = [q for q in (1e-2, 1e-3, 1e-4) if q <= wanted]
        lag_share = min(1.0, _LAGGING * white / (self.lag_s * _SOAK_RATE * turning_slope + 1e-30))
        return replace(
            self,
            noise=self.noise * share,
            resolution=steps[0] if steps else 1e-5,
            lag_s=self.lag_s * lag_share,
        )


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
    return Instruments(
        layout=layout,
        others=others,
        noise=float(rng.uniform(0.0005, 0.002) if fine else rng.uniform(0.002, 0.008)),
        resolution=float(rng.choice([0.001, 0.001 if fine else 0.01])),
        lag_s=float(rng.uniform(0.3, 2.0)),
    )


@dataclass(frozen=True, eq=False)
class Sensed:
    """What the coil's sensors feel before noise and rounding, by recorded name [degC]; and those two."""

    felt: dict[str, FloatArray]
    noise: dict[str, FloatArray]
    resolution: float

    def recorded(self, felt: dict[str, FloatArray] | None = None) -> dict[str, FloatArray]:
        """Recorded columns; of other `felt` temperatures with the same noise, if given."""
        felt = self.felt if felt is None else felt
        q = self.resolution
        return {name: np.round(np.round((x + self.noise[name]) / q) * q, 7) for name, x in felt.items()}


def sense(rng: np.random.Generator, world: World, instruments: Instruments) -> Sensed:
    """The coil's sensors and the further temperatures of one run."""
    places = dict(instruments.coil) | {n: n for n in instruments.others if n.startswith("T_")}
    felt, noise = {}, {}
    for name, place in places.items():
        delay = instruments.lag_s * (1.0 if name in instruments.coil else 3.0)
        felt[name] = lag(world.sample_s, world.nodes[place], delay)
        noise[name] = instruments.noise * rng.standard_normal(len(world.time))
    return Sensed(felt, noise, instruments.resolution)
