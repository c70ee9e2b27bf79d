"""A candidate as columns of the basis: nodes of its grid, whitened, on their main axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.gap.frame import Frame
from fogml.gap.model import Candidate, drawn_per_run
from fogml.gap.observation import Observation
from fogml.gap.priors import plausible_lengths
from fogml.gap.screening import Screening
from fogml.gap.shapes import Node, corners, finer, grid
from fogml.runs.run import FloatArray

MOST_NODES = 16
"""Nodes that are kept of a candidate with more: those that fit best."""
SEARCHED_FROM = 48
MOST_LINES_REFINED = 2
"""Lines of a candidate that are parted, by each way to screen; of other candidates it is one node."""
_APART_CYCLES = 1.0
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
    telling = _telling(candidate, frame, grade)
    nodes = grid(candidate, grade, lambda s: telling.response(candidate.id, s, frame.values), frame.spans)
    count = len(nodes)
    lines, middle = screening.lines(nodes)
    apart = frame.runs if drawn_per_run(candidate) and len(frame.runs) > 1 else []
    tried = _Tried(candidate, frame, screening, apart, [nodes[i] for i in lines])
    if not np.any(tried.columns):
        return []
    tried.refine(nodes)
    if middle is not None:
        tried.add(nodes[middle])
    columns, starts = tried.columns, tried.starts
    usual = abs(candidate.amplitude.typical(grade))  # type: ignore[arg-type]
    signed = candidate.amplitude.signed or candidate.amplitude.range(grade)[0] < 0.0  # type: ignore[arg-type]
    found = []
    for i, stands_for in _kept(tried, count, middle is not None):
        node = tried.nodes[i]
        part = columns[:, starts[i] : starts[i] + len(node.draws)]
        mix = node.mix
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
        sign = int(one_way)
        found.append(
            (NodeColumns(candidate.id, node, (), 1.0 / length, usual * length, weights, sign), basis)
        )
    return found


def _telling(candidate: Candidate, frame: Frame, grade: str) -> Observation:
    """The run of the widest temperatures on which a candidate does anything; the widest if there is none."""
    runs = sorted(frame.observations, key=lambda o: -float(np.ptp(o.temperature)))
    for o in runs:
        if any(np.any(o.response(candidate.id, shape, frame.values)) for shape in corners(candidate, grade)):
            return o
    return runs[0]


class _Tried:
    """Nodes of a candidate with their columns, and how many of its grid each stands for."""

    def __init__(
        self,
        candidate: Candidate,
        frame: Frame,
        screening: Screening,
        apart: Sequence[slice],
        nodes: list[Node],
    ) -> None:
        self._candidate, self._frame, self._screening, self._apart = candidate, frame, screening, apart
        self.nodes, self.shares = nodes, [1.0] * len(nodes)
        self._blocks = [self._responses(nodes)]
        self._gains: list[FloatArray | None] = [None] * len(nodes)

    @property
    def columns(self) -> FloatArray:
        """Whitened responses of all draws of all nodes, shape (n, draws)."""
        if len(self._blocks) > 1:
            self._blocks = [np.concatenate(self._blocks, axis=1)]
        return self._blocks[0]

    @property
    def starts(self) -> list[int]:
        """First column of each node."""
        return [0, *np.cumsum([len(node.draws) for node in self.nodes])[:-1].tolist()]

    def gains(self) -> FloatArray:
        """Gain of each node in nats, beside each of what the screening holds, shape (ways, nodes)."""
        edges = [*self.starts, self.columns.shape[1]]
        new = [i for i, gain in enumerate(self._gains) if gain is None]
        if new:
            widths = [edges[i + 1] - edges[i] for i in new]
            columns = self.columns
            if len(new) < len(self.nodes):
                columns = np.concatenate([columns[:, edges[i] : edges[i + 1]] for i in new], axis=1)
            parts = [_only(columns, run) for run in self._apart] if self._apart else [columns]
            starts = [0, *np.cumsum(widths)[:-1].tolist()]
            found = np.sum([self._screening.gains(part, starts) for part in parts], axis=0)
            for i, gain in zip(new, found.T):
                self._gains[i] = gain
        return np.stack(self._gains, axis=1)  # type: ignore[arg-type]

    def refine(self, grid: Sequence[Node]) -> None:
        """Part the nodes that stand out: a strong effect is told to less than a whole grid can afford."""
        if len(grid) == 1:
            return
        lines = np.array([np.nan if n.frequency_hz is None else n.frequency_hz for n in self.nodes])
        best: set[int] = set()
        for gain in self.gains():
            for _ in range(1 if np.isnan(lines).any() else MOST_LINES_REFINED):
                first = int(np.argmax(gain))
                if np.isfinite(gain[first]):
                    best.add(first)
                near = np.abs(lines - lines[first]) * self._frame.spans["s"] < _APART_CYCLES
                gain = np.where(near, -np.inf, gain)
        for i in best:
            # The first part takes the node's place, the others go to the end.
            parts = finer(self._candidate, grid, self.nodes[i])
            self.nodes[i], self.shares[i], self._gains[i] = parts[0], 1.0 / len(parts), None
            columns = self._responses(parts)
            own = slice(self.starts[i], self.starts[i] + len(parts[0].draws))
            self._blocks[0][:, own] = columns[:, : own.stop - own.start]
            self._append(parts[1:], columns[:, own.stop - own.start :], 1.0 / len(parts))

    def add(self, node: Node) -> None:
        """One node more, at the end."""
        self._append([node], self._responses([node]), 1.0)

    def _append(self, nodes: Sequence[Node], columns: FloatArray, share: float) -> None:
        self.nodes.extend(nodes)
        self.shares.extend([share] * len(nodes))
        self._gains.extend([None] * len(nodes))
        self._blocks.append(columns)

    def _responses(self, nodes: Sequence[Node]) -> FloatArray:
        return self._frame.responses(self._candidate.id, [shape for node in nodes for shape in node.draws])


def _kept(tried: _Tried, count: int, has_middle: bool) -> list[tuple[int, float]]:
    """The nodes that fit best, of many, and the middle one of the others, with how many each stands for.

    Without the middle one an effect would count for less where the nodes are all alike. It is the last node
    where `has_middle`; `count` is the number of nodes of the grid.
    """
    places = list(range(len(tried.nodes)))
    middle = places.pop() if has_middle else None
    if len(places) > SEARCHED_FROM:
        gains = tried.gains()
        best = {i for gain in gains for i in np.argsort(gain[: len(places)])[::-1][:MOST_NODES].tolist()}
        if middle is None:
            others = [i for i in np.argsort(np.sum(gains, axis=0)).tolist() if i not in best]
            middle = others[len(others) // 2] if others else None
        places = sorted(best)
    kept = [(i, tried.shares[i]) for i in places]
    return kept if middle is None else [*kept, (middle, count - sum(share for _, share in kept))]


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
