"""What a run's chamber, table and power supply are told to do: drawn anew for each run."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Demands

_COLDEST, _HOTTEST = -42.0, 72.0


@dataclass(frozen=True)
class Programme:
    """One run's programme.

    Attributes
    ----------
    corner_s, set_point
        Corners of the set point [s, degC]; straight between.
    turns
        (start s, stop s, rate deg/s).
    power_steps
        (start s, stop s, factor on the power, step of the supply V).
    fan_stops
        (start s, stop s).
    powered_on
        s on the run's clock.
    """

    corner_s: FloatArray
    set_point: FloatArray
    turns: tuple[tuple[float, float, float], ...] = ()
    power_steps: tuple[tuple[float, float, float, float], ...] = ()
    fan_stops: tuple[tuple[float, float], ...] = ()
    powered_on: float = 0.0
    duration_s: float = field(default=0.0)

    @property
    def text(self) -> str:
        """The chamber's part in words."""
        words = [f"from {self.set_point[0]:.1f} degC"]
        for k in range(1, len(self.corner_s)):
            minutes = (self.corner_s[k] - self.corner_s[k - 1]) / 60.0
            change = self.set_point[k] - self.set_point[k - 1]
            if abs(change) < 1e-9:
                words.append(f"soak {minutes:.0f} min")
            else:
                words.append(f"to {self.set_point[k]:.1f} degC at {abs(change) / minutes:.2f} degC/min")
        return ", ".join(words)


def draw_programme(rng: np.random.Generator, demands: Demands, sample_s: float) -> Programme:
    """A run of 6 to 10 h: ramps of 0.3 to 3 degC/min either way first, soaks, minor loops."""
    duration = float(np.round(rng.uniform(6.0, 10.0) * 3600.0 / sample_s) * sample_s)
    corners, points, soaks = _chamber_path(rng, duration, demands.shock)
    turns: list[tuple[float, float, float]] = []
    if demands.turns:
        turns += _ladders(rng, _places(rng, corners, soaks, duration), sample_s, demands)
    if demands.slow_turns:
        turns += _slow_turns(rng, duration, sample_s, turns)
    steps = _power_steps(rng, duration) if demands.power_steps else ()
    fans: tuple[tuple[float, float], ...] = ()
    if demands.fan_stops:
        starts = rng.uniform(0.1, 0.9, size=2) * duration
        fans = tuple((float(s), float(s + rng.uniform(900.0, 2400.0))) for s in np.sort(starts))
    powered_on = 0.0 if demands.power_on or rng.random() < 0.6 else -float(rng.uniform(1800.0, 10800.0))
    return Programme(corners, points, tuple(sorted(turns)), steps, fans, powered_on, duration)


def static_programme(rng: np.random.Generator, sample_s: float) -> Programme:
    """A run of 6 to 8 h at room temperature, long after power-on, for its noise."""
    duration = float(np.round(rng.uniform(6.0, 8.0) * 3600.0 / sample_s) * sample_s)
    level = float(rng.uniform(22.0, 28.0))
    return Programme(
        np.array([0.0, duration]), np.array([level, level]), powered_on=-14400.0, duration_s=duration
    )


def _chamber_path(
    rng: np.random.Generator, duration: float, shock: bool
) -> tuple[FloatArray, FloatArray, list[tuple[float, float]]]:
    level = float(rng.uniform(18.0, 30.0))
    corners, points = [0.0], [level]
    soaks: list[tuple[float, float]] = []

    def soak(minutes: float) -> None:
        corners.append(corners[-1] + 60.0 * minutes)
        points.append(points[-1])
        soaks.append((corners[-2], corners[-1]))

    def ramp(target: float, rate: float) -> None:
        corners.append(corners[-1] + 60.0 * abs(target - points[-1]) / rate)
        points.append(target)

    base_rate = float(np.exp(rng.uniform(np.log(0.4), np.log(2.5))))
    soak(float(rng.uniform(5.0, 50.0)))
    down = rng.random() < 0.5
    at_shock = int(rng.integers(0, 3)) if shock else -1
    leg = 0
    while corners[-1] < duration:
        here = points[-1]
        # No room left one way: turn round.
        if here - 20.0 < _COLDEST or here + 20.0 > _HOTTEST:
            down = here + 20.0 > _HOTTEST
        if rng.random() < 0.3 and leg >= 2:
            # A minor loop: back by a part, before the main direction goes on.
            target = here + (1.0 if down else -1.0) * rng.uniform(10.0, 35.0)
        elif down:
            target = rng.uniform(_COLDEST, min(here - 20.0, -5.0))
        else:
            target = rng.uniform(max(here + 20.0, 35.0), _HOTTEST)
        target = float(np.clip(target, _COLDEST, _HOTTEST))
        if abs(target - here) < 5.0:
            continue
        rate = float(np.clip(base_rate * np.exp(rng.normal(0.0, 0.4)), 0.3, 3.0))
        ramp(target, float(rng.uniform(15.0, 30.0)) if leg == at_shock else rate)
        soak(float(rng.uniform(20.0, 110.0)))
        down = points[-1] > 25.0 if rng.random() < 0.8 else not down
        leg += 1
    return np.array(corners), np.array(points), [s for s in soaks if s[1] < duration]


