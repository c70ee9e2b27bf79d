"""What an effect that no candidate describes may look like: the unknown, as groups of columns.

Each group is a kind of cause: a function of temperature, of its rate, of its past, of its direction,
of time, of the table's rate, of the time since the start. The unknown competes with the candidates
as one of the groups, or all of them together, with a ridge over the group's columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fogml.gap.dictionary_table import table_groups
from fogml.gap.group import (
    BANDS_S,
    EDGES_S,
    Group,
    Kind,
    lag,
    shared_differences,
    side_by_side,
    temperature_rate,
)
from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray
from fogml.twin.memory import Memory

LAGS_S = (600.0, 1800.0, 5400.0, 16200.0)
DECAYS_S = (120.0, 400.0, 1200.0, 3600.0, 10800.0)
SLOW_S, MEDIUM_S, FAST_S = 7200.0, 2400.0, 900.0
"""Shortest half-period of each group of cosines in time [s]."""
KNOTS, WAVES = 9, 40
PEAKS = 25
"""Places over the temperatures at which a peak of the response to its rate may lie."""
PRICES = {"gradient": 3.0, "scale_factor": 3.0, "temperature": 3.0, "drives": 2.0}
"""Of kinds that the catalogue is full of [nats]: one of its effects in another form is likelier there than a
cause that nobody knows. Sensors and heat flow between nodes make differences, whatever acts on the scale
factor goes with the rate and some temperature."""
MIXED = ("start", "time", "temperature", "temperature_rate", "direction", "past", "gradient", "table_rate")
"""Groups that may act together."""


def unknown_groups(observations: Sequence[Observation]) -> list[Group]:
    """The groups that these runs can show."""
    temperatures = [o.temperature for o in observations]
    low = min(float(t.min()) for t in temperatures)
    high = max(float(t.max()) for t in temperatures)
    groups = [
        ("time_slow", "drifts slowly with time, on each run in its own way", _own(observations, SLOW_S)),
        ("time_medium", "wanders with time over tens of minutes", _own(observations, MEDIUM_S)),
        ("time_fast", "comes and goes within a quarter of an hour", _own(observations, FAST_S)),
        ("start", "decays from the start of a run or a power-on", _decays(observations)),
        ("time", "drifts with time, the same way on every run", [_drifts(o) for o in observations]),
    ]
    constants = _constants(observations)
    if constants[0].shape[1] > 1:
        groups.append(("power_cycle", "is another constant on each run, or after each power-on", constants))
    if high - low > 2.0:
        half = 0.5 * (high - low)
        u = [(t - 0.5 * (low + high)) / half for t in temperatures]
        groups += [
            ("temperature", "is a function of temperature", [_bumps(x) for x in u]),
            ("temperature_fine", "is periodic in temperature, or jumps with it", [_waves(x) for x in u]),
            ("temperature_rate", "follows the rate of temperature", _rates(observations, u)),
            (
                "temperature_rate_fine",
                "follows the rate of temperature, more at some temperatures than at others",
                [temperature_rate(o)[:, None] * _bumps(x, PEAKS) for o, x in zip(observations, u)],
            ),
            ("direction", "follows the direction of temperature change", _directions(observations, u)),
            ("past", "remembers past temperatures", [_past(o, half) for o in observations]),
            ("heat_flow", "follows how heat flows through the gyro", _heat_flow(observations)),
        ]
    if shared_differences(observations):
        groups.append(
            ("gradient", "follows differences between sensors or their rates", _gradients(observations))
        )
    groups += table_groups(observations)
    drives = _drives(observations)
    if drives is not None:
        groups.append(drives)
    held = [Group(name, words, tuple(columns), PRICES.get(name, 0.0)) for name, words, columns in groups]
    mixed = [g for g in held if g.name in MIXED]
    together = tuple(np.concatenate([g.columns[r] for g in mixed], axis=1) for r in range(len(observations)))
    words = "follows temperature, its rate and its past in a way of its own"
    return [*held, Group("mixed", words, together)]


def _own(observations: Sequence[Observation], half_period_s: float) -> list[FloatArray]:
    """Cosines in time of each run by itself, in columns of its own."""
    parts = []
    for o in observations:
        span = max(float(o.time[-1] - o.time[0]), 1.0)
        count = max(1, min(int(span / half_period_s), len(o) // 4))
        angle = np.pi * (o.time - o.time[0]) / span
        parts.append(np.cos(np.outer(angle, np.arange(1, count + 1))))
    return list(side_by_side(parts))


def _decays(observations: Sequence[Observation]) -> list[FloatArray]:
    """Decays from the start of each run, and from the latest power-on where runs tell it."""
    told = any("time_on" in o.run.columns for o in observations)
    blocks = []
    for o in observations:
        start = o.time - o.time[0]
        since = [start]
        if told:
            since.append(o.averaged(o.run.columns["time_on"]) if "time_on" in o.run.columns else start)
        blocks.append(np.concatenate([np.exp(-s[:, None] / np.array(DECAYS_S)) for s in since], axis=1))
    return blocks


def _constants(observations: Sequence[Observation]) -> list[FloatArray]:
    """Ones from each power-on to the next, on each run in columns of their own."""
    parts = []
    for o in observations:
        since = o.run.columns.get("time_on", o.run.time)
        cycle = np.cumsum(np.diff(since, prepend=since[0]) < 0.0)
        parts.append(np.column_stack([o.averaged((cycle == k).astype(float)) for k in range(cycle[-1] + 1)]))
    return list(side_by_side(parts))


def _drifts(o: Observation) -> FloatArray:
    hours = (o.time - o.time[0]) / 3600.0
    return np.column_stack([hours, hours**2 / 10.0, np.sqrt(hours), np.log1p(3.0 * hours)])


def _bumps(u: FloatArray, count: int = KNOTS) -> FloatArray:
    """Smooth bumps over places from -1 to 1, shape (m, count)."""
    centres = np.linspace(-1.0, 1.0, count)
    return np.exp(-0.5 * ((u[:, None] - centres) * (count - 1) / 2.0 / 0.9) ** 2)


def _waves(u: FloatArray) -> FloatArray:
    """Cosines over the span of temperatures, shape (m, WAVES)."""
    return np.asarray(np.cos(0.5 * np.pi * np.outer(u + 1.0, np.arange(1, WAVES + 1))))


def _rates(observations: Sequence[Observation], u: Sequence[FloatArray]) -> list[FloatArray]:
    blocks = []
    for o, x in zip(observations, u):
        rate = temperature_rate(o)
        size = np.abs(rate)
        slow = lag(o, rate, 600.0)
        blocks.append(
            np.column_stack(
                [rate, rate * x, rate * x**2, rate * x**3, size, size * x, rate * size, slow, rate - slow]
            )
        )
    return blocks


def _directions(observations: Sequence[Observation], u: Sequence[FloatArray]) -> list[FloatArray]:
    blocks = []
    for o, x in zip(observations, u):
        sign = np.tanh(temperature_rate(o) / 0.05)
        held = Memory()
        plays = [held.play(f"{w}", o.temperature, w) - o.temperature for w in (2.0, 6.0, 18.0, 40.0)]
        blocks.append(np.column_stack([sign, sign * x, sign * x**2, *plays, x * plays[1]]))
    return blocks


def _gradients(observations: Sequence[Observation]) -> list[FloatArray]:
    names = shared_differences(observations)
    blocks = []
    for o in observations:
        columns = []
        for name in names:
            difference = o.smooth(name) - o.smooth()
            quick = difference - lag(o, difference, 100.0)
            columns += [difference / 10.0, quick, difference * o.temperature / 500.0]
        blocks.append(np.column_stack(columns))
    return blocks


def _heat_flow(observations: Sequence[Observation]) -> list[FloatArray]:
    """Every temperature in bands of its past: what any linear heat flow is made of."""
    names = shared_differences(observations)
    blocks = []
    for o in observations:
        columns = []
        for t in (o.smooth(), *(o.smooth(name) for name in names)):
            lagged = [t, *(lag(o, t, tau) for tau in BANDS_S)]
            columns += [(a - b) / 10.0 for a, b in pairwise(lagged)]
        blocks.append(np.column_stack(columns))
    return blocks


def _drives(observations: Sequence[Observation]) -> Kind | None:
    """Every other recorded column, its square, its past and its product with temperature."""
    held_by_all = [name for name in observations[0].run.columns if _is_drive(name, observations)]
    widest = {name: max(float(np.ptp(o.run.columns[name])) for o in observations) for name in held_by_all}
    spans = {name: span for name, span in widest.items() if span > 0.0}
    if not spans:
        return None
    blocks = []
    for o in observations:
        columns = []
        for name, span in spans.items():
            held = o.averaged((o.run.columns[name] - o.run.columns[name][0]) / span)
            u = (o.temperature - 25.0) / 50.0
            columns += [held, held**2, held * u, *(lag(o, held, tau) - held for tau in EDGES_S[1:3])]
        blocks.append(np.column_stack(columns))
    return "drives", f"follows the recorded {', '.join(spans)}", blocks


def _is_drive(name: str, observations: Sequence[Observation]) -> bool:
    if name in ("time", "time_on", "gyro", "rate", "angle") or name.startswith("T"):
        return False
    return all(name in o.run.columns for o in observations)


def _past(o: Observation, half: float) -> FloatArray:
    t = o.temperature
    lagged = [(lag(o, t, tau) - t) / half for tau in LAGS_S]
    swing = [lag(o, np.abs(temperature_rate(o)), tau) for tau in LAGS_S[1:]]
    reached = [np.minimum.accumulate(t) / half, np.maximum.accumulate(t) / half]
    return np.column_stack([*lagged, *swing, *reached])
