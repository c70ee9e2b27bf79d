"""Causes that no catalogue holds, as families: smooth in time, or functions of what moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from fogml.gap.families.family import Block, Family
from fogml.gap.families.places import Scene, lag, rate
from fogml.gap.families.rows import Rows
from fogml.gap.families.thermal_families import bumps
from fogml.runs.run import FloatArray

TIMES_S = (7200.0, 2400.0, 900.0, 400.0)
"""Shortest half periods of what is smooth in time [s]."""
STEPS, SINGLE_STEPS = 40, 24
"""Steps of a run that are many, and places of a single one."""
TEMPERATURE_BUMPS = (25, 60)
PAST_S = (600.0, 1800.0, 5400.0, 16200.0)
DIRECTION_DEGC_MIN = 0.05
"""Rates under this are no direction."""
Constants = Mapping[str, float]


def _smooth(half_period_s: float, rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    span = float(rows.end_s[-1] - rows.end_s[0]) + rows.row_s
    longest = max(float(r.end_s[-1] - r.end_s[0]) + r.row_s for r in scene.runs[: scene.fitted])
    count = max(int(longest / half_period_s), 2)
    phase = np.pi * (rows.time_s - rows.time_s[0]) / span
    yield Block(np.cos(phase[:, None] * np.arange(1, count + 1)))


def _steps(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    place = np.arange(len(rows)) / len(rows)
    yield Block((place[:, None] >= (np.arange(STEPS) + 1.0) / (STEPS + 1.0)).astype(np.float64))
    for i in range(SINGLE_STEPS):
        at = (i + 1.0) / (SINGLE_STEPS + 1.0)
        yield Block((place >= at).astype(np.float64)[:, None], {"at": at}, 1.0 / SINGLE_STEPS)


def _temperature(count: int, rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    yield Block(bumps(rows.temperature, *scene.range_degc, count))


def _rate(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    speed = rows.of(rate(rows.even.time, rows.even.temperature("T")))
    yield Block(speed[:, None] * bumps(rows.temperature, *scene.range_degc, 9))
    yield Block(np.abs(speed)[:, None] * bumps(rows.temperature, *scene.range_degc, 5))


def _direction(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    speed = rows.of(rate(rows.even.time, rows.even.temperature("T")))
    sign = np.tanh(speed / DIRECTION_DEGC_MIN)
    yield Block(sign[:, None] * bumps(rows.temperature, *scene.range_degc, 9))


def _past(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    time, x = rows.even.time, rows.even.temperature("T")
    low, high = scene.range_degc
    lags = [rows.of(lag(time, x, s)) for s in PAST_S]
    yield Block(np.column_stack([bumps(v, low, high, 7) for v in lags]))
    speeds = [rows.of(rate(time, lag(time, x, s))) for s in (300.0, *PAST_S)]
    yield Block(np.column_stack(speeds))


def _excursion(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    x = rows.even.temperature("T")
    low, high = scene.range_degc
    most, least = rows.of(np.maximum.accumulate(x)), rows.of(np.minimum.accumulate(x))
    yield Block(np.column_stack([bumps(most, low, high, 7), bumps(least, low, high, 7)]))
    turns = np.cumsum(np.abs(np.diff(np.sign(rate(rows.even.time, x)), prepend=0.0)) > 1.0)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    yield Block(np.column_stack([rows.of(turns.astype(float)), rows.of(travelled)]))


def _table(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    speed = rows.of(rows.even.table_rate)
    most = max(float(np.abs(r.even.table_rate).max(initial=0.0)) for r in scene.runs)
    levels = bumps(speed, -most, most, 9) if most > 0.0 else np.zeros((len(rows), 9))
    yield Block(levels)
    yield Block(levels * ((rows.temperature - 25.0) / scene.span_degc)[:, None])
    moved = np.abs(speed) > 0.0
    settled = np.column_stack(
        [_decay(rows.of(rows.even.time), np.diff(speed, prepend=speed[0]), s) for s in (60.0, 300.0, 1200.0)]
    )
    yield Block(settled)
    turning = rows.even.angle_deg if moved.any() or "angle" in rows.even.drives else np.zeros(len(rows.kept))
    angle = np.radians(rows.of(turning))
    yield Block(np.column_stack([f(h * angle) for h in (1.0, 2.0, 3.0) for f in (np.sin, np.cos)]))


def _decay(time: FloatArray, kicks: FloatArray, time_constant_s: float) -> FloatArray:
    out, state = np.zeros(len(kicks)), 0.0
    keep = np.exp(-np.diff(time, prepend=time[0]) / time_constant_s)
    for i, (kick, share) in enumerate(zip(np.sign(kicks) * (kicks != 0.0), keep)):
        state = state * share + kick
        out[i] = state
    return out


def _recorded(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    names = sorted(set.intersection(*(set(r.even.drives) for r in scene.runs)) - _of_candidates())
    for name in names:
        values = rows.even.drives[name]
        yield Block(np.column_stack([rows.of(lag(rows.even.time, values, s)) for s in (0.0, 300.0, 1800.0)]))


def _of_candidates() -> set[str]:
    """Quantities that candidates follow: what goes with them is theirs, in whatever form."""
    from fogml.twin.registry import effects

    return {name for declared in effects().values() if declared.candidate for name in declared.needs}


def unknown_families() -> tuple[Family, ...]:
    """Every unknown cause that is looked for."""
    smooth = tuple(
        Family(
            f"time_{s:g}", "unknown", partial(_smooth, s), f"wanders with time, over {s:g} s or longer", True
        )
        for s in TIMES_S
    )
    temperature = tuple(
        Family(f"temperature_{n}", "unknown", partial(_temperature, n), words)
        for n, words in zip(
            TEMPERATURE_BUMPS, ("is a function of temperature", "jumps or waves with temperature")
        )
    )
    return (
        *smooth,
        *temperature,
        Family("steps", "unknown", _steps, "goes in steps in time", True),
        Family("rate", "unknown", _rate, "goes with the rate of temperature, otherwise at each temperature"),
        Family("direction", "unknown", _direction, "differs with the direction of temperature"),
        Family("past", "unknown", _past, "remembers the temperature of the past hours"),
        Family("excursion", "unknown", _excursion, "remembers how far and how often temperature went"),
        Family("table", "unknown", _table, "goes with the table's rate or angle"),
        Family("recorded", "unknown", _recorded, "goes with something else that is recorded"),
    )
