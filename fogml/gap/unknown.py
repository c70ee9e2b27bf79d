"""Errors of thermometers that no catalogue holds, through the nominal: as many kinds as errors of a bias."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise

import numpy as np

from fogml.gap.rows import Rows, slopes, through_nominal
from fogml.gap.scene import DIRECTION_DEGC_MIN, Block, Family, Scene, lag, rate
from fogml.gap.thermal_families import bumps
from fogml.runs.run import FloatArray
from fogml.signals.recursions import play_kernel

GROUPS = (("T", "T_in"), ("T_out",))
"""Sensors that err apart."""
ALL = ("T", "T_in", "T_out")
SLACK_DEGC = (0.1, 0.3, 1.0)
"""What a sensor that sticks has to move by before it moves on: it errs by as much, and more would be seen."""
LARGEST_DEGC = 0.3
"""Usual most that a thermometer is wrong by: class A of IEC 60751 between -40 and 70 degC."""
READING_HEALS_S = (1800.0, 7200.0, 30000.0)
READING_STEPS, READING_SINGLE_STEPS, READING_WAVES = 20, 12, 12
Constants = Mapping[str, float]


def reading_errors(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Errors that go with temperature, its direction or its past: the same on every run."""
    of_all = {n: _of_temperature(rows, scene, n) for n in ALL if n in rows.readings}
    for group in (*GROUPS, ALL):
        of_each = {n: kinds for n, kinds in of_all.items() if n in group}
        for columns in _through(rows, constants, of_each, (10, 5, 15, *(1 for _ in 2 * SLACK_DEGC))):
            yield Block(columns)


