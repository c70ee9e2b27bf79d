"""Whose family is which, and families of causes outside of the winding: table, sensors, machines, plants."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, known_are
from fogml.gap import thermal_families as thermal
from fogml.gap.own_simulator import OwnEffect
from fogml.gap.rows import READ, READ_GROUPS, Rows, slopes, through_nominal
from fogml.gap.scene import Block, Build, Family, Scene, column_block, steps_are_coarse
from fogml.gap.shapes import AT_AMPLITUDE, GridNode, grid
from fogml.gap.unknown import unknown_families
from fogml.signals.bases import lag, rate
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.registry import effect
from fogml.twin.twin import Twin


def signature_of(declared: Effect, only: Sequence[GridNode] | None = None) -> Build:
    """The family of an effect that declares no other: its own signature over a grid of its shapes.

    Driven by each temperature that may be the one of its place; over some nodes of the grid where given.
    """

    def build(rows: Rows, scene: Scene) -> Iterator[Block]:
        nodes = nodes_of(declared, scene) if only is None else only
        positive = not declared.amplitude.signed and declared.amplitude.limits[0] >= 0.0
        for name, driving, weight in _driving(declared, rows, scene):
            for node in nodes:
                draws = [rows.response(declared, draw, driving, scene.constants) for draw in node.draws]
                columns = np.column_stack(draws) @ node.mix
                yield Block(columns, {**node.shape, "place": name}, weight, positive)

    return build


def driving_of(declared: Effect, rows: Rows, scene: Scene, place: str) -> Mapping[str, FloatArray] | None:
    """Temperatures of the place of that name which may drive an effect, shape (e,) each."""
    return next(held for name, held, _ in _driving(declared, rows, scene) if name == place)


def nodes_of(declared: Effect, scene: Scene) -> tuple[GridNode, ...]:
    """The grid of an effect's shapes."""
    key = ("nodes", declared.id)
    if key not in scene.cache:
        spans = {"s": scene.span_s, "degC": scene.span_degc, "sample": scene.row_s}
        on_first = partial(scene.runs[0].response, declared, constants=scene.constants)
        scene.cache[key] = grid(declared, scene.grade, on_first, spans, scene.grids)
    return tuple(scene.cache[key])


def _driving(
    declared: Effect, rows: Rows, scene: Scene
) -> list[tuple[str, Mapping[str, FloatArray] | None, float]]:
    """Name, temperatures and weight of each place that may drive an effect."""
    needs = declared.needs
    # What drives an effect of its own is for a laboratory's model to know.
    if not isinstance(declared, OwnEffect):
        if "T_electronics" in needs:
            places = scene.optics(rows, scene.grids.electronics_mixes)
            return [(p.name, {"T_electronics": p.temperature}, p.weight) for p in places]
        if "T" in needs and "T_case" not in needs and declared.stage in ("bias", "scale_factor"):
            places = scene.coil(rows)
            return [(p.name, {"T": p.temperature, "T_in": p.temperature}, p.weight) for p in places]
    return [("", None, 1.0)]


def moisture(rows: Rows, scene: Scene) -> Iterator[Block]:
    """What follows the air's humidity late, alike at all temperatures or not."""
    if not any(scene.records("humidity")):
        yield Block(np.zeros((len(rows), 1)))
        return
    air = rows.even.drive("humidity")
    taken = {s: rows.of(air - lag(rows.even.time, air, s)) for s in scene.grids.moisture_s}
    warm = 0.03 * (rows.temperature - 25.0)
    for values in taken.values():
        yield column_block(values)
    for one, other in combinations(taken.values(), 2):
        yield column_block(one, other)
        yield column_block(one, other, warm * one, warm * other)


