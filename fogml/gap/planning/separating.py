"""The programme that pulls effects apart which runs so far can't tell from each other.

The distance of a from b is the whitened length of what is left of a's response, at its size, after the best
fit of b with any amplitude and shape and of the nominal constants under their priors::

    d(a | b)^2 = min over A, s, c of |W (a - A b(s) - F c)|^2 + |c|^2

It is what the square root of twice the gain in log likelihood of a over b would be without noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.gap.model import EffectValue
from fogml.gap.planning.programme_family import Family
from fogml.gap.planning.programme_search import MOST_RUNS, Tried, finely, search
from fogml.gap.planning.rehearsal import FINE_S, ExpectedRuns, Rehearsal, Stage, planned
from fogml.gap.result import SeparatingRun
from fogml.gap.rows import at_amplitude
from fogml.gap.shapes import GridNode, grid
from fogml.twin.effect import Effect
from fogml.twin.quantities import Quantity
from fogml.twin.registry import effect

LEAST_DISTANCE = 3.0
"""Effects less far apart are not told from each other, and one less long does not show."""
MOST_NODES = 48
"""Shapes of each effect that a search fits; more are thinned out."""
_NOTHING = 1e-9
_REACH = 1.5
_STEPS = 80


@dataclass(frozen=True, eq=False)
class Member:
    """An effect to be told from others: as it is, and all that it may be."""

    value: EffectValue
    candidate: Effect
    nodes: tuple[GridNode, ...]


def separating_run(
    on: Stage,
    family: Family,
    members: Sequence[EffectValue],
    *,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
    most: int = MOST_RUNS,
) -> SeparatingRun | None:
    """The programme that pulls effects furthest apart, or shows a single one best.

    Parameters
    ----------
    on
        The twin, whose plant and noise the run would have, at the constants where effects that act on inputs
        are taken.
    family
        What the lab can do, and for how long.
    members
        The effects, each with its size and shape. Of a single one the distance is its whitened length beside
        the constants.
    seed
        Of the search.
    progress
        Told what is being done.
    most
        Programmes that are tried at most.

    Returns
    -------
    SeparatingRun or None
        The programme as the text of a file for `fogml simulate`, its expected distance, and runners-up. None
        where the best programme of the family reaches less than `LEAST_DISTANCE`.

    Raises
    ------
    InputError
        If no effect is given, or one is named twice or unknown.
    """
    told = members_of(on, family, members)
    tried = search(
        family,
        lambda design: log_distance(Rehearsal(on, family, design), told),
        seed=seed,
        most=most,
        progress=progress,
    )
    finals = finely(
        tried, lambda design: log_distance(Rehearsal(on, family, design, FINE_S), told, refined=True)
    )
    distance = math.exp(finals[0].merit)
    if distance < LEAST_DISTANCE:
        return None
    return run_of(on, family, finals, [m.value.id for m in told], distance, "separating-run")


def run_of(
    on: Stage, family: Family, finals: Sequence[Tried], ids: Sequence[str], distance: float, name: str
) -> SeparatingRun:
    """The best of the designs that a search ended with as a programme, the others as alternatives."""
    programme = planned(on, family, finals[0].design, name)
    return SeparatingRun(
        separates=tuple(ids),
        programme=programme.as_yaml(),
        distance=distance,
        hours=finals[0].hours,
        steps=tuple(text for step in programme.steps for text in _sentences(step)),
        alternatives=tuple(
            {
                "summary": family.in_words(one.design),
                "hours": one.hours,
                "programme": planned(on, family, one.design, "alternative").as_yaml(),
                "distance": math.exp(one.merit),
            }
            for one in finals[1:]
        ),
    )


def members_of(on: Stage, family: Family, members: Sequence[EffectValue]) -> tuple[Member, ...]:
    """Effects with the grids of their shapes, as far as a run within the family's limits needs them.

    Raises
    ------
    InputError
        If there is none, one is named twice, unknown, or has a size of 0.
    """
    ids = [m.id for m in members]
    if not ids:
        raise InputError("no effect is given; name one to be shown or several to be told apart")
    twice = sorted({id for id in ids if ids.count(id) > 1})
    if twice:
        raise InputError(f"effect '{twice[0]}' is named twice among those to be told apart")
    rehearsal = Rehearsal(on, family, family.starts()[-1])
    rows = rehearsal.rows
    spans = {
        "s": rows.run.span_s,
        "degC": max(float(np.ptp(rows.temperature)), 1.0),
        "sample": max(rows.row_s, rows.run.sample_s),
    }
    found = []
    for value in members:
        candidate = effect(value.id)
        if value.amplitude == 0.0:
            raise InputError(f"effect '{value.id}' has a size of 0; give the size that is to be told")
        usual = candidate.default_shape(on.model.grade)
        own_shape = usual | {name: number for name, number in value.shape.items() if name in usual}
        shape = at_amplitude(candidate, value.amplitude, own_shape)
        nodes = grid(candidate, on.model.grade, partial(rehearsal.response, value.id), spans)
        kept = [nodes[i] for i in _thinned(len(nodes))]
        own = GridNode(shape, (shape,))
        found.append(Member(EffectValue(value.id, value.amplitude, shape), candidate, (*kept, own)))
    return tuple(found)


def distances(rehearsal: ExpectedRuns, members: Sequence[Member], *, refined: bool = False) -> FloatArray:
    """Distance of each member (row) from each other one (column), shape (k, k).

    On the diagonal stands the length of each beside the constants. `refined` fits shapes between the nodes
    too, which is slower.
    """
    columns = [
        rehearsal.white(m.value.id, [m.value.shape, *(draw for node in m.nodes for draw in node.draws)])
        for m in members
    ]
    starts = np.cumsum([0, *(c.shape[1] for c in columns)])
    every = np.concatenate(columns, axis=1)
    raw = np.sum(every**2, axis=0)
    gram = rehearsal.beside(every)
    # What the constants take up but for rounding is nothing.
    size = np.where(np.diag(gram) > _NOTHING * raw, np.maximum(np.diag(gram), 0.0), 0.0)
    found = np.zeros((len(members), len(members)))
    for a, member in enumerate(members):
        found[a, a] = abs(member.value.amplitude) * math.sqrt(size[starts[a]])
    for a, b in permutations(range(len(members)), 2):
        true, first = starts[a], starts[b] + 1
        sign = math.copysign(1.0, members[a].value.amplitude)
        gains = []
        for node in members[b].nodes:
            places = np.arange(first, first + len(node.draws))
            first += len(node.draws)
            gains.append(_gain(gram[np.ix_(places, places)], sign * gram[places, true], members[b].candidate))
        best = int(np.argmax(gains))
        gain = gains[best]
        if refined and size[true] > 0.0:
            gain = max(
                gain, _refined(rehearsal, every[:, true] * sign, members[b], members[b].nodes[best], gain)
            )
        left = max(size[true] - gain, 0.0) if size[true] > 0.0 else 0.0
        found[a, b] = abs(members[a].value.amplitude) * math.sqrt(left)
    return found


def least_of(apart: FloatArray) -> float:
    """The least over pairs of what `distances` gives, or the length of a single member."""
    return float(apart[0, 0] if len(apart) == 1 else apart[~np.eye(len(apart), dtype=bool)].min())


def log_distance(rehearsal: ExpectedRuns, members: Sequence[Member], *, refined: bool = False) -> float:
    """Logarithm of the least distance, with a floor for none at all."""
    return math.log(max(least_of(distances(rehearsal, members, refined=refined)), 1e-6))


def _thinned(count: int) -> Sequence[int]:
    if count <= MOST_NODES:
        return range(count)
    return np.unique(np.linspace(0, count - 1, MOST_NODES).round().astype(int)).tolist()


def _gain(gram: FloatArray, fit: FloatArray, candidate: Effect) -> float:
    """Squared length that columns take off a response; an amplitude of one sign stays so."""
    if len(fit) == 1:
        wrong = not candidate.amplitude.signed and candidate.amplitude.limits[0] >= 0.0 and fit[0] < 0.0
        return 0.0 if wrong or gram[0, 0] <= 0.0 else float(fit[0] ** 2 / gram[0, 0])
    values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
    keep = values > 1e-9 * max(float(values[-1]), 1e-300)
    along = vectors[:, keep].T @ fit
    return float(np.sum(along**2 / values[keep]))


def _refined(rehearsal: ExpectedRuns, true: FloatArray, member: Member, node: GridNode, gain: float) -> float:
    """The gain with the shape fitted from a node on, where it is free there."""
    from scipy.optimize import minimize

    grade = rehearsal.stage.model.grade
    free = [q for q in member.candidate.shape if all(d[q.name] == node.shape[q.name] for d in node.draws)]
    if not free or gain <= 0.0:
        return gain
    bounds = [_bounds(q, *q.range(grade)) for q in free]

    def lost(x: FloatArray) -> float:
        moved = {q.name: float(value) for q, value in zip(free, x)}
        columns = rehearsal.white(member.value.id, [{**draw, **moved} for draw in node.draws])
        gram = rehearsal.beside(np.column_stack([columns, true]))
        return -_gain(gram[:-1, :-1], gram[:-1, -1], member.candidate)

    start = np.clip([node.shape[q.name] for q in free], *np.array(bounds).T)
    found = minimize(
        lost,
        start,
        method="Nelder-Mead",
        bounds=bounds,
        options={"maxfev": _STEPS * len(free), "xatol": 1e-3},
    )
    return max(gain, -float(found.fun))


def _bounds(quantity: Quantity, low: float, high: float) -> tuple[float, float]:
    """Where a shape may go: its range and half as much again, within what is physical."""
    if low > 0.0:
        reached = low / _REACH, high * _REACH
    else:
        reach = 0.5 * (_REACH - 1.0) * (high - low)
        reached = low - reach, high + reach
    return max(quantity.limits[0], reached[0]), min(quantity.limits[1], reached[1])


def _sentences(step: Any) -> list[str]:
    return [str(step), *(f"  {action}" for action in getattr(step, "actions", ()))]
