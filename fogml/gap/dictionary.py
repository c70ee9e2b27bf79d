"""What an effect that no candidate describes may look like: the unknown, as groups of columns.

Each group is a kind of cause: a function of temperature, of its rate, of its past, of its direction,
of time, of the table's rate, of the time since the start. The unknown competes with the candidates
as one of the groups, or all of them together, with a ridge over the group's columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray
from fogml.twin.memory import Memory

LAGS_S = (600.0, 1800.0, 5400.0, 16200.0)
DECAYS_S = (120.0, 400.0, 1200.0, 3600.0, 10800.0)
SLOW_S, MEDIUM_S, FAST_S = 7200.0, 2400.0, 900.0
"""Shortest half-period of each group of cosines in time [s]."""
EDGES_S = (30.0, 120.0, 600.0, 2400.0)
BANDS_S = (30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)
"""Time constants between which past temperatures are told apart [s]."""
KNOTS = 9
WAVES = 40
MIXED = ("start", "time", "temperature", "temperature_rate", "direction", "past", "gradient", "table_rate")
"""Groups that may act together."""


@dataclass(frozen=True)
class Group:
    """A kind of unknown.

    Attributes
    ----------
    name
        Of the kind.
    looks_like
        In plain words.
    columns
        For each run the columns [deg/h], shape (m, k); of no particular size.
    price
        What having looked for it in the data costs its evidence [nats].
    """

    name: str
    looks_like: str
    columns: tuple[FloatArray, ...]
    price: float = 0.0


def unknown_groups(observations: Sequence[Observation]) -> list[Group]:
    """The groups that these runs can show."""
    temperatures = [o.temperature for o in observations]
    low = min(float(t.min()) for t in temperatures)
    high = max(float(t.max()) for t in temperatures)
    groups = [
        ("time_slow", "drifts slowly with time, on each run in its own way", _own(observations, SLOW_S)),
        ("time_medium", "wanders with time over tens of minutes", _own(observations, MEDIUM_S)),
        ("time_fast", "comes and goes within a quarter of an hour", _own(observations, FAST_S)),
        ("start", "decays from the start of a run", [_decays(o) for o in observations]),
        ("time", "drifts with time, the same way on every run", [_drifts(o) for o in observations]),
    ]
    if high - low > 2.0:
        half = 0.5 * (high - low)
        u = [(t - 0.5 * (low + high)) / half for t in temperatures]
        groups += [
            ("temperature", "is a function of temperature", [_bumps(x) for x in u]),
            ("temperature_fine", "is periodic in temperature, or jumps with it", [_waves(x) for x in u]),
            ("temperature_rate", "follows the rate of temperature", _rates(observations, u)),
            ("direction", "follows the direction of temperature change", _directions(observations, u)),
            ("past", "remembers past temperatures", [_past(o, half) for o in observations]),
            ("heat_flow", "follows how heat flows through the gyro", _heat_flow(observations)),
        ]
    if all(_differences(o) for o in observations):
        groups.append(
            ("gradient", "follows differences between sensors or their rates", _gradients(observations))
        )
    if any(np.any(o.run.rate) for o in observations):
        groups += [
            ("table_rate", "follows the table's rate", _table(observations, temperatures)),
            (
                "scale_factor",
                "is a scale factor that goes with past temperatures or other places",
                _scale_factor(observations),
            ),
        ]
    for name, words, columns in (_angles(observations), _drives(observations)):
        if columns:
            groups.append((name, words, columns))
    held = [Group(name, words, tuple(columns)) for name, words, columns in groups]
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


def side_by_side(parts: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
    """Columns of each run by itself, zero on the others, shape (m_r, all columns) each."""
    starts = np.cumsum([0, *(part.shape[1] for part in parts)])
    blocks = []
    for part, first in zip(parts, starts):
        block = np.zeros((len(part), int(starts[-1])))
        block[:, first : first + part.shape[1]] = part
        blocks.append(block)
    return tuple(blocks)


def _decays(o: Observation) -> FloatArray:
    return np.exp(-np.subtract.outer(o.time, o.time[0])[:, None] / np.array(DECAYS_S))


def _drifts(o: Observation) -> FloatArray:
    hours = (o.time - o.time[0]) / 3600.0
    return np.column_stack([hours, hours**2 / 10.0, np.sqrt(hours), np.log1p(3.0 * hours)])


def _bumps(u: FloatArray) -> FloatArray:
    """Smooth bumps over the temperatures, shape (m, KNOTS)."""
    centres = np.linspace(-1.0, 1.0, KNOTS)
    return np.exp(-0.5 * ((u[:, None] - centres) * (KNOTS - 1) / 2.0 / 0.9) ** 2)


def _waves(u: FloatArray) -> FloatArray:
    """Cosines over the span of temperatures, shape (m, WAVES)."""
    return np.asarray(np.cos(0.5 * np.pi * np.outer(u + 1.0, np.arange(1, WAVES + 1))))


def _rates(observations: Sequence[Observation], u: Sequence[FloatArray]) -> list[FloatArray]:
    blocks = []
    for o, x in zip(observations, u):
        rate = _rate(o)
        size = np.abs(rate)
        slow = _lag(o, rate, 600.0)
        blocks.append(
            np.column_stack(
                [rate, rate * x, rate * x**2, rate * x**3, size, size * x, rate * size, slow, rate - slow]
            )
        )
    return blocks


def _directions(observations: Sequence[Observation], u: Sequence[FloatArray]) -> list[FloatArray]:
    blocks = []
    for o, x in zip(observations, u):
        sign = np.tanh(_rate(o) / 0.05)
        held = Memory()
        plays = [held.play(f"{w}", o.temperature, w) - o.temperature for w in (2.0, 6.0, 18.0, 40.0)]
        blocks.append(np.column_stack([sign, sign * x, sign * x**2, *plays, x * plays[1]]))
    return blocks


def _differences(o: Observation) -> list[str]:
    """Temperatures besides the leading one, for their differences from it."""
    names = ("T_out", "T_case", "T_electronics", "T_chamber")
    held = [name for name in names if name in o.run.columns]
    if "T_out" not in held and "T2" in o.run.columns:
        held.insert(0, "T_out")
    return held


def _gradients(observations: Sequence[Observation]) -> list[FloatArray]:
    names = _shared_differences(observations)
    blocks = []
    for o in observations:
        columns = [np.zeros(len(o))]
        for name in names:
            difference = o.smooth(name) - o.smooth()
            quick = difference - _lag(o, difference, 100.0)
            columns += [difference / 10.0, quick, difference * o.temperature / 500.0]
        blocks.append(np.column_stack(columns))
    return blocks


def _shared_differences(observations: Sequence[Observation]) -> list[str]:
    held = [_differences(o) for o in observations]
    return [name for name in held[0] if all(name in names for names in held)]


def _heat_flow(observations: Sequence[Observation]) -> list[FloatArray]:
    """Every temperature in bands of its past: what any linear heat flow is made of."""
    names = _shared_differences(observations)
    blocks = []
    for o in observations:
        columns = []
        for t in (o.smooth(), *(o.smooth(name) for name in names)):
            lagged = [t, *(_lag(o, t, tau) for tau in BANDS_S)]
            columns += [(a - b) / 10.0 for a, b in pairwise(lagged)]
        blocks.append(np.column_stack(columns))
    return blocks


def _scale_factor(observations: Sequence[Observation]) -> list[FloatArray]:
    """The rate times past temperatures, free of the readings' noise that the nominal replay holds too."""
    names = _shared_differences(observations)
    top = max(float(np.abs(o.run.rate).max()) for o in observations)
    blocks = []
    for o in observations:
        rate, t = o.averaged(o.run.rate) / top, _lag(o, o.temperature, BANDS_S[1])
        held = [_lag(o, o.temperature, tau) - t for tau in BANDS_S[2:]]
        held += [_lag(o, o.averaged(o.run.temperature(name)), BANDS_S[1]) - t for name in names]
        plays = Memory()
        held += [plays.play(f"{w}", t, w) - t for w in (4.0, 16.0)]
        blocks.append(np.column_stack([rate * h / 10.0 for h in held]))
    return blocks


