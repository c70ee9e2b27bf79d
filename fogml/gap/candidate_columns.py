"""A candidate as columns of the basis: nodes of its grid, whitened, on their main axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.gap.frame import Frame
from fogml.gap.model import Candidate, drawn_per_run
from fogml.gap.priors import plausible_lengths
from fogml.gap.screening import Screening
from fogml.gap.shapes import Node, grid
from fogml.runs.run import FloatArray

MOST_NODES = 16
"""Nodes that are kept of a candidate with more: those that fit best."""
SEARCHED_FROM = 40
LARGEST_RANK = 4
_KEPT = 2e-3
LEAST_SHARE = 0.01
"""A candidate that keeps less of its whitened length beside the constants is one with them."""


@dataclass(frozen=True, eq=False)
class NodeColumns:
    """A node of a candidate's grid as columns of the basis.

    Attributes
    ----------
    candidate
        Id.
    node
        Shape parameters.
    columns
        Indices into the basis.
    size
        Amplitude that gives a whitened length of 1 beside the constants, in the card's unit.
    usual
        Whitened length at the usual size.
    log_weights
        Logarithm of the prior weight of the node among its candidate's at each of
        `fogml.gap.priors.LENGTHS`.
    sign
        +1 where the first column is the response and the amplitude can't be negative, else 0.
    """

    candidate: str
    node: Node
    columns: tuple[int, ...]
    size: float
    usual: float
    log_weights: FloatArray
    sign: int

    def placed(self, first: int, width: int) -> NodeColumns:
        """The node with its columns' indices."""
        return replace(self, columns=tuple(range(first, first + width)))


def candidate_columns(
    candidate: Candidate, frame: Frame, grade: str, screening: Screening
) -> list[tuple[NodeColumns, FloatArray]]:
    """The nodes of a candidate that these runs can tell from the constants, with their columns.

    Columns have shape (n, rank); their outer products sum to the mean of what the node's shapes
    can do, scaled to a length of 1 beside the constants.
    """
    widest = max(frame.observations, key=lambda o: float(np.ptp(o.temperature)))
    nodes = grid(candidate, grade, lambda s: widest.response(candidate.id, s, frame.values), frame.spans)
    count = len(nodes)
    lines, middle = screening.lines(nodes)
    nodes = tuple(nodes[i] for i in (*lines, *([] if middle is None else [middle])))
    columns = frame.responses(candidate.id, [shape for node in nodes for shape in node.draws])
    if not np.any(columns):
        return []
    apart = frame.runs if drawn_per_run(candidate) and len(frame.runs) > 1 else []
    widths = [len(node.draws) for node in nodes]
    starts = np.cumsum([0, *widths])[:-1]
    usual = abs(candidate.amplitude.typical(grade))  # type: ignore[arg-type]
    signed = candidate.amplitude.signed or candidate.amplitude.range(grade)[0] < 0.0  # type: ignore[arg-type]
    found = []
    for i, stands_for in _kept(columns, starts.tolist(), apart, screening, count, middle is not None):
        part = columns[:, starts[i] : starts[i] + widths[i]]
        mix = nodes[i].mix
        if apart:
            part = np.concatenate([_only(part, run) for run in apart], axis=1)
            mix = np.asarray(np.kron(np.eye(len(apart)), mix), dtype=np.float64)
        raw = float(np.sum(part**2))
        if raw == 0.0 or np.trace(frame.beside(part, flat=True)) <= LEAST_SHARE**2 * raw:
            continue
        rank = LARGEST_RANK * max(len(apart), 1)
        basis, length = _on_axes(part, frame.beside(part), mix, rank)
        weights = plausible_lengths(candidate, 1.0 / length) + np.log(stands_for / count)
        weights += getattr(candidate, "log_prior", 0.0)
        one_way = basis.shape[1] == 1 and not signed
        if one_way and basis[:, 0] @ part[:, 0] < 0.0:
            basis = -basis
        node = NodeColumns(candidate.id, nodes[i], (), 1.0 / length, usual * length, weights, int(one_way))
        found.append((node, basis))
    return found


def _kept(
    columns: FloatArray,
    starts: Sequence[int],
    apart: Sequence[slice],
    screening: Screening,
    count: int,
    has_middle: bool,
) -> list[tuple[int, int]]:
    """The nodes that fit best, of many, and the middle one of the others, with how many each stands for.

    Without the middle one an effect would count for less where the nodes are all alike. It is the last node
    where `has_middle`; `count` is the number of nodes before any was left out.
    """
    places = list(range(len(starts)))
    middle = places.pop() if has_middle else None
    if len(places) > SEARCHED_FROM:
        parts = [_only(columns, run) for run in apart] if apart else [columns]
        gains = [np.sum(gain, axis=0) for gain in zip(*(screening.gains(part, starts) for part in parts))]
        best = {i for gain in gains for i in np.argsort(gain[: len(places)])[::-1][:MOST_NODES].tolist()}
        if middle is None:
            others = [i for i in np.argsort(np.sum(gains, axis=0)).tolist() if i not in best]
            middle = others[len(others) // 2] if others else None
        places = sorted(best)
    kept = [(i, 1) for i in places]
    return kept if middle is None else [*kept, (middle, count - len(places))]


def _only(columns: FloatArray, run: slice) -> FloatArray:
    """Columns of one run, zero on the others."""
    part = np.zeros_like(columns)
    part[run] = columns[run]
    return part


def _on_axes(part: FloatArray, beside: FloatArray, mix: FloatArray, rank: int) -> tuple[FloatArray, float]:
    """Main axes of columns that are mixed, scaled to a length of 1, and their length before."""
    values, vectors = np.linalg.eigh(mix.T @ beside @ mix)
    keep = np.flatnonzero(values > _KEPT * values[-1])[::-1][:rank]
    length = float(np.sqrt(values[keep].sum()))
    return part @ (mix @ vectors[:, keep]) / length, length
