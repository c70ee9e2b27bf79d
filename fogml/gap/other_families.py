"""Families of causes outside of the winding: sensors, logger, machines, lines, other plants, signatures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import combinations

import numpy as np

from fogml.gap.model import amplitudes_about
from fogml.gap.own_simulator import OwnEffect
from fogml.gap.rows import Rows, slopes, through_nominal
from fogml.gap.scene import Block, Scene, column_block, lag, rate
from fogml.gap.shapes import AT_AMPLITUDE, Node, grid
from fogml.runs.run import FloatArray
from fogml.twin.effect import Effect

MACHINE_LAGS_S = (0.0, 40.0, 150.0)
PLANT_LAGS_S = (40.0, 100.0, 250.0)
SENSOR_LAG_S = 60.0
SKEWS_S = (-200.0, -60.0, -10.0, 0.1, 10.0, 60.0, 200.0)
CYCLE_S = (60.0, 1500.0)
"""Periods of a chamber's own cycle [s]."""
NEAR = (0.5,)
"""Mixes of the faces that stand for the optics' place, where a slope in temperature is all that acts."""
MOISTURE_S = (1800.0, 7200.0, 36000.0, 144000.0, 600000.0)
"""Times in which a coil takes up the air's moisture [s]."""
LINES = 10
"""Frequencies that stand out and are looked at closely."""
Constants = Mapping[str, float]


