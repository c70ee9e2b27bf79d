"""What a laboratory tells chamber, table and supply to do: one of the programmes that laboratories use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.blind.frame.form import Demands

_COLDEST, _HOTTEST = -40.0, 70.0
Corners = list[tuple[float, float]]
Turns = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Programme:
    """One run's programme.

    Attributes
    ----------
    kind
        Which of the laboratories' programmes.
    corner_s, set_point
        Corners of the set point [s, degC]; straight between.
    turns
        (start s, stop s, rate deg/s).
    loads
        (start s, stop s, factor on the power, step of the supply V).
    powered_on, duration_s
        s on the run's clock.
    """

    kind: str
    corner_s: FloatArray
    set_point: FloatArray
    turns: Turns
    loads: tuple[tuple[float, float, float, float], ...]
    powered_on: float
    duration_s: float

    @property
    def text(self) -> str:
        """The chamber's part in words."""
        low, high = float(self.set_point.min()), float(self.set_point.max())
        return f"{self.kind} from {low:.0f} to {high:.0f} degC in {self.duration_s / 3600.0:.1f} h"


def draw_programme(rng: np.random.Generator, demands: Demands, sample_s: float) -> Programme:
    """A run of 5 to 9 h."""
    duration = float(np.round(rng.uniform(5.0, 9.0) * 3600.0 / sample_s) * sample_s)
    kind = "shocks" if demands.shock else str(rng.choice(list(_PATHS)))
    corners = _PATHS.get(kind, _shocks)(rng, duration)
    t, level = np.array(corners).T
    keep = np.concatenate([[True], np.diff(t) > 1e-6])
    turns: Turns = ()
    if demands.turns:
        turns += _ladder(rng, duration, sample_s, demands)
    if demands.slow_turns:
        turns += _rounds(rng, duration, sample_s)
    powered_on = 0.0 if demands.power_on or rng.random() < 0.5 else -float(rng.uniform(1200.0, 14400.0))
    loads = _loads(rng, duration) if demands.power_steps else ()
    return Programme(
        kind,
        t[keep],
        np.clip(level[keep], _COLDEST, _HOTTEST),
        _apart(turns),
        loads,
        powered_on,
        duration,
    )


def static_programme(rng: np.random.Generator, sample_s: float) -> Programme:
    """A run of 5 to 9 h at one temperature, a long time after power-on, for its noise."""
    duration = float(np.round(rng.uniform(5.0, 9.0) * 3600.0 / sample_s) * sample_s)
    level = float(rng.uniform(20.0, 30.0))
    return Programme("soak", np.array([0.0, duration]), np.array([level, level]), (), (), -18000.0, duration)


def _ends(rng: np.random.Generator) -> tuple[float, float]:
    low = float(rng.uniform(_COLDEST, 5.0))
    return low, float(rng.uniform(max(low + 35.0, 35.0), _HOTTEST))


class _Path:
    """Corners that are added one after another."""

    def __init__(self, level: float) -> None:
        self.corners: Corners = [(0.0, level)]

    @property
    def time(self) -> float:
        return self.corners[-1][0]

    def soak(self, seconds: float) -> None:
        self.corners.append((self.time + seconds, self.corners[-1][1]))

    def go(self, level: float, per_minute: float) -> None:
        change = abs(level - self.corners[-1][1])
        self.corners.append((self.time + max(60.0 * change / per_minute, 1.0), level))


def _staircase(rng: np.random.Generator, duration: float) -> Corners:
    """Steps of equal height with equal soaks, down and up again."""
    low, high = _ends(rng)
    step, dwell, rate = rng.uniform(8.0, 22.0), rng.uniform(1200.0, 3600.0), rng.uniform(0.7, 3.0)
    path = _Path(float(rng.uniform(20.0, 30.0)))
    down = rng.random() < 0.5
    while path.time < duration:
        path.soak(dwell)
        level = path.corners[-1][1] + (-step if down else step)
        if not low <= level <= high:
            down = not down
            level = float(np.clip(level, low, high))
        path.go(level, rate)
    return path.corners


def _triangle(rng: np.random.Generator, duration: float) -> Corners:
    """Ramps to and fro without a soak, the turning points at other levels each time."""
    low, high = _ends(rng)
    rate = float(np.exp(rng.uniform(np.log(0.3), np.log(2.0))))
    path = _Path(float(rng.uniform(20.0, 30.0)))
    path.soak(float(rng.uniform(300.0, 2400.0)))
    down = rng.random() < 0.5
    while path.time < duration:
        inside = rng.uniform(0.0, 0.35) * (high - low)
        path.go(low + inside if down else high - inside, rate)
        down = not down
    return path.corners


def _cold_start(rng: np.random.Generator, duration: float) -> Corners:
    """A long soak at one end, over to the other end, and back to the room."""
    low, high = _ends(rng)
    here, there = (low, high) if rng.random() < 0.5 else (high, low)
    path = _Path(here)
    path.soak(float(rng.uniform(3600.0, 9000.0)))
    path.go(there, float(rng.uniform(0.5, 2.5)))
    path.soak(float(rng.uniform(1800.0, 7200.0)))
    while path.time < duration:
        path.go(float(rng.uniform(15.0, 35.0)), float(rng.uniform(0.5, 2.5)))
        path.soak(float(rng.uniform(1800.0, 5400.0)))
        path.go(float(rng.choice([low, high])), float(rng.uniform(0.5, 2.5)))
    return path.corners


