"""Families of causes that follow a temperature, its rate or its past.

Each generator gives a family's blocks on one run; `fogml.gap.catalogue` says whose they are, and
`fogml.gap.shapes` how closely they look.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.rows import Rows
from fogml.gap.scene import Block, Place, Scene, column_block
from fogml.signals.bases import bumps, lag, play, preisach, rate


def _loops(rows: Rows, scene: Scene) -> list[Block]:
    """Loops of each place: a smooth density over the whole plane, then one half width for all relays."""
    key, grids = ("loops", id(rows)), scene.grids
    if key in scene.cache:
        return list(scene.cache[key])
    low, high = scene.range_degc
    earlier = scene.before(rows)
    pasts = [scene.coil(r) for r in earlier]
    found: list[Block] = []
    for i, place in enumerate(scene.coil(rows)):
        past = [p[i].temperature[r.kept] for p, r in zip(pasts, earlier)]
        course = np.concatenate([*past, place.temperature])
        first = len(course) - len(place.temperature)

        def relays(width: float, course: FloatArray = course, first: int = first) -> FloatArray:
            return preisach(course, low, high, width, first, count=grids.relays, wide=grids.densities)

        plane = [relays(w) for w in grids.half_widths_degc]
        found.append(Block(rows.of(np.column_stack(plane)), {"place": place.name}))
        for width in grids.sharp_degc:
            held = play(course, width) - course
            loops = rows.of(np.column_stack([held[first:] / width, relays(width)]))
            shape = {"place": place.name, "half_width": width}
            found.append(Block(loops, shape, 1.0 / len(grids.sharp_degc)))
    scene.cache[key] = found
    return found


def hysteresis(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Any rate-independent loop of the bias."""
    yield from _loops(rows, scene)


