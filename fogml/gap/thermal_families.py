"""Families of causes that follow a temperature, its rate or its past.

Each generator gives a family's blocks on one run; `fogml.gap.catalogue` says whose they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from fogml.gap.rows import Rows
from fogml.gap.scene import Block, Place, Scene, column_block, lag, rate
from fogml.runs.run import FloatArray
from fogml.signals.recursions import play_kernel

HALF_WIDTHS_DEGC = (1.5, 3.0, 6.0, 10.0, 16.0, 24.0)
SHARP_DEGC = tuple(float(x) for x in np.geomspace(1.5, 26.0, 14))
"""Half widths that all of a plane's relays may share."""
RELAYS, DENSITY_BUMPS = 48, 5
WARM_UPS_S = (100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0)
PERIODS_DEGC = (1.5, 40.0)
CYCLES_APART = 0.4
"""Periods of a bank lie this many cycles over the range apart: between two, the cosine to one is over 0.9."""
MOST_PERIODS = 56
TRANSITION_STEP_DEGC, TRANSITION_WIDTHS_DEGC = 5.0, (2.5, 5.0, 10.0)
NODE_LAGS_S = (600.0, 1200.0, 2400.0, 3600.0)
RELAXATIONS_S = (900.0, 2000.0, 4500.0, 9000.0, 15000.0)
SHUPE_LAGS_S = (0.0, 60.0, 200.0)
AGEING_S = (3600.0, 21600.0, 86400.0)
Constants = Mapping[str, float]


def bumps(x: FloatArray, low: float, high: float, count: int) -> FloatArray:
    """Smooth bumps over a range that add to one within it, shape (n, count)."""
    centres = np.linspace(low, high, count)
    width = max((high - low) / max(count - 1, 1), 1e-9)
    near = np.exp(-0.5 * ((x[:, None] - centres) / (0.7 * width)) ** 2)
    return np.asarray(near / np.maximum(near.sum(axis=1, keepdims=True), 1e-12))


def relays(x: FloatArray, centres: FloatArray, half_width: float, first: int = 0) -> FloatArray:
    """State of relays within their loops, -1, 0 outside, or 1, shape (n, relays).

    A relay goes up at its centre and half width, down at its centre less that; outside of its loop both
    branches agree. One that nothing has set yet is as `x` came to it from below or above first.
    """
    up, down = x[:, None] >= centres + half_width, x[:, None] <= centres - half_width
    code = up.astype(np.int8) - down.astype(np.int8)
    last = np.maximum.accumulate(np.where(code != 0, np.arange(len(x))[:, None], -1), axis=0)
    virgin = np.where(centres > x[0], -1, 1).astype(np.int8)
    state = np.where(last >= 0, np.take_along_axis(code, np.maximum(last, 0), axis=0), virgin)
    return np.where(code == 0, state, 0)[first:].astype(np.float64)


def preisach(x: FloatArray, low: float, high: float, half_width: float, first: int = 0) -> FloatArray:
    """Loops of relays of one half width, less the mean of their branches, shape (n, bumps).

    Columns are smooth densities over the relays' centres. Reference: I. D. Mayergoyz, Mathematical Models of
    Hysteresis, Springer 1991.
    """
    centres = np.linspace(low - half_width, high + half_width, RELAYS)
    density = bumps(centres, low - half_width, high + half_width, DENSITY_BUMPS) / RELAYS
    return relays(x, centres, half_width, first) @ density


def _loops(rows: Rows, scene: Scene) -> list[tuple[str, float | None, FloatArray]]:
    """Loops of each place: a smooth density over the whole plane, then one half width for all relays."""
    key = ("loops", id(rows))
    if key in scene.cache:
        return list(scene.cache[key])
    low, high = scene.range_degc
    earlier = scene.before(rows)
    places = scene.coil(rows)
    pasts = [scene.coil(r) for r in earlier]
    found: list[tuple[str, float | None, FloatArray]] = []
    for i, place in enumerate(places):
        past = [p[i].temperature[r.kept] for p, r in zip(pasts, earlier)]
        course = np.concatenate([*past, place.temperature])
        first = len(course) - len(place.temperature)
        plane = [preisach(course, low, high, w, first) for w in HALF_WIDTHS_DEGC]
        found.append((place.name, None, rows.of(np.column_stack(plane))))
        for width in SHARP_DEGC:
            held = play_kernel(np.ascontiguousarray(course), width, np.nan)[0] - course
            loops = np.column_stack([held[first:] / width, preisach(course, low, high, width, first)])
            found.append((place.name, width, rows.of(loops)))
    scene.cache[key] = found
    return found


