"""Grids over a candidate's shape parameters.

A shape parameter that the response depends on in proportion, and an angle, need no grid: what they
can do is a few columns beside each other, with the second moments of their priors. The others get
nodes close enough that a response between two of them is like one of both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fogml.gap.model import Candidate, amplitudes_about
from fogml.runs.run import FloatArray
from fogml.twin.quantities import Quantity

Response = Callable[[Mapping[str, float]], FloatArray]
NODES = {1: 9, 2: 5, 3: 4}
"""Nodes for each parameter that needs a grid, by how many there are."""
CYCLES_BETWEEN_NODES = 0.3
"""A line's frequency is known to this many cycles over the longest run."""
MOST_LINES = 6000
AT_AMPLITUDE = "at_amplitude"
"""Key of a node's shape: the amplitude about which a response that is not in proportion to it is taken."""
PLACE_DEGC = 4.0
"""Spacing of places on the temperature scale [degC]."""


@dataclass(frozen=True)
class Node:
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
    frequency_hz
        Of the line in time that the node is, if it is one.
    """

    shape: Mapping[str, float]
    draws: tuple[Mapping[str, float], ...]
    turns: int = 1
    frequency_hz: float | None = None

    @property
    def mix(self) -> FloatArray:
        """What makes the draws' responses into columns whose outer products sum to the node's covariance.

        Shape (draws, draws): the response to the middle, and what each standard deviation adds to it.
        """
        change = np.eye(len(self.draws) // self.turns)
        change[0, 1:] = -1.0
        return np.asarray(np.kron(change, np.eye(self.turns)) / math.sqrt(self.turns))


def grid(
    candidate: Candidate, grade: str, response: Response, spans: Mapping[str, float]
) -> tuple[Node, ...]:
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
    """
    amplitudes = amplitudes_about(candidate)
    if amplitudes:
        about = [{AT_AMPLITUDE: float(a)} for a in amplitudes]
        nodes = _grid(candidate, grade, response, spans)
        return tuple(
            replace(node, shape={**node.shape, **at}, draws=tuple({**draw, **at} for draw in node.draws))
            for node in nodes
            for at in about
        )
    return _grid(candidate, grade, response, spans)


def _grid(
    candidate: Candidate, grade: str, response: Response, spans: Mapping[str, float]
) -> tuple[Node, ...]:
    if not candidate.shape:
        return (Node({}, ({},)),)
    usual = {q.name: q.typical(grade) for q in candidate.shape}  # type: ignore[arg-type]
    turning = [q for q in candidate.shape if is_angle(q)]
    rest = [q for q in candidate.shape if q not in turning]
    linear = [q for q in rest if not is_line(q) and _in_proportion(q, grade, response, usual)]
    bent = [q for q in rest if q not in linear]
    axes = [_axis(q, grade, NODES[min(len(bent), 3)], spans) for q in bent]
    points = _spread(linear, turning, grade)
    nodes = []
    for values in product(*axes):
        shape = usual | {q.name: value for q, value in zip(bent, values)}
        draws = tuple(shape | more for more in points)
        nodes.append(Node(shape, draws, 2 ** len(turning), _frequency(bent, values)))
    return tuple(nodes)


def _frequency(bent: Sequence[Quantity], values: Sequence[float]) -> float | None:
    for quantity, value in zip(bent, values):
        if is_line(quantity) and quantity.unit in ("s", "Hz"):
            return 1.0 / value if quantity.unit == "s" else value
    return None


def is_angle(quantity: Quantity) -> bool:
    """Whether a shape parameter is a direction all round."""
    low, high = quantity.tactical
    return quantity.unit == "deg" and high - low >= 180.0


def is_line(quantity: Quantity) -> bool:
    """Whether a shape parameter is a period or a frequency."""
    return "period" in quantity.name or "frequency" in quantity.name


def _in_proportion(quantity: Quantity, grade: str, response: Response, usual: Mapping[str, float]) -> bool:
    low, high = quantity.range(grade)  # type: ignore[arg-type]
    a, m, b = (response({**usual, quantity.name: x}) for x in (low, 0.5 * (low + high), high))
    size = np.linalg.norm(a) + np.linalg.norm(b)
    return bool(np.linalg.norm(m - 0.5 * (a + b)) <= 1e-9 * size)


def _axis(quantity: Quantity, grade: str, count: int, spans: Mapping[str, float]) -> Sequence[float]:
    low, high = quantity.range(grade)  # type: ignore[arg-type]
    if is_line(quantity):
        return _lines(quantity, low, high, spans)
    if quantity.name == "harmonic":
        return [float(x) for x in np.arange(math.ceil(low), math.floor(high) + 1)]
    if quantity.unit == "degC" and "temperature" in quantity.name:
        # A place on the temperature scale is told to a fraction of what happens there.
        return [float(x) for x in np.arange(low, high + 1e-9, PLACE_DEGC)]
    if low > 0.0 and high / low > 3.0:
        return [float(x) for x in np.geomspace(low, high, count)]
    return [float(x) for x in np.linspace(low, high, count)]


def _lines(quantity: Quantity, low: float, high: float, spans: Mapping[str, float]) -> Sequence[float]:
    """Values of a period or a frequency, evenly spaced in frequency."""
    is_period = "period" in quantity.name
    first, last = (1.0 / high, 1.0 / low) if is_period else (low, high)
    span = spans["degC"] if quantity.unit.startswith("degC") else spans["s"]
    if not quantity.unit.startswith("degC") and quantity.unit in ("s", "Hz"):
        last = min(last, 0.5 / spans["sample"])
    elif quantity.unit not in ("s", "Hz", "degC"):
        span = (10.0 if is_period else 1.0) * CYCLES_BETWEEN_NODES * 8.0 / max(last - first, 1e-12)
    if last <= first:
        return [high if is_period else low]
    count = int(np.clip(math.ceil((last - first) * span / CYCLES_BETWEEN_NODES) + 1, 2, MOST_LINES))
    frequencies = np.linspace(first, last, count)
    return [float(x) for x in (1.0 / frequencies if is_period else frequencies)]


def _spread(linear: Sequence[Quantity], turning: Sequence[Quantity], grade: str) -> list[dict[str, float]]:
    """The middle of linear parameters and a standard deviation along each, in all directions of angles."""
    middles, spreads = {}, {}
    for quantity in linear:
        low, high = quantity.range(grade)  # type: ignore[arg-type]
        middles[quantity.name] = 0.5 * (low + high)
        spreads[quantity.name] = (high - low) / math.sqrt(12.0)
    points = [middles, *(middles | {name: middles[name] + spreads[name]} for name in spreads)]
    for quantity in turning:
        low = quantity.tactical[0]
        points = [point | {quantity.name: low + turn} for point in points for turn in (0.0, 90.0)]
    return points