def reading_errors_in_time(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Errors that wander, or go in steps, in a run's own time."""
    place = np.arange(len(rows.even.time)) / len(rows.even.time)
    waves = np.cos(np.pi * place[:, None] * np.arange(1, READING_WAVES + 1))
    steps = (place[:, None] >= (np.arange(READING_STEPS) + 1.0) / (READING_STEPS + 1.0)).astype(np.float64)
    single = [
        (place[:, None] >= (i + 1.0) / (READING_SINGLE_STEPS + 1.0)).astype(np.float64)
        for i in range(READING_SINGLE_STEPS)
    ]
    for group in GROUPS:
        of_each = {n: [waves, steps, *single] for n in group if n in rows.readings}
        widths = (READING_WAVES, READING_STEPS, *(1 for _ in single))
        for i, columns in enumerate(_through(rows, constants, of_each, widths)):
            yield Block(columns, weight=1.0 if i < 2 else 1.0 / READING_SINGLE_STEPS)


def _of_temperature(rows: Rows, scene: Scene, name: str) -> list[FloatArray]:
    """Errors of one reading by its course [degC], shape (e, k) each."""
    time, x = rows.even.time, np.ascontiguousarray(rows.even.temperatures[name])
    levels = bumps(x, *scene.range_degc, 5)
    ways = np.tanh(rate(time, x) / DIRECTION_DEGC_MIN)[:, None]
    spent = np.cumsum(levels, axis=0) / len(levels)
    healing = [lag(time, level, s) for level in levels.T for s in READING_HEALS_S]
    # What a sensor that sticks would have read is near what another place did.
    other = rows.even.temperature("T_out" if name != "T_out" and "T_out" in rows.readings else "T_case")
    ways_stuck = [
        (play_kernel(np.ascontiguousarray(y), s, np.nan)[0] - y) / s for y in (x, other) for s in SLACK_DEGC
    ]
    stuck = [way[:, None] for way in ways_stuck]
    return [np.column_stack([levels, ways * levels]), spent, np.column_stack(healing), *stuck]


def _through(
    rows: Rows, constants: Constants, of_each: Mapping[str, list[FloatArray]], widths: tuple[int, ...]
) -> Iterator[FloatArray]:
    """Kinds of errors of a group's readings, each through the nominal, shape (m, k); 0 without a reading."""
    told = slopes(rows, constants)
    for i, width in enumerate(widths):
        errors = {name: kinds[i] for name, kinds in of_each.items()}
        yield through_nominal(rows, told, errors) if errors else np.zeros((len(rows), width))


TIMES_S = (7200.0, 2400.0, 900.0, 400.0)
"""Shortest half periods of what is smooth in time [s]."""
STEPS, SINGLE_STEPS = 40, 24
"""Steps of a run that are many, and places of a single one."""
TEMPERATURE_BUMPS = (25, 60)
PAST_S = (600.0, 1800.0, 5400.0, 16200.0)
CREEPS_S = (1800.0, 7200.0, 30000.0)
TURN_DEGC = 1.0
"""Temperature has turned when it came back by twice this."""
HEALS_S = (900.0, 3000.0, 9000.0, 1e9)
LINES, LINE_WEIGHT = 3, 0.01
"""One line among as many as a run of some hours holds between its start and its rows."""
BETWEEN = (("T_out", "T_in"), ("T_case", "T_in"), ("T_chamber", "T_in"), ("T_electronics", "T_in"))
"""Places whose difference may drive something."""
STARTS_S = (30.0, 30000.0)
"""From when to when after the start something may be settling [s]."""
A_READING = "is an error of a thermometer, of no known kind"


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
    # What goes on only while it is hot, or cold, and recovers.
    levels = bumps(x, low, high, 5).T
    yield Block(np.column_stack([rows.of(lag(time, level, s)) for level in levels for s in CREEPS_S]))


def _events(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """What turns of the temperature, starts and ends of its moves leave behind, and how it heals."""
    time, x = rows.even.time, np.ascontiguousarray(rows.even.temperature("T"))
    ways = np.sign(np.diff(play_kernel(x, TURN_DEGC, np.nan)[0], prepend=x[0]))
    moving = np.flatnonzero(ways)
    kicks = np.zeros((len(x), 4))
    turned = moving[np.diff(ways[moving], prepend=0.0) != 0.0].tolist()
    for last, i in zip([0, *turned], turned):
        kicks[i, :2] = ways[i], ways[i] * abs(x[i] - x[last])
    going = np.abs(rate(time, x)) > DIRECTION_DEGC_MIN
    changed = np.flatnonzero(np.diff(going.astype(np.int8), prepend=int(going[0])))
    way = np.sign(rate(time, x))
    for i in changed.tolist():
        kicks[i, 2 if going[i] else 3] = way[i] if going[i] else way[max(i - 1, 0)]
    yield Block(rows.of(np.column_stack([_decay(time, kicks, s) for s in HEALS_S])))


def _differences(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Any function of how much warmer one place is than another, at once or late."""
    for i, (one, other) in enumerate(BETWEEN):
        ends = ("differences", i)
        if ends not in scene.cache:
            held = [r.even.temperature(one) - r.even.temperature(other) for r in scene.runs[: scene.fitted]]
            scene.cache[ends] = min(d.min() for d in held), max(d.max() for d in held)
        low, high = scene.cache[ends]
        levels = bumps(rows.even.temperature(one) - rows.even.temperature(other), low, high, 6)
        late = [lag(rows.even.time, level, 1800.0) for level in levels.T]
        yield Block(rows.of(levels))
        yield Block(rows.of(np.column_stack([levels, *late])))


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
    starts = np.sign(np.diff(speed, prepend=speed[0]))[:, None]
    time = rows.of(rows.even.time)
    yield Block(np.column_stack([_decay(time, starts, s) for s in (60.0, 300.0, 1200.0)]))
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


def _decay(time: FloatArray, kicks: FloatArray, time_constant_s: float) -> FloatArray:
    """What kicks leave behind while it decays, shape (n, k)."""
    out, state = np.zeros(kicks.shape), np.zeros(kicks.shape[1])
    keep = np.exp(-np.diff(time, prepend=time[0]) / time_constant_s)
    for i, (kick, share) in enumerate(zip(kicks, keep.tolist())):
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


def _between(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Constants that changed between one run and the next: each alone, or all of them."""
    order = sorted(range(scene.fitted), key=lambda i: scene.begun_s[i])
    begun = scene.begun_s[scene.runs.index(rows)]
    for before, after in pairwise(order):
        later = begun >= scene.begun_s[after]
        columns = rows.constants / _usual(scene) * float(later)
        held = {"between": f"{scene.runs[before].run.name} and {scene.runs[after].run.name}"}
        weight = 1.0 / (scene.fitted - 1)
        yield Block(columns, held, weight)
        for column in columns.T:
            yield Block(column[:, None], held, weight / columns.shape[1])


def _usual(scene: Scene) -> FloatArray:
    """Root mean squares of the responses to constants on the fit runs, shape (c,)."""
    if "responses" not in scene.cache:
        every = np.concatenate([r.constants for r in scene.runs[: scene.fitted]])
        scene.cache["responses"] = np.maximum(np.sqrt(np.mean(every**2, axis=0)), 1e-12)
    return np.asarray(scene.cache["responses"])


def _lines(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Lines that stand out: steady, while the table turns, as temperature or time make them strong."""
    time = rows.time_s
    phase = np.pi * (time - time[0]) / max(float(time[-1] - time[0]), 1.0)
    direction = np.tanh(rows.of(rate(rows.even.time, rows.even.temperature("T"))) / DIRECTION_DEGC_MIN)
    strengths = [
        np.ones(len(time)),
        (np.abs(rows.of(rows.even.table_rate)) > 0.0).astype(np.float64),
        (rows.temperature - scene.range_degc[0]) / scene.span_degc,
        direction,
    ]
    any_of = [*strengths, *(np.cos(k * phase) for k in (1.0, 2.0, 3.0))]
    for frequency in scene.lines_hz[:LINES]:
        turn = 2.0 * np.pi * frequency * time
        waves = np.column_stack([wave(h * turn) for h in (1.0, 2.0) for wave in (np.sin, np.cos)])
        held = {"period": 1.0 / frequency}
        for strength in strengths:
            yield Block(strength[:, None] * waves, held, LINE_WEIGHT / len(strengths))
        yield Block(np.concatenate([s[:, None] * waves for s in any_of], axis=1), held, LINE_WEIGHT)


def _start(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Any course since power-on, or since the run began where that is not known, at its own pace."""
    on = rows.even.powered_on_s
    since = rows.time_s - (on if math.isfinite(on) else float(rows.even.time[0]))
    pace = np.log10(np.maximum(since, STARTS_S[0]))
    yield Block(bumps(pace, math.log10(STARTS_S[0]), math.log10(STARTS_S[1]), 8))


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
        Family("events", "unknown", _events, "follows turns, starts and ends of changes of temperature"),
        Family("differences", "unknown", _differences, "goes with how much warmer one place is than another"),
        Family("readings", "unknown", reading_errors, A_READING, largest=LARGEST_DEGC),
        Family("reading_times", "unknown", reading_errors_in_time, A_READING, True, largest=LARGEST_DEGC),
        Family("lines", "unknown", _lines, "is a line that comes and goes", True),
        Family("line", "unknown", _lines, "is a line"),
        Family("between", "unknown", _between, "comes of constants that changed between two runs"),
        Family("start", "unknown", _start, "goes with the time since the start"),
        Family("table", "unknown", _table, "goes with the table's rate or angle"),
        Family("recorded", "unknown", _recorded, "goes with something else that is recorded"),
    )
