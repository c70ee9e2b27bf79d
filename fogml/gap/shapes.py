"""Grids over a candidate's shape parameters.

A shape parameter that the response depends on in proportion, and an angle, need no grid: what they
can do is a few columns beside each other, with the second moments of their priors. The others get
nodes close enough that a response between two of them is like one of both; of a strong effect that is
not near enough, and the nodes that stand out are parted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import Effect
from fogml.twin.quantities import Grade, Quantity


@dataclass(frozen=True)
class Grids:
    """Grids of the families' shapes and places. Numbers in seconds, degC or counts, as their names say.

    Lags and widths go in steps of about two, between which a response is like one of both neighbours; they
    reach from what a row resolves to what a run of some hours shows.

    Attributes
    ----------
    mixes, place_lags_s, same_degc
        Where a cause may sit: shares of the outer face in its temperature (within, inner, outer, beyond the
        inner one), lags behind that; places that stay so near to one before drive alike.
    electronics_mixes
        The same for the optics and electronics where a slope in temperature is all that acts.
    direction_degc_min
        Rates under this [degC/min] are no direction.
    coarse_step_degc
        Steps of a good sensor are no coarser: part of any recording.
    drift_s, line_spacing, line_neighbours, outstanding_lines
        Lines that stand out: what is slower is drift and taken out first; spacing in cycles over the longest
        run; frequencies beside one that tell what power is usual; how many are looked at closely.
    half_widths_degc, sharp_degc, relays, densities
        Loops: half widths of a Preisach plane's relays, and those that all of them may share; relays of one
        half width, and smooth densities over their centres.
    warm_ups_s
        Decays since power-on.
    periods_degc, cycles_apart, most_periods
        Waves over temperature: shortest and longest period; spacing in cycles over the range, at which the
        cosine to a wave between two is over 0.9; how many at most.
    transition_step_degc, transition_widths_degc
        Transitions of a polymer: spacing of their centres, and widths.
    node_lags_s, relaxations_s, product_lags_s, shupe_lags_s, ageing_s
        Lags of a hidden node, of relaxing stress, of a rate product and of the winding's faces; time scales
        of logarithmic ageing: an hour, six, a day.
    modulator_s, behind_s
        How late a modulator's second loop is; how far a node may lag behind the place it is near.
    machine_lags_s, plant_lags_s, lead_lags_s, moisture_s
        Lags of a chamber's machines, of another plant's nodes, of the coil and the can as leads pass them,
        and of a coil that takes up the air's moisture.
    sensor_lag_s, placement_lag_s
        Scale of a sensor's second lag; lag of a place behind a sensor; skews of the clock.
    cycle_s
        Shortest and longest period of a chamber's own cycle.
    grid_nodes, line_cycles, whole, narrow, beyond, most_lines, place_degc
        A shape of any effect: nodes of each parameter by how many need a grid; spacing of lines in cycles
        over the longest run; parameters that are whole numbers; a usual range of no more than the factor
        `narrow` is a rule of thumb, and a grid of it alone goes `beyond` it by a factor; lines at most;
        spacing of places on the temperature scale.
    smooth_s, steps, single_steps, temperature_bumps, past_s, creeps_s, heals_s, turn_degc
        The unknown: shortest half periods of what is smooth in time; steps in a run, many or a single one;
        bumps of temperature; lags of what remembers it, of what creeps while hot or cold, decays after its
        turns, which are turns once it came back by twice `turn_degc`.
    unknown_lines, line_weight, starts_s
        The unknown: lines, each one among as many as a run of some hours holds between its start and its
        rows; from when to when after the start something may be settling.
    slack_degc, largest_reading_degc, reading_heals_s, reading_steps, reading_single_steps, reading_waves
        A thermometer's unknown error: what one that sticks has to move by before it moves on, as it errs by
        as much and more would be seen; its usual most, class A of IEC 60751 between -40 and 70 degC; how it
        heals; steps in a run, many or a single one, and waves.
    """

    mixes: tuple[float, ...] = (0.5, 0.0, 1.0, -0.5)
    place_lags_s: tuple[float, ...] = (0.0, 600.0, 1800.0)
    same_degc: float = 0.3
    electronics_mixes: tuple[float, ...] = (0.5,)
    direction_degc_min: float = 0.05
    coarse_step_degc: float = 0.0101
    drift_s: float = 3000.0
    line_spacing: float = 0.25
    line_neighbours: int = 41
    outstanding_lines: int = 10
    half_widths_degc: tuple[float, ...] = (1.5, 3.0, 6.0, 10.0, 16.0, 24.0)
    sharp_degc: tuple[float, ...] = tuple(float(x) for x in np.geomspace(1.5, 26.0, 14))
    relays: int = 48
    densities: int = 5
    warm_ups_s: tuple[float, ...] = (100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0)
    periods_degc: tuple[float, float] = (1.5, 40.0)
    cycles_apart: float = 0.4
    most_periods: int = 56
    transition_step_degc: float = 5.0
    transition_widths_degc: tuple[float, ...] = (2.5, 5.0, 10.0)
    node_lags_s: tuple[float, ...] = (600.0, 1200.0, 2400.0, 3600.0)
    relaxations_s: tuple[float, ...] = (900.0, 2000.0, 4500.0, 9000.0, 15000.0)
    product_lags_s: tuple[float, ...] = (0.0, 200.0)
    shupe_lags_s: tuple[float, ...] = (0.0, 60.0, 200.0)
    ageing_s: tuple[float, ...] = (3600.0, 21600.0, 86400.0)
    modulator_s: tuple[float, ...] = (30.0, 300.0, 1000.0)
    behind_s: tuple[float, ...] = (300.0, 1200.0)
    machine_lags_s: tuple[float, ...] = (0.0, 40.0, 150.0)
    plant_lags_s: tuple[float, ...] = (40.0, 100.0, 250.0)
    lead_lags_s: tuple[float, float] = (600.0, 1800.0)
    moisture_s: tuple[float, ...] = (1800.0, 7200.0, 36000.0, 144000.0, 600000.0)
    sensor_lag_s: float = 60.0
    placement_lag_s: float = 600.0
    cycle_s: tuple[float, float] = (60.0, 1500.0)
    grid_nodes: tuple[int, int, int] = (9, 5, 4)
    line_cycles: float = 0.3
    whole: tuple[str, ...] = ("harmonic",)
    narrow: float = 3.0
    beyond: float = 1.3
    most_lines: int = 6000
    place_degc: float = 4.0
    smooth_s: tuple[float, ...] = (7200.0, 2400.0, 900.0, 400.0)
    steps: int = 40
    single_steps: int = 24
    temperature_bumps: tuple[int, int] = (25, 60)
    past_s: tuple[float, ...] = (600.0, 1800.0, 5400.0, 16200.0)
    creeps_s: tuple[float, ...] = (1800.0, 7200.0, 30000.0)
    heals_s: tuple[float, ...] = (900.0, 3000.0, 9000.0, 1e9)
    turn_degc: float = 1.0
    unknown_lines: int = 3
    line_weight: float = 0.01
    starts_s: tuple[float, float] = (30.0, 30000.0)
    slack_degc: tuple[float, ...] = (0.1, 0.3, 1.0)
    largest_reading_degc: float = 0.3
    reading_heals_s: tuple[float, ...] = (1800.0, 7200.0, 30000.0)
    reading_steps: int = 20
    reading_single_steps: int = 12
    reading_waves: int = 12


STANDARD = Grids()


Response = Callable[[Mapping[str, float]], FloatArray]
AT_AMPLITUDE = "at_amplitude"
"""Key of a node's shape: the amplitude about which a response that is not in proportion to it is taken."""


