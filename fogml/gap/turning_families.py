"""Families of causes that a turning table shows, or a drive that is recorded: whatever curve they follow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from fogml.gap.rows import Rows
from fogml.gap.scene import Block, Scene, column_block, lag, rate
from fogml.runs.run import FloatArray
from fogml.twin.registry import effect

NEAR = (0.5,)
"""Mixes of the faces that stand for the optics' place, where a slope in temperature is all that acts."""
MODULATOR_S = (30.0, 300.0, 1000.0)
"""How late a modulator's second loop is [s]."""
BEHIND_S = (300.0, 1200.0)
"""How far a node near a place may lag behind it [s]."""
Constants = Mapping[str, float]


def _speed(rows: Rows) -> FloatArray:
    """Response to a scale factor error of 1 ppm [deg/h], shape (m,)."""
    return 1e-6 * rows.of(rows.even.input_rate_deg_h * np.ones(len(rows.kept)))


def scale_factor_node(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A scale factor that follows the temperature of a node at or near a place, or any curve of it."""
    from fogml.gap.thermal_families import bumps

    speed, time = _speed(rows), rows.even.time
    low, high = scene.range_degc
    for place in scene.optics(rows, NEAR):
        x = rows.of(place.temperature)
        near = [rows.of(place.temperature - lag(time, place.temperature, s)) for s in BEHIND_S]
        yield Block(speed[:, None] * (x - 25.0)[:, None], {"place": place.name}, place.weight)
        columns = np.column_stack([x - 25.0, *near])
        yield Block(speed[:, None] * columns, {"place": place.name}, place.weight)
        curve = speed[:, None] * bumps(x, low, high, 5)
        yield Block(curve, {"place": place.name}, 0.3 * place.weight)


def modulator(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A scale factor that follows the modulator's temperature, with a second loop that corrects it late."""
    speed, time = _speed(rows), rows.even.time
    on = np.isfinite(rows.even.powered_on_s)
    found = [rows.of(rows.even.unwarmed(s)) * 100.0 if on else np.zeros(len(rows)) for s in MODULATOR_S]
    for place in scene.optics(rows, NEAR):
        x = rows.of(place.temperature) - 25.0
        yield Block(speed[:, None] * x[:, None], {"place": place.name}, place.weight)
        behind = [x + 25.0 - rows.of(lag(time, place.temperature, s)) for s in MODULATOR_S]
        for more, how in ((found, {"starts": True}), (behind, {"corrected": True})):
            columns = speed[:, None] * np.column_stack([x, *more])
            yield Block(columns, {"place": place.name, **how}, place.weight)


def even_in_rate(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """What does not change sign with the rate, by any power of it."""
    most = max(float(np.abs(r.by_sample.recorded.table_rate).max(initial=0.0)) for r in scene.runs) or 1.0
    speed = np.abs(rows.by_sample.recorded.input_rate_deg_h * np.ones(len(rows.by_sample.row)))
    full = 3600.0 * most
    powers = [rows.samples(1e-6 * full * (speed / full) ** p) for p in (1.0, 2.0, 0.5)]
    yield column_block(powers[0])
    yield column_block(*powers)


def odd_in_rate(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """What changes sign with the rate and is not in proportion to it."""
    declared = effect("sf_nonlinearity")
    shape = declared.default_shape(scene.grade)  # type: ignore[arg-type]
    for ripple in (0.0, 1.0):
        for period in (5.0, 10.0, 20.0, 40.0) if ripple else (5.0,):
            held = shape | {"ripple_share": 0.1 * ripple, "ripple_period": period}
            yield column_block(rows.response(declared, held, None, constants), ripple_period=period)
    most = max(float(np.abs(r.by_sample.recorded.table_rate).max(initial=0.0)) for r in scene.runs) or 1.0
    turning = rows.by_sample.recorded.input_rate_deg_h * np.ones(len(rows.by_sample.row))
    share = np.abs(turning) / (3600.0 * most)
    yield column_block(*(rows.samples(1e-6 * turning * share**p) for p in (0.5, 1.0, 2.0, 4.0)))


def vibration(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Any growth with the vibration."""
    level = rows.even.drive("vibration")
    most = max(float(r.even.drive("vibration").max(initial=0.0)) for r in scene.runs) or 1.0
    yield column_block(rows.of(level**2))
    yield column_block(*(most**2 * rows.of((level / most) ** p) for p in (0.5, 1.0, 2.0, 4.0)))


def leads(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Rates of the places that the leads pass, less the coil's."""
    time = rows.even.time
    coil = 0.5 * (rows.even.temperature("T_in") + rows.even.temperature("T_out"))
    passed = [rows.even.temperature(name) for name in ("T_electronics", "T_case", "T_chamber")]
    passed += [lag(time, coil, 600.0), lag(time, rows.even.temperature("T_case"), 1800.0)]
    rates = [rows.of(rate(time, x - coil)) for x in passed]
    for i, one in enumerate(rates):
        yield column_block(one)
        for other in rates[i + 1 :]:
            yield column_block(one, other)
