"""Everything that may explain the runs, whitened and brought to a few columns.

All that follows is linear algebra on inner products of whitened columns, so that its cost does not
depend on the runs' length.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fogml.gap.dictionary import Group
from fogml.gap.model import Candidate, Constant
from fogml.gap.observation import Observation
from fogml.gap.priors import plausible_lengths
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.shapes import Node, grid
from fogml.runs.run import FloatArray

MOST_NODES = 16
"""Nodes that are kept of a candidate with more: those that fit best."""
SEARCHED_FROM = 40
LARGEST_RANK = 4
_KEPT = 2e-3
LEAST_SHARE = 0.01
"""A candidate that keeps less of its whitened length beside the constants is one with them."""
_FLAT = 1e6


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
        Indices into the basis, at most `LARGEST_RANK`.
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


@dataclass(frozen=True, eq=False)
class Basis:
    """Inner products of whitened columns.

    Attributes
    ----------
    by_run
        For each run the inner products of [residual, constants, unknown, candidates], (p, p).
    constants
        Columns of the constants, each scaled by its prior's standard deviation.
    groups
        Columns of each group of the unknown.
    transforms
        What makes each group's own columns into those of the basis, shape (k, columns).
    nodes
        Candidates' nodes.
    within_constants
        Candidates that are one with the constants on these runs, or don't act at all.
    """

    by_run: tuple[FloatArray, ...]
    constants: NDArray[np.intp]
    groups: Mapping[str, NDArray[np.intp]]
    transforms: Mapping[str, FloatArray]
    nodes: tuple[NodeColumns, ...]
    within_constants: tuple[str, ...]


def build_basis(
    observations: Sequence[Observation],
    whiteners: Sequence[RunWhitener],
    candidates: Mapping[str, Candidate],
    constants: Sequence[Constant],
    values: Mapping[str, float],
    groups: Sequence[Group],
    grade: str,
    progress: Callable[[str], None] | None = None,
) -> Basis:
    """Whiten everything on all runs.

    Parameters
    ----------
    observations, whiteners
        The runs and the whitener of each.
    candidates
        What may be named.
    constants
        The model's constants with their priors.
    values
        The constants at which candidates that act on inputs are linearised.
    groups
        The unknown.
    grade
        Whose ranges are usual.
    progress
        Told of each candidate.
    """
    edges = np.cumsum([0, *(len(o) for o in observations)])
    parts = [slice(a, b) for a, b in pairwise(edges)]

    def white(columns: Sequence[FloatArray]) -> FloatArray:
        """Columns of each run, shape (m_r, k), whitened and stacked."""
        out = np.empty((edges[-1], columns[0].shape[1]))
        for part, whitener, column in zip(parts, whiteners, columns):
            out[part] = whitener.whiten(column)
        return out

    means = {c.name: c.mean for c in constants}
    residual = white([(o.recorded - o.averaged(o.model.output(means)))[:, None] for o in observations])
    fixed = white([_constant_columns(o, constants) for o in observations])
    blocks = [residual, fixed]
    places: dict[str, NDArray[np.intp]] = {}
    transforms: dict[str, FloatArray] = {}
    first = 1 + fixed.shape[1]
    solve = _Projector(fixed)
    for group in groups:
        whitened = white(group.columns)
        transform = _main_axes(whitened, solve)
        if transform.shape[1] == 0:
            continue
        transforms[group.name] = transform
        columns = whitened @ transform
        blocks.append(columns)
        places[group.name] = np.arange(first, first + columns.shape[1])
        first += columns.shape[1]
    nodes: list[NodeColumns] = []
    within = []
    spans = _spans(observations)
    search = _Search(residual, fixed, blocks[2:])
    for id, candidate in candidates.items():
        if progress:
            progress(id)
        found = _candidate_columns(candidate, observations, values, grade, spans, white, solve, search, parts)
        if found is None:
            within.append(id)
            continue
        for node, columns, size, usual, log_weights, sign in found:
            width = columns.shape[1]
            nodes.append(
                NodeColumns(id, node, tuple(range(first, first + width)), size, usual, log_weights, sign)
            )
            blocks.append(columns)
            first += width
    every = np.concatenate(blocks, axis=1)
    by_run = tuple(every[part].T @ every[part] for part in parts)
    return Basis(by_run, np.arange(1, 1 + fixed.shape[1]), places, transforms, tuple(nodes), tuple(within))


class _Projector:
    """Removes what the constants explain, with flat priors or their own."""

    def __init__(self, fixed: FloatArray) -> None:
        self.fixed = fixed
        gram = fixed.T @ fixed
        self._own = np.linalg.inv(gram + np.eye(len(gram)))
        self._flat = np.linalg.inv(gram + np.eye(len(gram)) / _FLAT)

    def left(self, columns: FloatArray, *, flat: bool = False) -> FloatArray:
        """Inner products of columns beside the constants, shape (k, k)."""
        cross = self.fixed.T @ columns
        inverse = self._flat if flat else self._own
        return np.asarray(columns.T @ columns - cross.T @ inverse @ cross)


class _Search:
    """How well single columns fit, beside the constants and beside each group of the unknown as well."""

    def __init__(self, residual: FloatArray, fixed: FloatArray, groups: Sequence[FloatArray]) -> None:
        smooth = [g for g in groups if g.shape[1] <= 24]
        beside = np.concatenate([fixed, *smooth], axis=1) if smooth else fixed
        self._sets: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        for held in (fixed, beside):
            inverse = np.linalg.inv(held.T @ held + np.eye(held.shape[1]))
            left = residual[:, 0] - held @ (inverse @ (held.T @ residual[:, 0]))
            self._sets.append((held, np.asarray(inverse, dtype=np.float64), left))

    def gains(self, columns: FloatArray, starts: Sequence[int]) -> list[FloatArray]:
        """Gain of each node, whose columns begin at `starts`, in nats, beside each of the two."""
        gains = []
        for held, inverse, left in self._sets:
            cross = held.T @ columns
            fit = left @ columns
            edges = [*starts, columns.shape[1]]
            gain = np.empty(len(starts))
            width = columns.shape[1] // len(starts)
            if width * len(starts) == columns.shape[1] and np.all(np.diff(starts) == width):
                gain = _even_gains(columns, cross, inverse, fit, width)
            else:
                edges = [*starts, columns.shape[1]]
                for i, (a, b) in enumerate(pairwise(edges)):
                    gain[i] = _even_gains(columns[:, a:b], cross[:, a:b], inverse, fit[a:b], b - a)[0]
            gains.append(gain)
        return gains


def _even_gains(
    columns: FloatArray, cross: FloatArray, inverse: FloatArray, fit: FloatArray, width: int
) -> FloatArray:
    """Gains of nodes of the same number of columns, in nats, shape (nodes,)."""
    count = columns.shape[1] // width
    grams = np.empty((count, width, width))
    weighed = inverse @ cross
    for a in range(width):
        for b in range(a, width):
            own = np.einsum("ij,ij->j", columns[:, a::width], columns[:, b::width])
            grams[:, a, b] = own - np.einsum("ij,ij->j", cross[:, a::width], weighed[:, b::width])
            grams[:, b, a] = grams[:, a, b]
    grams += 1e-6 * np.maximum(np.trace(grams, axis1=1, axis2=2), 1e-30)[:, None, None] * np.eye(width)
    fits = fit.reshape(count, width)
    return np.asarray(0.5 * np.einsum("ni,ni->n", fits, np.linalg.solve(grams, fits[:, :, None])[:, :, 0]))


def _candidate_columns(
    candidate: Candidate,
    observations: Sequence[Observation],
    values: Mapping[str, float],
    grade: str,
    spans: Mapping[str, float],
    white: Callable[[Sequence[FloatArray]], FloatArray],
    solve: _Projector,
    search: _Search,
    runs: Sequence[slice],
) -> list[tuple[Node, FloatArray, float, float, FloatArray, int]] | None:
    widest = max(observations, key=lambda o: float(np.ptp(o.temperature)))
    nodes = grid(candidate, grade, lambda shape: widest.model.response(candidate.id, shape, values), spans)
    apart = bool(getattr(candidate, "drawn_per_run", False)) and len(observations) > 1
    columns = white([_responses(o, candidate.id, nodes, values) for o in observations])
    if not np.any(columns):
        return None
    counts = [len(node.draws) for node in nodes]
    starts = np.cumsum([0, *counts])[:-1]
    kept: Sequence[int] = range(len(nodes))
    if len(nodes) > SEARCHED_FROM:
        parts = [_only(columns, run) for run in runs] if apart else [columns]
        gains = [search.gains(part, starts.tolist()) for part in parts]
        order = [np.argsort(sum(gain))[::-1][:MOST_NODES] for gain in zip(*gains)]
        kept = sorted(set(np.concatenate(order).tolist()))
    low, _ = candidate.amplitude.range(grade)  # type: ignore[arg-type]
    usual_amplitude = candidate.amplitude.typical(grade)  # type: ignore[arg-type]
    found = []
    for i in kept:
        part = columns[:, starts[i] : starts[i] + counts[i]]
        count = part.shape[1]
        if apart:
            part = np.concatenate([_only(part, run) for run in runs], axis=1)
        raw = float(np.sum(part**2)) / count
        flat = float(np.trace(solve.left(part, flat=True))) / count
        if raw == 0.0 or flat <= LEAST_SHARE**2 * raw:
            continue
        basis, length = _node_basis(part, solve.left(part), count, LARGEST_RANK * (len(runs) if apart else 1))
        weights = plausible_lengths(candidate, 1.0 / length) - np.log(len(nodes))
        sign = int(basis.shape[1] == 1 and not candidate.amplitude.signed and low >= 0.0)
        if sign and basis[:, 0] @ part[:, 0] < 0.0:
            basis = -basis
        found.append(
            (nodes[i], basis, 1.0 / length, abs(usual_amplitude) * length, weights, sign)
        )
    return found or None


def _responses(o: Observation, id: str, nodes: Sequence[Node], values: Mapping[str, float]) -> FloatArray:
    return np.column_stack(
        [o.averaged(o.model.response(id, shape, values)) for n in nodes for shape in n.draws]
    )


def _only(columns: FloatArray, run: slice) -> FloatArray:
    """Columns of one run, zero on the others."""
    part = np.zeros_like(columns)
    part[run] = columns[run]
    return part


def _node_basis(part: FloatArray, left: FloatArray, count: int, rank: int) -> tuple[FloatArray, float]:
    """Columns whose outer products sum to the mean of the draws', scaled to a length of 1."""
    values, vectors = np.linalg.eigh(left / count)
    keep = np.flatnonzero(values > _KEPT * values[-1])[::-1][:rank]
    length = float(np.sqrt(values[keep].sum()))
    return part @ vectors[:, keep] / (np.sqrt(count) * length), length