def scale_factor_hysteresis(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Any rate-independent loop of the scale factor."""
    for block in _loops(rows, scene):
        yield block._replace(columns=rows.per_ppm[:, None] * block.columns)


def _switched_on(rows: Rows) -> bool:
    """Whether a power-on is known, before the run or within it."""
    return math.isfinite(rows.even.powered_on_s) or bool(rows.even.power_ons_s)


def warm_up(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Any decay since power-on."""
    if _switched_on(rows):
        yield column_block(*(rows.of(rows.even.unwarmed(tau)) for tau in scene.grids.warm_ups_s))
    else:
        yield Block(np.zeros((len(rows), len(scene.grids.warm_ups_s))))


def polarization(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A wave over the optics' temperature, of any phase."""
    grids, span = scene.grids, scene.span_degc
    fastest, slowest = (1.0 / period for period in grids.periods_degc)
    count = int(np.clip((fastest - slowest) * span / grids.cycles_apart, 8, grids.most_periods))
    fastest = min(fastest, slowest + count * grids.cycles_apart / span)
    for place in scene.optics(rows):
        x = rows.of(place.temperature)
        for f in np.linspace(slowest, fastest, count).tolist():
            angle = 2.0 * np.pi * f * (x - 25.0)
            shape = {"period": 1.0 / f, "place": place.name}
            yield Block(np.column_stack([np.sin(angle), np.cos(angle)]), shape, place.weight)


def transition(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A step over temperature where a polymer turns, and the peak of its response to a rate there."""
    low, high = scene.range_degc
    centres = np.arange(low - 2.5, high + 2.6, scene.grids.transition_step_degc)
    for place in scene.coil(rows):
        x = rows.of(place.temperature)
        speed = rows.of(rate(rows.even.time, place.temperature))
        for width in scene.grids.transition_widths_degc:
            for centre in centres.tolist():
                step = np.tanh((x - centre) / width)
                shape = {"transition_temperature": centre, "width": width, "place": place.name}
                peak = (1.0 - step**2) * speed
                # Slopes that differ on the two sides make a peak skewed, and a rate another one beyond.
                yield Block(np.column_stack([step, peak]), shape)
                yield Block(np.column_stack([step, peak, step * peak, step * speed]), shape)


def _two_lags(rows: Rows, places: list[Place], lags_s: tuple[float, ...], sign: float) -> Iterator[Block]:
    """Any two of the lags of each place, less what it is now."""
    for place in places:
        behind = {
            s: rows.of(sign * (lag(rows.even.time, place.temperature, s) - place.temperature)) for s in lags_s
        }
        for one, other in combinations(lags_s, 2):
            yield column_block(behind[one], behind[other], time_constant=one, place=place.name)


def hidden_node(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Places that lag behind what is recorded."""
    places = scene.coil(rows)
    if any(scene.records("T_chamber")):
        places.append(Place(rows.even.temperature("T_chamber"), 1.0, "chamber air"))
    yield from _two_lags(rows, places, scene.grids.node_lags_s, 1.0)


def relaxation(rows: Rows, scene: Scene) -> Iterator[Block]:
    """What decays after a change of temperature."""
    yield from _two_lags(rows, scene.coil(rows), scene.grids.relaxations_s, -1.0)


def rate_product(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Temperature times its rate, and what a slope that is not straight adds."""
    time = rows.even.time
    for place in scene.coil(rows):
        for late in scene.grids.product_lags_s:
            x = lag(time, place.temperature, late)
            u = x - 25.0
            product = rows.of(u * rate(time, x))
            yield column_block(product, place=place.name)
            yield column_block(product, 0.012 * rows.of(u) * product, place=place.name)


def rate_of_temperature(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A response to the rate of temperature that itself depends on temperature."""
    for place in scene.coil(rows):
        u, speed = place.temperature - 25.0, rate(rows.even.time, place.temperature)
        # Spreads of the card's two coefficients, for a slope of one.
        powers = (np.ones(len(u)), 0.012 * u, 1.2e-4 * u**2)
        yield column_block(*(rows.of(speed * c) for c in powers), place=place.name)


def shupe(rows: Rows, scene: Scene) -> Iterator[Block]:
    """The rate of the difference between the faces of the winding, and between can and winding."""
    inner, outer = rows.even.temperature("T_in"), rows.even.temperature("T_out")
    difference = outer - inner
    can = rows.even.temperature("T_case") - 0.5 * (outer + inner)
    for late in scene.grids.shupe_lags_s:
        faces, cans = (rows.of(rate(rows.even.time, lag(rows.even.time, x, late))) for x in (difference, can))
        yield column_block(faces, lag=late)
        yield column_block(faces, cans, lag=late)


def static(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A function of temperature that a parabola does not hold."""
    low, high = scene.range_degc
    for place in scene.coil(rows):
        x = rows.of(place.temperature)
        v = (2.0 * x - low - high) / scene.span_degc
        yield column_block(v**3, v**4, v**5, place=place.name)
        yield Block(bumps(x, low, high, 9), {"place": place.name})


def ageing(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A drift with the unit's own time, from run to run."""
    begun = scene.begun_s[scene.runs.index(rows)]
    hours = np.maximum(rows.time_s + begun, 0.0) / 3600.0
    yield column_block(hours)
    for tau in scene.grids.ageing_s:
        yield column_block(np.log1p(3600.0 * hours / tau), time_constant=tau)


def scale_factor_node(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A scale factor that follows the temperature of a node at or near a place, or any curve of it."""
    speed, grids = rows.per_ppm[:, None], scene.grids
    for place in scene.optics(rows, grids.electronics_mixes):
        x, shape = rows.of(place.temperature), {"place": place.name}
        behind = (lag(rows.even.time, place.temperature, s) for s in grids.behind_s)
        near = [rows.of(place.temperature - late) for late in behind]
        yield Block(speed * (x - 25.0)[:, None], shape, place.weight)
        yield Block(speed * np.column_stack([x - 25.0, *near]), shape, place.weight)
        yield Block(speed * bumps(x, *scene.range_degc, 5), shape, 0.3 * place.weight)


def modulator(rows: Rows, scene: Scene) -> Iterator[Block]:
    """A scale factor that follows the modulator's temperature, with a second loop that corrects it late."""
    speed, lags_s = rows.per_ppm[:, None], scene.grids.modulator_s
    on = _switched_on(rows)
    starts = [rows.of(rows.even.unwarmed(s)) * 100.0 if on else np.zeros(len(rows)) for s in lags_s]
    for place in scene.optics(rows, scene.grids.electronics_mixes):
        x = rows.of(place.temperature) - 25.0
        yield Block(speed * x[:, None], {"place": place.name}, place.weight)
        behind = [x + 25.0 - rows.of(lag(rows.even.time, place.temperature, s)) for s in lags_s]
        for more, how in ((starts, {"starts": True}), (behind, {"corrected": True})):
            columns = speed * np.column_stack([x, *more])
            yield Block(columns, {"place": place.name, **how}, place.weight)


def leads(rows: Rows, scene: Scene) -> Iterator[Block]:
    """Rates of the places that the leads pass, less the coil's."""
    time, (coil_s, case_s) = rows.even.time, scene.grids.lead_lags_s
    coil = 0.5 * (rows.even.temperature("T_in") + rows.even.temperature("T_out"))
    passed = [rows.even.temperature(name) for name in ("T_electronics", "T_case", "T_chamber")]
    passed += [lag(time, coil, coil_s), lag(time, rows.even.temperature("T_case"), case_s)]
    rates = [rows.of(rate(time, x - coil)) for x in passed]
    for i, one in enumerate(rates):
        yield column_block(one)
        for other in rates[i + 1 :]:
            yield column_block(one, other)