def hysteresis(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Any rate-independent loop of the bias."""
    for place, width, loops in _loops(rows, scene):
        yield _loop_block(loops, place, width)


def scale_factor_hysteresis(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Any rate-independent loop of the scale factor."""
    speed = 1e-6 * rows.of(rows.even.input_rate_deg_h * np.ones(len(rows.kept)))
    for place, width, loops in _loops(rows, scene):
        yield _loop_block(speed[:, None] * loops, place, width)


def _loop_block(loops: FloatArray, place: str, width: float | None) -> Block:
    if width is None:
        return Block(loops, {"place": place})
    return Block(loops, {"place": place, "half_width": width}, 1.0 / len(SHARP_DEGC))


def warm_up(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Any decay since power-on."""
    if not math.isfinite(rows.even.powered_on_s):
        yield Block(np.zeros((len(rows), len(WARM_UPS_S))))
        return
    yield column_block(*(rows.of(rows.even.unwarmed(tau)) for tau in WARM_UPS_S))


def polarization(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A wave over the optics' temperature, of any phase."""
    slowest, fastest = 1.0 / PERIODS_DEGC[1], 1.0 / PERIODS_DEGC[0]
    count = int(np.clip((fastest - slowest) * scene.span_degc / CYCLES_APART, 8, MOST_PERIODS))
    fastest = min(fastest, slowest + count * CYCLES_APART / scene.span_degc)
    frequencies = np.linspace(slowest, fastest, count)
    for place in scene.optics(rows):
        x = rows.of(place.temperature)
        for f in frequencies.tolist():
            angle = 2.0 * np.pi * f * (x - 25.0)
            yield Block(
                np.column_stack([np.sin(angle), np.cos(angle)]),
                {"period": 1.0 / f, "place": place.name},
                place.weight,
            )


def transition(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A step over temperature where a polymer turns, and the peak of its response to a rate there."""
    low, high = scene.range_degc
    centres = np.arange(low - 2.5, high + 2.6, TRANSITION_STEP_DEGC)
    for place in scene.coil(rows):
        x = rows.of(place.temperature)
        speed = rows.of(rate(rows.even.time, place.temperature))
        for width in TRANSITION_WIDTHS_DEGC:
            for centre in centres.tolist():
                step = np.tanh((x - centre) / width)
                shape = {"transition_temperature": centre, "width": width, "place": place.name}
                peak = (1.0 - step**2) * speed
                # Slopes that differ on the two sides make a peak skewed, and a rate another one beyond.
                yield Block(np.column_stack([step, peak]), shape)
                yield Block(np.column_stack([step, peak, step * peak, step * speed]), shape)


def hidden_node(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Places that lag behind what is recorded."""
    time, courses = rows.even.time, scene.coil(rows)
    if "T_chamber" in rows.readings:
        courses = [*courses, Place(rows.even.temperatures["T_chamber"], 1.0, "chamber air")]
    for place in courses:
        behind = {s: rows.of(lag(time, place.temperature, s) - place.temperature) for s in NODE_LAGS_S}
        for one, other in combinations(NODE_LAGS_S, 2):
            yield column_block(behind[one], behind[other], time_constant=one, place=place.name)


def relaxation(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """What decays after a change of temperature."""
    time = rows.even.time
    for place in scene.coil(rows):
        left = {s: rows.of(place.temperature - lag(time, place.temperature, s)) for s in RELAXATIONS_S}
        for one, other in combinations(RELAXATIONS_S, 2):
            yield column_block(left[one], left[other], time_constant=one, place=place.name)


def rate_product(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """Temperature times its rate, and what a slope that is not straight adds."""
    time = rows.even.time
    for place in scene.coil(rows):
        for late in (0.0, 200.0):
            x = lag(time, place.temperature, late)
            u = x - 25.0
            product = rows.of(u * rate(time, x))
            yield column_block(product, place=place.name)
            yield column_block(product, 0.012 * rows.of(u) * product, place=place.name)


def rate_of_temperature(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A response to the rate of temperature that itself depends on temperature."""
    time = rows.even.time
    for place in scene.coil(rows):
        u, speed = place.temperature - 25.0, rate(time, place.temperature)
        # Spreads of the card's two coefficients, for a slope of one.
        yield Block(
            np.column_stack([rows.of(speed * c) for c in (np.ones(len(u)), 0.012 * u, 1.2e-4 * u**2)]),
            {"place": place.name},
        )


def shupe(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """The rate of the difference between the faces of the winding, and between can and winding."""
    difference = rows.even.temperature("T_out") - rows.even.temperature("T_in")
    middle = 0.5 * (rows.even.temperature("T_out") + rows.even.temperature("T_in"))
    can = rows.even.temperature("T_case") - middle
    for late in SHUPE_LAGS_S:
        faces = rows.of(rate(rows.even.time, lag(rows.even.time, difference, late)))
        yield column_block(faces, lag=late)
        yield column_block(faces, rows.of(rate(rows.even.time, lag(rows.even.time, can, late))), lag=late)


def static(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A function of temperature that a parabola does not hold."""
    low, high = scene.range_degc
    for place in scene.coil(rows):
        x = rows.of(place.temperature)
        v = (2.0 * x - low - high) / scene.span_degc
        yield Block(np.column_stack([v**3, v**4, v**5]), {"place": place.name})
        yield Block(bumps(x, low, high, 9), {"place": place.name})


def ageing(rows: Rows, scene: Scene, constants: Constants) -> Iterator[Block]:
    """A drift with the unit's own time, from run to run."""
    begun = scene.begun_s[scene.runs.index(rows)]
    hours = np.maximum(rows.time_s + begun, 0.0) / 3600.0
    yield column_block(hours)
    for tau in AGEING_S:
        yield column_block(np.log1p(3600.0 * hours / tau), time_constant=tau)