def power_cycles(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Another constant after each power-on."""
    most = max(len(r.even.power_ons_s) for r in scene.runs) + 1
    cycle = rows.even.power_cycle[rows.kept]
    yield Block((cycle[:, None] == np.arange(most)).astype(np.float64))


def machines(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Duties of the chamber's machines that are recorded, with short lags; else a line of two harmonics."""
    grids = scene.grids
    told = {n: scene.records(n) for n in ("heater", "compressor")}
    if not all(any(by_run) for by_run in zip(*told.values())):
        shortest, longest = grids.cycle_s
        yield from _lines(rows, scene, 2, 1.0 / longest, 1.0 / shortest)
    recorded = [n for n, by_run in told.items() if any(by_run)]
    if not recorded:
        return
    duty = np.asarray(sum(rows.even.drive(n) for n in recorded))
    behind = [rows.of(lag(rows.even.time, duty, s)) for s in grids.machine_lags_s]
    for values, s in zip(behind, grids.machine_lags_s):
        yield column_block(values, lag=s)
    yield column_block(*(rows.of(rows.even.drive(n)) for n in recorded))
    yield column_block(*behind)


def lines(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A line of any phase."""
    yield from _lines(rows, scene, 1, 1e-3, 0.5 / scene.row_s)


def supply(rows: Rows, scene: Scene) -> Iterator[Block]:
    """The supply's changes, and a line beside them."""
    change = rows.of(rows.even.drive("supply"))
    change = change - change.mean()
    yield column_block(change)
    for block in _lines(rows, scene, 1, 1e-4, 0.5 / scene.row_s):
        yield block._replace(columns=np.column_stack([change, 0.05 * block.columns]))


def _lines(rows: Rows, scene: Scene, harmonics: int, least: float, most: float) -> Iterator[Block]:
    """The lines of a scene within limits, weighed as one of all that there are."""
    count = max((most - least) * scene.span_s / scene.grids.cycles_apart, 1.0)
    for frequency in scene.lines_hz:
        turns = [2.0 * np.pi * h * frequency * rows.time_s for h in range(1, harmonics + 1)]
        waves = np.column_stack([wave(turn) for turn in turns for wave in (np.sin, np.cos)])
        scaled = waves * (1.0 if least <= frequency <= most else 0.0)
        yield Block(scaled, {"frequency": frequency, "period": 1.0 / frequency}, 1.0 / count)


def sensor_lag(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Sensors that are late: what they miss, through the fitted nominal."""
    told, time = slopes(rows, scene.constants), rows.even.time
    missed = {n: rate(time, rows.even.temperatures[n]) / 60.0 for n in rows.readings}
    second = {n: scene.grids.sensor_lag_s * rate(time, v) / 60.0 for n, v in missed.items()}
    together = through_nominal(rows, told, missed)
    yield column_block(together, positive=True)
    yield column_block(together, through_nominal(rows, told, second), positive=True)
    for names in READ_GROUPS:
        own = {n: v for n, v in missed.items() if n in names}
        yield column_block(through_nominal(rows, told, own), positive=True)


def sensor_placement(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Sensors that feel another place: what it differs by, through the fitted nominal."""
    told = slopes(rows, scene.constants)
    held = {n: rows.even.temperatures[n] for n in rows.readings if n in READ}
    for other in ("T_case", "T_chamber", "T_electronics"):
        elsewhere = rows.even.temperature(other)
        for names in (READ, *READ_GROUPS):
            own = {n: v - elsewhere for n, v in held.items() if n in names}
            yield column_block(through_nominal(rows, told, own), positive=True)
    late_s = scene.grids.placement_lag_s
    behind = {n: v - lag(rows.even.time, v, late_s) for n, v in held.items()}
    yield column_block(through_nominal(rows, told, behind), positive=True)


def sensor_steps(rows: Rows, scene: Scene) -> Iterator[Block]:
    """What the readings' steps hide, through the fitted nominal."""
    hidden = {n: rows.even.temperatures[n] - values for n, values in rows.readings.items()}
    yield column_block(through_nominal(rows, slopes(rows, scene.constants), hidden), positive=True)


def clock_skew(rows: Rows, scene: Scene) -> Iterator[Block]:
    """The output late or early, by a skew that may grow."""
    declared = effect("logger_skew")
    hours = (rows.time_s - rows.time_s[0]) / 3600.0
    for skew in declared.amplitudes:
        change = rows.response(declared, {"growth": 0.0, AT_AMPLITUDE: skew}, None, scene.constants)
        yield Block(change[:, None], {AT_AMPLITUDE: skew})
        yield Block(np.column_stack([change, 0.3 * hours * change]), {AT_AMPLITUDE: skew, "growth": 0.3})


def other_plant(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Heat that flows otherwise: temperatures within that differ from those read, through the nominal."""
    told, time = slopes(rows, scene.constants), rows.even.time
    held = {n: rows.even.temperatures[n] for n in rows.readings if n in READ}
    errors = [{n: lag(time, v, s) - v for n, v in held.items()} for s in scene.grids.plant_lags_s]
    if any(scene.records("T_out")):
        errors.append({n: rows.even.temperature("T_out") - v for n, v in held.items()})
    columns = [through_nominal(rows, told, e) for e in errors]
    yield column_block(*columns, rows.of(rate(time, rows.even.temperature("T_out"))))


def even_in_rate(rows: Rows, scene: Scene) -> Iterator[Block]:
    """What does not change sign with the rate, by any power of it."""
    turning, full = _turning(rows, scene)
    powers = [rows.samples(1e-6 * full * (np.abs(turning) / full) ** p) for p in (1.0, 2.0, 0.5)]
    yield column_block(powers[0])
    yield column_block(*powers)


def odd_in_rate(rows: Rows, scene: Scene) -> Iterator[Block]:
    """What changes sign with the rate and is not in proportion to it."""
    declared = effect("sf_nonlinearity")
    shape = declared.default_shape(scene.grade)
    for ripple, periods in ((0.0, (5.0,)), (0.1, (5.0, 10.0, 20.0, 40.0))):
        for period in periods:
            held = shape | {"ripple_share": ripple, "ripple_period": period}
            yield column_block(rows.response(declared, held, None, scene.constants), ripple_period=period)
    turning, full = _turning(rows, scene)
    share = np.abs(turning) / full
    yield column_block(*(rows.samples(1e-6 * turning * share**p) for p in (0.5, 1.0, 2.0, 4.0)))


def _turning(rows: Rows, scene: Scene) -> tuple[FloatArray, float]:
    """Input rate of the samples, and the table's greatest over all runs [deg/h]."""
    most = max(float(np.abs(r.by_sample.recorded.table_rate).max(initial=0.0)) for r in scene.runs) or 1.0
    return rows.by_sample.recorded.input_rate_deg_h * np.ones(len(rows.by_sample.row)), 3600.0 * most


def vibration(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Any growth with the vibration."""
    level = rows.even.drive("vibration")
    most = max(float(r.even.drive("vibration").max(initial=0.0)) for r in scene.runs) or 1.0
    yield column_block(rows.of(level**2))
    yield column_block(*(most**2 * rows.of((level / most) ** p) for p in (0.5, 1.0, 2.0, 4.0)))


FAMILIES: dict[str, Build] = {
    "loops": thermal.hysteresis,
    "scale_factor_loops": thermal.scale_factor_hysteresis,
    "warm_up": thermal.warm_up,
    "wave": thermal.polarization,
    "transition": thermal.transition,
    "hidden_node": thermal.hidden_node,
    "relaxation": thermal.relaxation,
    "rate_product": thermal.rate_product,
    "rate": thermal.rate_of_temperature,
    "gradient_rate": thermal.shupe,
    "static": thermal.static,
    "ageing": thermal.ageing,
    "scale_factor_node": thermal.scale_factor_node,
    "modulator": thermal.modulator,
    "leads": thermal.leads,
    "machines": machines,
    "line": lines,
    "supply": supply,
    "power_cycles": power_cycles,
    "sensor_lag": sensor_lag,
    "sensor_placement": sensor_placement,
    "sensor_steps": sensor_steps,
    "clock_skew": clock_skew,
    "even_in_rate": even_in_rate,
    "odd_in_rate": odd_in_rate,
    "vibration": vibration,
    "moisture": moisture,
}
"""Families by the names that effects declare; an effect of family ``signature`` has its own signature's."""


def families_of(twin: Twin, scene: Scene, without: Iterable[str] = ()) -> tuple[Family, ...]:
    """Families of everything that may act on these runs.

    `twin` tells how sensors usually read. Effects that the twin has are among them: their sizes may be wrong,
    and too large as well as too small.
    """
    left_out = set(without)

    def build_of(declared: Effect) -> Build:
        if declared.family not in ("signature", *FAMILIES):
            told = known_are(declared.family, ("signature", *FAMILIES), "families")
            raise InputError(
                f"effect '{declared.id}' is of family '{declared.family}', which is none; {told}"
            )
        build = FAMILIES.get(declared.family) or signature_of(declared)
        return partial(_of_either_sign, build) if declared.id in twin.settings else build

    known = [
        Family(
            id,
            "left_out" if id in left_out else "known",
            build_of(declared),
            drawn_per_run=declared.drawn_per_run or declared.family == "line",
        )
        for id, declared in scene.candidates.items()
        if _can_show(declared, scene, twin)
    ]
    return (*known, *unknown_families(scene.grids), Family("other_plant", "plant", other_plant))


def _of_either_sign(build: Build, rows: Rows, scene: Scene) -> Iterator[Block]:
    """What corrects an effect that is there."""
    return (block._replace(positive=False) for block in build(rows, scene))


def _can_show(declared: Effect, scene: Scene, twin: Twin) -> bool:
    """Whether the runs hold what tells an effect, if it says what that is."""
    if isinstance(declared, NoiseEffect) and not declared.steady and declared.family == "signature":
        return False
    if declared.family == "sensor_steps":
        return steps_are_coarse(scene, twin)
    if declared.family == "machines":
        return True
    told = (
        [r.run.columns[name] for r in scene.fit for name in group if name in r.run.columns]
        for group in declared.told_by
    )
    return all(any(float(abs(values - values[0]).max()) > 0.0 for values in group) for group in told)
