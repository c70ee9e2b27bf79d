"""Causes that no catalogue holds, as families: smooth in time, or functions of what moves or is read."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.rows import READ, READ_GROUPS, Rows, slopes, through_nominal
from fogml.gap.scene import Block, Build, Family, Scene
from fogml.gap.settings import Grids
from fogml.signals.bases import bumps, decayed, lag, play, rate
from fogml.twin.registry import effects

BETWEEN = (("T_out", "T_in"), ("T_case", "T_in"), ("T_chamber", "T_in"), ("T_electronics", "T_in"))
"""Places whose difference may drive something."""


def _begun(place: FloatArray, count: int) -> FloatArray:
    """Steps at even shares of a run, shape (n, count); `place` goes from 0 to 1 over it."""
    return (place[:, None] >= (np.arange(count) + 1.0) / (count + 1.0)).astype(np.float64)


def _smooth(half_period_s: float, rows: Rows, scene: Scene) -> Iterator[Block]:
    span = float(rows.end_s[-1] - rows.end_s[0]) + rows.row_s
    longest = max(float(r.end_s[-1] - r.end_s[0]) + r.row_s for r in scene.fit)
    slower = [s for s in scene.grids.smooth_s if s > half_period_s]
    if any(longest / s >= scene.most_of_own for s in slower):
        return  # a slower one is as fast as rows allow
    count = max(min(int(longest / half_period_s), scene.most_of_own), 2)
    phase = np.pi * (rows.time_s - rows.time_s[0]) / span
    yield Block(np.cos(phase[:, None] * np.arange(1, count + 1)))


def _steps(rows: Rows, scene: Scene) -> Iterator[Block]:
    place, single = np.arange(len(rows)) / len(rows), min(scene.grids.single_steps, scene.most_of_own)
    yield Block(_begun(place, min(scene.grids.steps, scene.most_of_own)))
    for i, step in enumerate(_begun(place, single).T):
        yield Block(step[:, None], {"at": (i + 1.0) / (single + 1.0)}, 1.0 / single)


def _temperature(count: int, rows: Rows, scene: Scene) -> Iterator[Block]:
    yield Block(bumps(rows.temperature, *scene.range_degc, count))


def _rate(rows: Rows, scene: Scene) -> Iterator[Block]:
    speed = rows.of(rate(rows.even.time, rows.even.temperature("T")))[:, None]
    yield Block(speed * bumps(rows.temperature, *scene.range_degc, 9))
    yield Block(np.abs(speed) * bumps(rows.temperature, *scene.range_degc, 5))


def _direction(rows: Rows, scene: Scene) -> Iterator[Block]:
    yield Block(_way(rows, scene)[:, None] * bumps(rows.temperature, *scene.range_degc, 9))


def _way(rows: Rows, scene: Scene) -> FloatArray:
    """1 where temperature rises, -1 where it falls, between where it hardly moves; shape (m,)."""
    speed = rows.of(rate(rows.even.time, rows.even.temperature("T")))
    return np.asarray(np.tanh(speed / scene.grids.direction_degc_min))


def _past(rows: Rows, scene: Scene) -> Iterator[Block]:
    time, x = rows.even.time, rows.even.temperature("T")
    low, high = scene.range_degc
    lags = [rows.of(lag(time, x, s)) for s in scene.grids.past_s]
    yield Block(np.column_stack([bumps(v, low, high, 7) for v in lags]))
    speeds = [rows.of(rate(time, lag(time, x, s))) for s in (300.0, *scene.grids.past_s)]
    yield Block(np.column_stack(speeds))
    # What goes on only while it is hot, or cold, and recovers.
    levels = bumps(x, low, high, 5).T
    creeps_s = scene.grids.creeps_s
    yield Block(np.column_stack([rows.of(lag(time, level, s)) for level in levels for s in creeps_s]))


def _events(rows: Rows, scene: Scene) -> Iterator[Block]:
    """What turns of the temperature, starts and ends of its moves leave behind, and how it heals."""
    time, x, grids = rows.even.time, rows.even.temperature("T"), scene.grids
    ways = np.sign(np.diff(play(x, grids.turn_degc), prepend=x[0]))
    moving = np.flatnonzero(ways)
    kicks = np.zeros((len(x), 4))
    turned = moving[np.diff(ways[moving], prepend=0.0) != 0.0].tolist()
    for last, i in zip([0, *turned], turned):
        kicks[i, :2] = ways[i], ways[i] * abs(x[i] - x[last])
    speed = rate(time, x)
    going, way = np.abs(speed) > grids.direction_degc_min, np.sign(speed)
    changed = np.flatnonzero(np.diff(going.astype(np.int8), prepend=int(going[0])))
    for i in changed.tolist():
        kicks[i, 2 if going[i] else 3] = way[i] if going[i] else way[max(i - 1, 0)]
    yield Block(rows.of(np.column_stack([decayed(time, kicks, s) for s in grids.heals_s])))


def _differences(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Any function of how much warmer one place is than another, at once or late."""
    for i, (one, other) in enumerate(BETWEEN):
        ends = ("differences", i)
        if ends not in scene.cache:
            held = [r.even.temperature(one) - r.even.temperature(other) for r in scene.fit]
            scene.cache[ends] = min(d.min() for d in held), max(d.max() for d in held)
        low, high = scene.cache[ends]
        levels = bumps(rows.even.temperature(one) - rows.even.temperature(other), low, high, 6)
        late = [lag(rows.even.time, level, 1800.0) for level in levels.T]
        yield Block(rows.of(levels))
        yield Block(rows.of(np.column_stack([levels, *late])))


