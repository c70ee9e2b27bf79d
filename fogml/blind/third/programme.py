"""What chamber, table and supply do: paths that are drawn as a whole, with a valve that pulses to cool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.blind.frame.form import Demands
from fogml.blind.frame.record import FloatArray

Turns = tuple[tuple[float, float, float], ...]
_NODES_S = 30.0


@dataclass(frozen=True)
class Programme:
    """One run's programme.

    Attributes
    ----------
    kind
        Which kind of path.
    path
        Set point every 30 s from the run's beginning on [degC].
    turns
        (start s, stop s, rate deg/s).
    powered_on, duration_s
        s on the run's clock.
    loaded
        Whether the power steps with the clock's quarter hours.
    """

    kind: str
    path: FloatArray
    turns: Turns
    powered_on: float
    duration_s: float
    loaded: bool

    @property
    def text(self) -> str:
        """The chamber's part in words."""
        low, high = float(self.path.min()), float(self.path.max())
        return f"{self.kind} between {low:.0f} and {high:.0f} degC for {self.duration_s / 3600.0:.1f} h"

    def set_point(self, time: FloatArray) -> FloatArray:
        """Set point at times [degC]; held before the run."""
        nodes = _NODES_S * np.arange(len(self.path), dtype=np.float64)
        return np.interp(time, nodes, self.path)


def draw_programme(rng: np.random.Generator, demands: Demands, sample_s: float) -> Programme:
    """A run of 5 to 8 h."""
    duration = float(np.round(rng.uniform(5.0, 8.0) * 3600.0 / sample_s) * sample_s)
    t = _NODES_S * np.arange(int(duration / _NODES_S) + 2, dtype=np.float64)
    kind = "plunges" if demands.shock else str(rng.choice(list(_KINDS)))
    low = float(rng.uniform(-40.0, 0.0))
    path = _KINDS.get(kind, _plunges)(rng, t, low, float(rng.uniform(max(low + 35.0, 38.0), 70.0)))
    turns: Turns = ()
    if demands.turns or demands.slow_turns:
        turns = _turns(rng, duration, sample_s, demands)
    on = 0.0 if demands.power_on or rng.random() < 0.6 else -float(rng.uniform(600.0, 9000.0))
    return Programme(kind, np.clip(path, -42.0, 72.0), turns, on, duration, demands.power_steps)


def static_programme(rng: np.random.Generator, sample_s: float) -> Programme:
    """A run of 5 to 8 h at one temperature, for its noise."""
    duration = float(np.round(rng.uniform(5.0, 8.0) * 3600.0 / sample_s) * sample_s)
    level = np.full(int(duration / _NODES_S) + 2, float(rng.uniform(20.0, 28.0)))
    return Programme("rest", level, (), -15000.0, duration, False)


def _saw(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """Slowly up and quickly down, or the other way round."""
    period, steep = rng.uniform(5000.0, 14000.0), rng.uniform(0.08, 0.3)
    x = (t / period + rng.random()) % 1.0
    wave = np.where(x < 1.0 - steep, x / (1.0 - steep), (1.0 - x) / steep)
    return low + (high - low) * (wave if rng.random() < 0.5 else 1.0 - wave)


def _approaches(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """A new level every hour or so, approached exponentially."""
    found, level = np.empty_like(t), float(rng.uniform(18.0, 28.0))
    aim, left, tau = level, rng.uniform(600.0, 2400.0), 600.0
    for k in range(len(t)):
        if left <= 0.0:
            aim, left = float(rng.uniform(low, high)), float(rng.uniform(2400.0, 7000.0))
            tau = float(rng.uniform(300.0, 1500.0))
        level += (aim - level) * _NODES_S / tau
        left -= _NODES_S
        found[k] = level
    return found


def _plunges(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """From one end to the other as fast as the chamber can, with a long and a short stay."""
    period, share = rng.uniform(7000.0, 13000.0), rng.uniform(0.3, 0.7)
    x = (t / period + rng.uniform(0.0, 0.5)) % 1.0
    return np.where(x < share, low, high)


def _trips(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """A vehicle in and out of a hangar: smooth bumps upon a slow drift."""
    middle, size = 0.5 * (low + high), 0.5 * (high - low)
    waves = [(rng.uniform(4000.0, 30000.0), rng.uniform(0.0, 2 * np.pi), rng.exponential()) for _ in range(4)]
    total = sum(w * np.sin(2 * np.pi * t / p + a) for p, a, w in waves)
    return np.asarray(middle + size * total / np.abs(total).max())


def _growing(rng: np.random.Generator, t: FloatArray, low: float, high: float) -> FloatArray:
    """Swings that grow from turn to turn about the room."""
    period, room = rng.uniform(4000.0, 9000.0), rng.uniform(18.0, 28.0)
    swing = np.sin(2.0 * np.pi * t / period) * (0.2 + 0.8 * t / t[-1])
    return np.where(swing > 0.0, room + (high - room) * swing, room + (room - low) * swing)


_KINDS = {"saw": _saw, "approaches": _approaches, "plunges": _plunges, "trips": _trips, "growing": _growing}


def _turns(rng: np.random.Generator, duration: float, sample_s: float, demands: Demands) -> Turns:
    """Single turns at random times; small, fast or slow ones as the effects ask."""
    turns, t = [], float(sample_s * np.ceil(rng.uniform(200.0, 900.0) / sample_s))
    while t < duration - 300.0:
        if demands.slow_turns and (not demands.turns or rng.random() < 0.5):
            length, rate = rng.uniform(900.0, 4000.0), np.exp(rng.uniform(np.log(0.05), np.log(0.4)))
        elif demands.small_rates:
            length, rate = rng.uniform(60.0, 300.0), np.exp(rng.uniform(np.log(3e-5), np.log(5e-3)))
        else:
            length, rate = rng.uniform(20.0, 120.0), demands.top_rate * rng.beta(1.5, 1.0)
        stop = t + float(sample_s * np.ceil(length / sample_s))
        turns.append((t, min(stop, duration), float(rate * rng.choice([-1.0, 1.0]))))
        t = stop + float(sample_s * np.ceil(rng.exponential(400.0) / sample_s))
    return tuple(turns)