def _main_axes(columns: FloatArray, solve: _Projector) -> FloatArray:
    """What brings a group's columns to their main axes beside the constants, a length of 1 in all."""
    scale = np.sqrt(np.maximum(np.diag(solve.left(columns)), 0.0))
    used = np.flatnonzero(scale > 1e-3 * scale.max(initial=0.0))
    if len(used) == 0:
        return np.empty((columns.shape[1], 0))
    values, vectors = np.linalg.eigh(solve.left(columns[:, used] / scale[used]))
    keep = np.flatnonzero(values > 1e-4 * values[-1])[::-1]
    transform = np.zeros((columns.shape[1], len(keep)))
    transform[used] = vectors[:, keep] / scale[used, None] / np.sqrt(values[keep].sum())
    return transform


def _constant_columns(o: Observation, constants: Sequence[Constant]) -> FloatArray:
    columns = o.model.columns()
    return np.column_stack(
        [c.sd * o.averaged(columns[c.name]) if c.name in columns else np.zeros(len(o)) for c in constants]
    )


def _spans(observations: Sequence[Observation]) -> dict[str, float]:
    low = min(float(o.temperature.min()) for o in observations)
    high = max(float(o.temperature.max()) for o in observations)
    return {
        "s": max(o.run.span_s for o in observations),
        "degC": max(high - low, 1.0),
        "sample": max(max(o.row_s, o.run.sample_s) for o in observations),
    }