def _angles(observations: Sequence[Observation]) -> tuple[str, str, list[FloatArray]]:
    """Harmonics of the table's angle, recorded or followed from its rate, steady or over temperature."""
    blocks = []
    for o in observations:
        recorded = o.run.columns.get("angle")
        steps = np.diff(o.run.time, prepend=o.run.time[0])
        turned = np.radians(np.cumsum(o.run.rate * steps) if recorded is None else recorded)
        u = (o.temperature - 25.0) / 50.0
        waves = [o.averaged(of(k * turned)) for k in (1, 2, 3) for of in (np.cos, np.sin)]
        blocks.append(np.column_stack([*waves, *(w * u for w in waves[:2]), *(w * u**2 for w in waves[:2])]))
    moved = any(np.ptp(block[:, :2], axis=0).max() > 1e-3 for block in blocks)
    return "angle", "goes with the table's angle", blocks if moved else []


def _drives(observations: Sequence[Observation]) -> tuple[str, str, list[FloatArray]]:
    """Every other recorded column, its square, its past and its product with temperature."""
    held_by_all = [name for name in observations[0].run.columns if _is_drive(name, observations)]
    widest = {name: max(float(np.ptp(o.run.columns[name])) for o in observations) for name in held_by_all}
    spans = {name: span for name, span in widest.items() if span > 0.0}
    if not spans:
        return "drives", "", []
    blocks = []
    for o in observations:
        columns = []
        for name, span in spans.items():
            held = o.averaged((o.run.columns[name] - o.run.columns[name][0]) / span)
            u = (o.temperature - 25.0) / 50.0
            columns += [held, held**2, held * u, *(_lag(o, held, tau) - held for tau in EDGES_S[1:3])]
        blocks.append(np.column_stack(columns))
    return "drives", f"follows the recorded {', '.join(spans)}", blocks