def signature_of(
    declared: Effect,
) -> Callable[[Rows, Scene, Constants], Iterator[Block]]:
    """The family of an effect that declares no other: its own signature over a grid of its shapes.

    Driven by each temperature that may be the one of its place.
    """

    def build(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
        nodes = nodes_of(declared, scene, constants)
        positive = not declared.amplitude.signed and declared.amplitude.limits[0] >= 0.0
        for name, temperature, weight in _driving(declared, rows, scene):
            for node in nodes:
                columns = np.column_stack(
                    [_at(rows, declared, draw, temperature, constants) for draw in node.draws]
                )
                yield Block(columns @ node.mix, {**node.shape, "place": name}, weight, positive)

    return build


def nodes_of(declared: Effect, scene: Scene, constants: Constants) -> tuple[Node, ...]:
    """The grid of an effect's shapes."""
    key = ("nodes", declared.id)
    if key not in scene.cache:
        spans = {"s": scene.span_s, "degC": scene.span_degc, "sample": scene.row_s}

        def on_first(shape: Mapping[str, float]) -> FloatArray:
            bare = {name: value for name, value in shape.items() if name != AT_AMPLITUDE}
            return scene.runs[0].response(declared, bare, None, constants)

        scene.cache[key] = grid(declared, scene.grade, on_first, spans)
    return tuple(scene.cache[key])


def _driving(
    declared: Effect, rows: Rows, scene: Scene
) -> list[tuple[str, Mapping[str, FloatArray] | None, float]]:
    if isinstance(declared, OwnEffect):
        # What drives it is for the model itself to know.
        return [("", None, 1.0)]
    if "T_electronics" in declared.needs:
        return [(p.name, {"T_electronics": p.temperature}, p.weight) for p in scene.optics(rows, NEAR)]
    if (
        "T" in declared.needs
        and declared.stage in ("bias", "scale_factor")
        and "T_case" not in declared.needs
    ):
        return [(p.name, {"T": p.temperature, "T_in": p.temperature}, p.weight) for p in scene.coil(rows)]
    return [("", None, 1.0)]


def _at(
    rows: Rows,
    declared: Effect,
    shape: Mapping[str, float],
    temperatures: Mapping[str, FloatArray] | None,
    constants: Constants,
) -> FloatArray:
    if not amplitudes_about(declared):
        return rows.response(declared, shape, temperatures, constants)
    about = shape[AT_AMPLITUDE]
    bare = {name: value for name, value in shape.items() if name != AT_AMPLITUDE}
    return rows.changed_output(declared, bare, about, constants) / about


def moisture(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """What follows the air's humidity late, alike at all temperatures or not."""
    if "humidity" not in rows.even.drives:
        yield Block(np.zeros((len(rows), 1)))
        return
    time, air = rows.even.time, rows.even.drives["humidity"]
    u = rows.temperature - 25.0
    taken = {s: rows.of(air - lag(time, air, s)) for s in MOISTURE_S}
    for values in taken.values():
        yield column_block(values)
    for one, other in combinations(MOISTURE_S, 2):
        yield column_block(taken[one], taken[other])
        warm = 0.03 * u
        yield column_block(taken[one], taken[other], warm * taken[one], warm * taken[other])


def power_cycles(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Another constant after each power-on."""
    most = max(len(r.even.power_ons_s) for r in scene.runs) + 1
    cycle = rows.even.power_cycle[rows.kept]
    yield Block((cycle[:, None] == np.arange(most)).astype(np.float64))


def machines(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Duties of the chamber's machines that are recorded, with short lags; else a line of two harmonics."""
    recorded = [n for n in ("heater", "compressor") if n in rows.even.drives]
    if recorded:
        duty = sum(rows.even.drives[n] for n in recorded)
        behind = [rows.of(lag(rows.even.time, np.asarray(duty), s)) for s in MACHINE_LAGS_S]
        for values, s in zip(behind, MACHINE_LAGS_S):
            yield column_block(values, lag=s)
        yield column_block(*(rows.of(rows.even.drives[n]) for n in recorded))
        yield column_block(*behind)
        return
    yield from _lines(rows, scene, 2, 1.0 / CYCLE_S[1], 1.0 / CYCLE_S[0])


def lines(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A line of any phase."""
    yield from _lines(rows, scene, 1, 1e-3, 0.5 / scene.row_s)


def supply(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """The supply's changes, and a line beside them."""
    change = rows.of(rows.even.drive("supply"))
    yield column_block(change - change.mean())
    for block in _lines(rows, scene, 1, 1e-4, 0.5 / scene.row_s):
        yield block._replace(columns=np.column_stack([change - change.mean(), 0.05 * block.columns]))


def _lines(rows: Rows, scene: Scene, harmonics: int, least: float, most: float) -> Iterator[Block]:
    """The lines of a scene within limits, weighed as one of all that there are."""
    count = max((most - least) * scene.span_s / 0.4, 1.0)
    for frequency in scene.lines_hz:
        inside = least <= frequency <= most
        waves = [
            wave(2.0 * np.pi * h * frequency * rows.time_s)
            for h in range(1, harmonics + 1)
            for wave in (np.sin, np.cos)
        ]
        scaled = np.column_stack(waves) * (1.0 if inside else 0.0)
        yield Block(scaled, {"frequency": frequency, "period": 1.0 / frequency}, 1.0 / count)


def sensor_lag(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Sensors that are late: what they miss, through the fitted nominal."""
    told, time = slopes(rows, constants), rows.even.time
    missed = {n: rate(time, rows.even.temperatures[n]) / 60.0 for n in rows.readings}
    second = {n: SENSOR_LAG_S * rate(time, v) / 60.0 for n, v in missed.items()}
    together = through_nominal(rows, told, missed)
    yield column_block(together, positive=True)
    yield column_block(together, through_nominal(rows, told, second), positive=True)
    for names in ({"T", "T_in"}, {"T_out"}):
        own = {n: v for n, v in missed.items() if n in names}
        yield column_block(through_nominal(rows, told, own), positive=True)


def sensor_placement(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Sensors that feel another place: what it differs by, through the fitted nominal."""
    told, time = slopes(rows, constants), rows.even.time
    held = {n: rows.even.temperatures[n] for n in rows.readings if n in ("T", "T_in", "T_out")}
    for other in ("T_case", "T_chamber", "T_electronics"):
        elsewhere = rows.even.temperature(other)
        every = {n: v - elsewhere for n, v in held.items()}
        yield column_block(through_nominal(rows, told, every), positive=True)
        for names in ({"T", "T_in"}, {"T_out"}):
            own = {n: v - elsewhere for n, v in held.items() if n in names}
            yield column_block(through_nominal(rows, told, own), positive=True)
    behind = {n: v - lag(time, v, 600.0) for n, v in held.items()}
    yield column_block(through_nominal(rows, told, behind), positive=True)


def sensor_steps(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """What the readings' steps hide, through the fitted nominal."""
    hidden = {n: rows.even.temperatures[n] - values for n, values in rows.readings.items()}
    yield column_block(through_nominal(rows, slopes(rows, constants), hidden), positive=True)


def clock_skew(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """The output late or early, by a skew that may grow."""
    for skew in SKEWS_S:
        change = rows.delayed(skew, constants) / skew
        yield Block(change[:, None], {AT_AMPLITUDE: skew})
        hours = (rows.time_s - rows.time_s[0]) / 3600.0
        yield Block(np.column_stack([change, 0.3 * hours * change]), {AT_AMPLITUDE: skew, "growth": 0.3})


def other_plant(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Heat that flows otherwise: temperatures within that differ from those read, through the nominal."""
    told, time = slopes(rows, constants), rows.even.time
    held = {n: rows.even.temperatures[n] for n in rows.readings if n in ("T", "T_in", "T_out")}
    columns = [
        through_nominal(rows, told, {n: lag(time, v, s) - v for n, v in held.items()}) for s in PLANT_LAGS_S
    ]
    if "T_out" in held:
        face = {n: held["T_out"] - v for n, v in held.items()}
        columns.append(through_nominal(rows, told, face))
    columns.append(rows.of(rate(time, rows.even.temperature("T_out"))))
    yield Block(np.column_stack(columns))