def _places(
    rng: np.random.Generator, corners: FloatArray, soaks: list[tuple[float, float]], duration: float
) -> list[tuple[float, float]]:
    """Soaks of a quarter of an hour and more, and some of the long ramps, for the table to turn in."""
    places = [(a, b) for a, b in soaks if b - a > 900.0]
    spans = set(zip(corners[:-1].tolist(), corners[1:].tolist())) - set(soaks)
    ramps = sorted((a, b) for a, b in spans if b - a > 1800.0 and b < duration)
    return sorted(places + [ramp for ramp in ramps if rng.random() < 0.5])


def _ladders(
    rng: np.random.Generator, places: list[tuple[float, float]], sample_s: float, demands: Demands
) -> list[tuple[float, float, float]]:
    """Up to 4 rates of either sign towards the end of each place; each dwell is whole samples."""
    turns: list[tuple[float, float, float]] = []
    for start, stop in places:
        count = int(rng.integers(2, 5))
        if demands.small_rates:
            # Down to tenths of a deg/h: 1 deg/h is 2.8e-4 deg/s.
            sizes = np.exp(rng.uniform(np.log(3e-5), np.log(5e-3), size=count))
        else:
            sizes = demands.top_rate * rng.uniform(0.1, 1.0, size=count)
        dwell = sample_s * np.ceil(rng.uniform(40.0, 120.0) / sample_s)
        t = sample_s * np.ceil((stop - 2.0 * count * dwell - sample_s) / sample_s)
        signs = (1.0, -1.0) if rng.random() < 0.5 else (-1.0, 1.0)
        for size in sizes:
            for sign in signs:
                if t > start:
                    turns.append((float(t), float(t + dwell), float(sign * size)))
                t += dwell
    return turns


def _slow_turns(
    rng: np.random.Generator, duration: float, sample_s: float, taken: list[tuple[float, float, float]]
) -> list[tuple[float, float, float]]:
    """The table goes round at 0.05 to 0.3 deg/s for half of the time, in stretches, either way."""
    busy = [(start - sample_s, stop + sample_s) for start, stop, _ in taken]
    turns = []
    t = float(sample_s * np.ceil(rng.uniform(300.0, 1800.0) / sample_s))
    while t < duration - 3600.0:
        length = sample_s * np.ceil(rng.uniform(2400.0, 7200.0) / sample_s)
        rate = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.3))
        end = min(t + length, duration)
        for a, b in _free(t, float(end), busy):
            turns.append((a, b, rate))
        t = float(end + sample_s * np.ceil(rng.uniform(600.0, 2400.0) / sample_s))
    return turns


def _free(start: float, stop: float, busy: list[tuple[float, float]]) -> list[tuple[float, float]]:
    parts = [(start, stop)]
    for a, b in busy:
        parts = [
            piece
            for p, q in parts
            for piece in ((p, min(q, a)), (max(p, b), q))
            if piece[1] - piece[0] > 1e-6
        ]
    return parts


def _power_steps(rng: np.random.Generator, duration: float) -> tuple[tuple[float, float, float, float], ...]:
    steps = []
    t = float(rng.uniform(1800.0, 5400.0))
    while t < duration - 2400.0:
        stop = t + float(rng.uniform(1200.0, 4000.0))
        steps.append((t, stop, float(rng.uniform(1.2, 1.7)), float(rng.normal(0.0, 0.5))))
        t = stop + float(rng.uniform(2400.0, 7200.0))
    return tuple(steps)
