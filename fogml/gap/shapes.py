"""Grids over a candidate's shape parameters.

A shape parameter that the response depends on in proportion, and an angle, need no grid: what they
can do is a few columns beside each other, with the second moments of their priors. The others get
nodes close enough that a response between two of them is like one of both; of a strong effect that is
not near enough, and the nodes that stand out are parted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.settings import STANDARD, Grids
from fogml.twin.effect import Effect
from fogml.twin.quantities import Grade, Quantity

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
    grids: Grids = STANDARD.grids,
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
    usual = candidate.default_shape(grade)
    turning = [q for q in candidate.shape if q.all_round]
    rest = [q for q in candidate.shape if q not in turning]
    linear = [q for q in rest if not is_line(q) and _in_proportion(q, grade, response, usual)]
    bent = [q for q in rest if q not in linear]
    count = grids.grid_nodes[min(len(bent), 3) - 1]
    axes = [_axis(q, grade, count, spans, grids) for q in bent]
    directions = {q.name: _directions(q, response, usual) for q in turning}
    points = _spread(linear, directions, grade)
    turns = math.prod(map(len, directions.values()))
    about = [{AT_AMPLITUDE: float(a)} for a in candidate.amplitudes] or [{}]
    nodes = []
    for values, at in product(product(*axes), about):
        shape = usual | {q.name: value for q, value in zip(bent, values)} | at
        nodes.append(GridNode(shape, tuple(shape | more for more in points), turns))
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