def _is_drive(name: str, observations: Sequence[Observation]) -> bool:
    if name in ("time", "gyro", "rate", "angle") or name.startswith("T"):
        return False
    return all(name in o.run.columns for o in observations)


def _past(o: Observation, half: float) -> FloatArray:
    t = o.temperature
    lagged = [(_lag(o, t, tau) - t) / half for tau in LAGS_S]
    swing = [_lag(o, np.abs(_rate(o)), tau) for tau in LAGS_S[1:]]
    reached = [np.minimum.accumulate(t) / half, np.maximum.accumulate(t) / half]
    return np.column_stack([*lagged, *swing, *reached])


def _table(observations: Sequence[Observation], temperatures: Sequence[FloatArray]) -> list[FloatArray]:
    top = max(float(np.abs(o.run.rate).max()) for o in observations)
    blocks = []
    for o, t in zip(observations, temperatures):
        rate = o.averaged(o.run.rate) / top
        size = np.abs(rate)
        u = (t - 25.0) / 50.0
        hours = (o.time - o.time[0]) / 36000.0
        direct = [size, rate**2, rate**3, np.sign(np.round(rate, 6)), size * u, rate * u**3]
        after = [_lag(o, rate, tau) - rate for tau in EDGES_S] + [
            _lag(o, size, tau) - size for tau in EDGES_S
        ]
        blocks.append(np.column_stack([*direct, rate * _lag(o, _rate(o), 100.0), rate * hours, *after]))
    return blocks


def _lag(o: Observation, values: FloatArray, time_constant_s: float) -> FloatArray:
    """A first-order lag of a series of rows, shape (m,)."""
    return Memory().lag("lag", o.time, values, time_constant_s)


def _rate(o: Observation) -> FloatArray:
    """Rate of the temperature over a minute or so [degC/min], shape (m,)."""
    # Of readings as they are the nominal replay holds the noise as well.
    return 60.0 * (o.smooth() - _lag(o, o.smooth(), 100.0)) / 100.0