@dataclass(frozen=True)
class GridNode:
    """A point of the grid: a stated shape, and the shapes whose responses span what it can do.

    Attributes
    ----------
    shape
        Shape parameters at the node, linear ones in the middle of their range.
    draws
        Shapes to evaluate, whose responses span what the node can do: the middle of the linear parameters
        first, then one standard deviation along each of them.
    turns
        How many directions each of them is evaluated in.
    """

    shape: Mapping[str, float]
    draws: tuple[Mapping[str, float], ...]
    turns: int = 1

    @property
    def mix(self) -> FloatArray:
        """What makes the draws' responses into columns whose outer products sum to the node's covariance.

        Shape (draws, draws): the response to the middle, and what each standard deviation adds to it.
        """
        change = np.eye(len(self.draws) // self.turns)
        change[0, 1:] = -1.0
        return np.asarray(np.kron(change, np.eye(self.turns)) / math.sqrt(self.turns))


def grid(
    candidate: Effect,
    grade: Grade,
    response: Response,
    spans: Mapping[str, float],
    grids: Grids = STANDARD,
) -> tuple[GridNode, ...]:
    """The nodes of a candidate.

    Parameters
    ----------
    candidate
        The candidate.
    grade
        Whose ranges hold.
    response
        Its response on some run [deg/h], for the test of proportionality.
    spans
        ``"s"``: longest run [s]; ``"degC"``: widest span of temperature [degC]; ``"sample"``: row [s].
    grids
        How close nodes are.
    """
    nodes = _grid(candidate, grade, response, spans, grids)
    about = [{AT_AMPLITUDE: float(a)} for a in candidate.amplitudes] or [{}]
    return tuple(
        replace(node, shape={**node.shape, **at}, draws=tuple({**draw, **at} for draw in node.draws))
        for node in nodes
        for at in about
    )


def usual_shapes(candidate: Effect, grade: Grade) -> tuple[dict[str, float], ...]:
    """Usual shapes: in the middle of their ranges, all at their lowest, all at their highest."""
    ends = ({q.name: q.range(grade)[i] for q in candidate.shape} for i in (0, 1))
    return (candidate.default_shape(grade), *ends)


def _grid(
    candidate: Effect, grade: Grade, response: Response, spans: Mapping[str, float], grids: Grids
) -> tuple[GridNode, ...]:
    if not candidate.shape:
        return (GridNode({}, ({},)),)
    usual = candidate.default_shape(grade)
    turning = [q for q in candidate.shape if q.all_round]
    rest = [q for q in candidate.shape if q not in turning]
    linear = [q for q in rest if not is_line(q) and _in_proportion(q, grade, response, usual)]
    bent = [q for q in rest if q not in linear]
    count = grids.grid_nodes[min(len(bent), 3) - 1]
    axes = [_axis(q, grade, count, spans, grids) for q in bent]
    directions = {q.name: _directions(q, response, usual) for q in turning}
    points = _spread(linear, directions, grade)
    nodes = []
    for values in product(*axes):
        shape = usual | {q.name: value for q, value in zip(bent, values)}
        draws = tuple(shape | more for more in points)
        turns = math.prod(map(len, directions.values()))
        nodes.append(GridNode(shape, draws, turns))
    return tuple(nodes)


def is_line(quantity: Quantity) -> bool:
    """Whether a shape parameter is a period or a frequency."""
    return "period" in quantity.name or "frequency" in quantity.name


def is_whole(quantity: Quantity, grids: Grids) -> bool:
    """Whether a shape parameter counts something."""
    return quantity.whole or quantity.name in grids.whole


def _in_proportion(quantity: Quantity, grade: Grade, response: Response, usual: Mapping[str, float]) -> bool:
    low, high = quantity.range(grade)
    a, m, b = (response({**usual, quantity.name: x}) for x in (low, 0.5 * (low + high), high))
    size = np.linalg.norm(a) + np.linalg.norm(b)
    return bool(np.linalg.norm(m - 0.5 * (a + b)) <= 1e-9 * size)


def _axis(
    quantity: Quantity, grade: Grade, count: int, spans: Mapping[str, float], grids: Grids
) -> Sequence[float]:
    low, high = quantity.range(grade)
    if is_line(quantity):
        return _lines(quantity, low, high, spans, grids)
    if is_whole(quantity, grids):
        return [float(x) for x in np.arange(math.ceil(low), math.floor(high) + 1)]
    if quantity.unit == "degC" and "temperature" in quantity.name:
        # A place on the temperature scale is told to a fraction of what happens there.
        return [float(x) for x in np.arange(low, high + 1e-9, grids.place_degc)]
    if low > 0.0 and high / low > grids.narrow:
        return [float(x) for x in np.geomspace(low, high, count)]
    if low > 0.0 and count == grids.grid_nodes[0]:
        lowest, highest = quantity.limits
        low, high, count = max(low / grids.beyond, lowest), min(high * grids.beyond, highest), count + 2
    return [float(x) for x in np.linspace(low, high, count)]


def _lines(
    quantity: Quantity, low: float, high: float, spans: Mapping[str, float], grids: Grids
) -> Sequence[float]:
    """Values of a period or a frequency, evenly spaced in frequency."""
    is_period = "period" in quantity.name
    first, last = (1.0 / high, 1.0 / low) if is_period else (low, high)
    span = spans["degC"] if quantity.unit.startswith("degC") else spans["s"]
    if not quantity.unit.startswith("degC") and quantity.unit in ("s", "Hz"):
        last = min(last, 0.5 / spans["sample"])
    elif quantity.unit not in ("s", "Hz", "degC"):
        span = (10.0 if is_period else 1.0) * grids.line_cycles * 8.0 / max(last - first, 1e-12)
    if last <= first:
        return [high if is_period else low]
    count = int(np.clip(math.ceil((last - first) * span / grids.line_cycles) + 1, 2, grids.most_lines))
    frequencies = np.linspace(first, last, count)
    return [float(x) for x in (1.0 / frequencies if is_period else frequencies)]


def _directions(quantity: Quantity, response: Response, usual: Mapping[str, float]) -> tuple[float, ...]:
    """Values of an angle whose responses have the mean and the second moments of all directions.

    Two at a right angle do where the opposite direction is the opposite response; where a part of it stays
    as it is, all four.
    """
    first = quantity.tactical[0]
    there, back = (response({**usual, quantity.name: first + turn}) for turn in (0.0, 180.0))
    opposite = np.linalg.norm(there + back) <= 1e-9 * np.linalg.norm(there)
    return tuple(first + turn for turn in ((0.0, 90.0) if opposite else (0.0, 90.0, 180.0, 270.0)))


def _spread(
    linear: Sequence[Quantity], directions: Mapping[str, Sequence[float]], grade: Grade
) -> list[dict[str, float]]:
    """The middle of linear parameters and a standard deviation along each, in all directions of angles."""
    middles, spreads = {}, {}
    for quantity in linear:
        low, high = quantity.range(grade)
        middles[quantity.name] = 0.5 * (low + high)
        spreads[quantity.name] = (high - low) / math.sqrt(12.0)
    points = [middles, *(middles | {name: middles[name] + spreads[name]} for name in spreads)]
    for name, values in directions.items():
        points = [point | {name: value} for point in points for value in values]
    return points