def _day(rng: np.random.Generator, duration: float) -> Corners:
    """A sine with a second one upon it, as days outdoors."""
    t = np.arange(0.0, duration + 60.0, 60.0)
    size, period = rng.uniform(18.0, 32.0), rng.uniform(6000.0, 16000.0)
    more, faster = rng.uniform(2.0, 10.0), rng.uniform(1800.0, 4000.0)
    phase = rng.uniform(0.0, 2.0 * np.pi, 2)
    level = rng.uniform(8.0, 25.0) + size * np.sin(2 * np.pi * t / period + phase[0])
    level = level + more * np.sin(2 * np.pi * t / faster + phase[1])
    return list(zip(t.tolist(), level.tolist()))


def _shocks(rng: np.random.Generator, duration: float) -> Corners:
    """Jumps between two ends with soaks between."""
    low, high = _ends(rng)
    path = _Path(float(rng.uniform(20.0, 30.0)))
    hot = rng.random() < 0.5
    while path.time < duration:
        path.soak(float(rng.uniform(2400.0, 6000.0)))
        path.go(high if hot else low, float(rng.uniform(10.0, 25.0)))
        hot = not hot
    return path.corners


def _wanderings(rng: np.random.Generator, duration: float) -> Corners:
    """Levels at random, each for a time at random."""
    path = _Path(float(rng.uniform(20.0, 30.0)))
    while path.time < duration:
        path.soak(float(rng.exponential(1500.0)) + 200.0)
        path.go(float(rng.uniform(_COLDEST, _HOTTEST)), float(rng.uniform(0.5, 3.0)))
    return path.corners


_PATHS = {
    "staircase": _staircase,
    "triangle": _triangle,
    "cold or hot start": _cold_start,
    "days": _day,
    "shocks": _shocks,
    "wanderings": _wanderings,
}


def _ladder(rng: np.random.Generator, duration: float, sample_s: float, demands: Demands) -> Turns:
    """The same few rates by the clock, whatever the chamber does."""
    count = int(rng.integers(2, 5))
    if demands.small_rates:
        sizes = np.exp(rng.uniform(np.log(3e-5), np.log(5e-3), count))
    else:
        sizes = demands.top_rate * np.geomspace(rng.uniform(0.05, 0.3), 1.0, count)
    dwell = float(sample_s * np.ceil(rng.uniform(30.0, 150.0) / sample_s))
    rest = float(sample_s * np.ceil(rng.uniform(0.0, 60.0) / sample_s))
    every = float(sample_s * np.ceil(rng.uniform(1500.0, 4000.0) / sample_s))
    turns = []
    begin = float(sample_s * np.ceil(rng.uniform(300.0, 1500.0) / sample_s))
    while begin < duration:
        t = begin
        for size in sizes:
            for sign in (1.0, -1.0):
                if t + dwell < duration:
                    turns.append((t, t + dwell, float(sign * size)))
                t += dwell + rest
        begin = max(begin + every, t + sample_s)
    return tuple(turns)


def _rounds(rng: np.random.Generator, duration: float, sample_s: float) -> Turns:
    """The table is indexed from position to position, or goes round steadily with pauses."""
    turns = []
    t = float(sample_s * np.ceil(rng.uniform(200.0, 900.0) / sample_s))
    if rng.random() < 0.5:
        step = float(rng.choice([30.0, 45.0, 60.0, 90.0, 120.0]))
        dwell = float(sample_s * np.ceil(rng.uniform(400.0, 1500.0) / sample_s))
        move = float(sample_s * np.ceil(20.0 / sample_s))
        while t + move < duration:
            turns.append((t, t + move, step / move))
            t += move + dwell
        return tuple(turns)
    while t < duration - 1200.0:
        length = float(sample_s * np.ceil(rng.uniform(1800.0, 5400.0) / sample_s))
        rate = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(0.05), np.log(0.6))))
        turns.append((t, min(t + length, duration), rate))
        t += length + float(sample_s * np.ceil(rng.uniform(300.0, 1800.0) / sample_s))
    return tuple(turns)


def _apart(turns: Turns) -> Turns:
    """In order; of two at once the shorter one goes on."""
    kept: list[tuple[float, float, float]] = []
    for start, stop, rate in sorted(turns, key=lambda turn: turn[1] - turn[0]):
        pieces = [(start, stop)]
        for a, b, _ in kept:
            pieces = [
                piece
                for p, q in pieces
                for piece in ((p, min(q, a)), (max(p, b), q))
                if piece[1] - piece[0] > 1e-6
            ]
        kept += [(p, q, rate) for p, q in pieces]
    return tuple(sorted(kept))


def _loads(rng: np.random.Generator, duration: float) -> tuple[tuple[float, float, float, float], ...]:
    """A load that is switched on for a while, again and again."""
    found = []
    t = float(rng.uniform(1200.0, 4500.0))
    while t < duration - 1200.0:
        stop = t + float(rng.uniform(900.0, 3600.0))
        found.append((t, stop, float(rng.uniform(1.15, 2.0)), float(rng.normal(0.0, 0.4))))
        t = stop + float(rng.uniform(1200.0, 6000.0))
    return tuple(found)