def _excursion(rows: Rows, scene: Scene) -> Iterator[Block]:
    x = rows.even.temperature("T")
    low, high = scene.range_degc
    most, least = rows.of(np.maximum.accumulate(x)), rows.of(np.minimum.accumulate(x))
    yield Block(np.column_stack([bumps(most, low, high, 7), bumps(least, low, high, 7)]))
    turns = np.cumsum(np.abs(np.diff(np.sign(rate(rows.even.time, x)), prepend=0.0)) > 1.0)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    yield Block(np.column_stack([rows.of(turns.astype(float)), rows.of(travelled)]))


def _table(rows: Rows, scene: Scene) -> Iterator[Block]:
    speed = rows.of(rows.even.table_rate)
    most = max(float(np.abs(r.even.table_rate).max(initial=0.0)) for r in scene.runs)
    levels = bumps(speed, -most, most, 9) if most > 0.0 else np.zeros((len(rows), 9))
    yield Block(levels)
    yield Block(levels * ((rows.temperature - 25.0) / scene.span_degc)[:, None])
    moved = np.abs(speed) > 0.0
    starts = np.sign(np.diff(speed, prepend=speed[0]))[:, None]
    time = rows.of(rows.even.time)
    yield Block(np.column_stack([decayed(time, starts, s) for s in (60.0, 300.0, 1200.0)]))
    tired = np.sqrt(np.abs(rows.even.table_rate))
    late = np.column_stack([rows.of(lag(rows.even.time, tired, s)) for s in (300.0, 1200.0, 3600.0)])
    yield Block(np.column_stack([late, late * ~moved[:, None]]))
    turning = rows.even.angle_deg if moved.any() or "angle" in rows.even.drives else np.zeros(len(rows.kept))
    angle = np.radians(rows.of(turning))
    yield Block(np.column_stack([f(h * angle) for h in (1.0, 2.0, 3.0) for f in (np.sin, np.cos)]))
    # Turns made so far, net and in all.
    made = np.cumsum(rows.even.table_rate) * rows.row_s / 360.0
    net, travelled = rows.of(made), rows.of(np.cumsum(np.abs(rows.even.table_rate)) * rows.row_s / 360.0)
    yield Block(np.column_stack([net, travelled, *(np.tanh(net / s) for s in (0.3, 1.0, 3.0))]))


def _recorded(rows: Rows, scene: Scene) -> Iterator[Block]:
    # Quantities that candidates follow: what goes with them is theirs, in whatever form.
    theirs = {name for declared in effects().values() if declared.candidate for name in declared.needs}
    for name in sorted(set.intersection(*(set(r.even.drives) for r in scene.runs)) - theirs):
        values = rows.even.drives[name]
        yield Block(np.column_stack([rows.of(lag(rows.even.time, values, s)) for s in (0.0, 300.0, 1800.0)]))


def _between(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Constants that changed between one run and the next: each alone, or all of them."""
    begun = scene.begun_s[scene.runs.index(rows)]
    every = np.concatenate([r.constants for r in scene.fit])
    usual = np.maximum(np.sqrt(np.mean(every**2, axis=0)), 1e-12)
    for before, after in pairwise(scene.in_time):
        columns = rows.constants / usual * float(begun >= scene.begun_s[after])
        held = {"between": f"{scene.runs[before].run.name} and {scene.runs[after].run.name}"}
        weight = 1.0 / (scene.fitted - 1)
        yield Block(columns, held, weight)
        for column in columns.T:
            yield Block(column[:, None], held, weight / columns.shape[1])


def _lines(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Lines that stand out: steady, while the table turns, as temperature or time make them strong."""
    time, weight = rows.time_s, scene.grids.line_weight
    phase = np.pi * (time - time[0]) / max(float(time[-1] - time[0]), 1.0)
    strengths = [
        np.ones(len(time)),
        (np.abs(rows.of(rows.even.table_rate)) > 0.0).astype(np.float64),
        (rows.temperature - scene.range_degc[0]) / scene.span_degc,
        _way(rows, scene),
    ]
    any_of = [*strengths, *(np.cos(k * phase) for k in (1.0, 2.0, 3.0))]
    for frequency in scene.lines_hz[: scene.grids.unknown_lines]:
        turn = 2.0 * np.pi * frequency * time
        waves = np.column_stack([wave(h * turn) for h in (1.0, 2.0) for wave in (np.sin, np.cos)])
        held = {"period": 1.0 / frequency}
        for strength in strengths:
            yield Block(strength[:, None] * waves, held, weight / len(strengths))
        if len(any_of) * waves.shape[1] <= scene.most_of_own:
            yield Block(np.concatenate([s[:, None] * waves for s in any_of], axis=1), held, weight)


def _start(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Any course since power-on, or since the run began where that is not known, at its own pace."""
    on = rows.even.powered_on_s
    since = rows.time_s - (on if math.isfinite(on) else float(rows.even.time[0]))
    first, last = scene.grids.starts_s
    yield Block(bumps(np.log10(np.maximum(since, first)), math.log10(first), math.log10(last), 8))


def _readings(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Errors of thermometers that go with temperature, its direction or its past: the same on every run."""
    of_all = {n: _of_temperature(rows, scene, n) for n in READ if n in rows.readings}
    widths = (10, 5, 15, *(1 for _ in 2 * scene.grids.slack_degc))
    for group in (*READ_GROUPS, READ):
        of_each = {n: kinds for n, kinds in of_all.items() if n in group}
        yield from map(Block, _through(rows, scene, of_each, widths))


def _readings_in_time(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Errors of thermometers that wander, or go in steps, in a run's own time."""
    grids = scene.grids
    place = np.arange(len(rows.even.time)) / len(rows.even.time)
    counts = (grids.reading_waves, grids.reading_steps, grids.reading_single_steps)
    waves, steps, singles = (min(count, scene.most_of_own) for count in counts)
    single = [step[:, None] for step in _begun(place, singles).T]
    kinds = [np.cos(np.pi * place[:, None] * np.arange(1, waves + 1)), _begun(place, steps), *single]
    widths = tuple(kind.shape[1] for kind in kinds)
    for group in READ_GROUPS:
        of_each = {n: kinds for n in group if n in rows.readings}
        for i, columns in enumerate(_through(rows, scene, of_each, widths)):
            yield Block(columns, weight=1.0 if i < 2 else 1.0 / singles)


def _of_temperature(rows: Rows, scene: Scene, name: str) -> list[FloatArray]:
    """Errors of one reading by its course [degC], shape (e, k) each."""
    time, x, grids = rows.even.time, rows.even.temperatures[name], scene.grids
    levels = bumps(x, *scene.range_degc, 5)
    ways = np.tanh(rate(time, x) / grids.direction_degc_min)[:, None]
    spent = np.cumsum(levels, axis=0) / len(levels)
    healing = [lag(time, level, s) for level in levels.T for s in grids.reading_heals_s]
    # What a sensor that sticks would have read is near what another place did.
    other = rows.even.temperature("T_out" if name != "T_out" and "T_out" in rows.readings else "T_case")
    stuck = [((play(y, s) - y) / s)[:, None] for y in (x, other) for s in grids.slack_degc]
    return [np.column_stack([levels, ways * levels]), spent, np.column_stack(healing), *stuck]


def _through(
    rows: Rows, scene: Scene, of_each: Mapping[str, list[FloatArray]], widths: tuple[int, ...]
) -> Iterator[FloatArray]:
    """Kinds of errors of a group's readings, each through the nominal, shape (m, k); 0 without a reading."""
    told = slopes(rows, scene.constants)
    for i, width in enumerate(widths):
        errors = {name: kinds[i] for name, kinds in of_each.items()}
        yield through_nominal(rows, told, errors) if errors else np.zeros((len(rows), width))


def unknown_families(grids: Grids) -> tuple[Family, ...]:
    """Every unknown cause that is looked for."""
    reading, most = "is an error of a thermometer, of no known kind", grids.largest_reading_degc
    kinds = ("is a function of temperature", "jumps or waves with temperature")

    def of(id: str, build: Build, words: str, drawn: bool = False, largest: float = math.inf) -> Family:
        return Family(id, "unknown", build, words, drawn, largest)

    return (
        *(
            of(f"time_{s:g}", partial(_smooth, s), f"wanders with time, over {s:g} s or longer", True)
            for s in grids.smooth_s
        ),
        *(
            of(f"temperature_{n}", partial(_temperature, n), words)
            for n, words in zip(grids.temperature_bumps, kinds)
        ),
        of("steps", _steps, "goes in steps in time", True),
        of("rate", _rate, "goes with the rate of temperature, otherwise at each temperature"),
        of("direction", _direction, "differs with the direction of temperature"),
        of("past", _past, "remembers the temperature of the past hours"),
        of("excursion", _excursion, "remembers how far and how often temperature went"),
        of("events", _events, "follows turns, starts and ends of changes of temperature"),
        of("differences", _differences, "goes with how much warmer one place is than another"),
        of("readings", _readings, reading, largest=most),
        of("reading_times", _readings_in_time, reading, True, most),
        of("lines", _lines, "is a line that comes and goes", True),
        of("line", _lines, "is a line"),
        of("between", _between, "comes of constants that changed between two runs"),
        of("start", _start, "goes with the time since the start"),
        of("table", _table, "goes with the table's rate or angle"),
        of("recorded", _recorded, "goes with something else that is recorded"),
    )
