"""Every family's blocks over whitened rows at one noise: scaled, with inner products, priors and gains."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.gap.frame import Setting, Whitening
from fogml.gap.linear_gaussian import LinearGaussian, sign_gains, size_gains, wide_gains
from fogml.gap.scene import Family, Scene
from fogml.signals.noise_model import NoiseModel
from fogml.twin.effect import Effect


@dataclass(frozen=True)
class Node:
    """A block of a family over all runs: where its columns are, its shape, weight's logarithm and sign."""

    family: int
    start: int
    stop: int
    shape: Mapping[str, Any]
    log_weight: float
    positive: bool = False


@dataclass(frozen=True)
class Member:
    """A cause of an explanation: its family, the node and size that stand for it."""

    family: int
    node: int
    size: float


@dataclass(frozen=True, eq=False)
class Columns:
    """Blocks of all families on each run, not whitened.

    ``by_run`` has shape (m_r, k) for each run of the scene, held-out ones too.
    """

    families: tuple[Family, ...]
    nodes: tuple[Node, ...]
    by_run: tuple[FloatArray, ...]

    @classmethod
    def of(cls, families: Sequence[Family], scene: Scene) -> Columns:
        """Every family's blocks."""
        nodes: list[Node] = []
        parts: list[list[FloatArray]] = [[] for _ in scene.runs]
        at = 0
        for f, family in enumerate(families):
            by_run = [list(family.build(rows, scene)) for rows in scene.runs]
            # Blocks whose weights add to less are the part of a grid that stands out.
            total = max(sum(b.weight for b in by_run[0]), 1.0)
            for blocks in zip(*by_run, strict=True):
                columns = [b.columns for b in blocks]
                if family.drawn_per_run:
                    columns = apart(columns, scene.fitted)
                for held, own in zip(parts, columns):
                    held.append(own)
                first, width = blocks[0], columns[0].shape[1]
                weight = float(np.log(max(first.weight, 1e-300) / total))
                nodes.append(Node(f, at, at + width, first.shape, weight, first.positive))
                at += width
        return cls(tuple(families), tuple(nodes), tuple(np.concatenate(held, axis=1) for held in parts))


def apart(columns: Sequence[FloatArray], fitted: int) -> list[FloatArray]:
    """Columns with coefficients of each fit run's own, shape (m_r, k) to (m_r, fitted * k); 0 on others."""
    spread = []
    for r, own in enumerate(columns):
        width = own.shape[1]
        wide = np.zeros((len(own), width * fitted))
        if r < fitted:
            wide[:, r * width : (r + 1) * width] = own
        spread.append(wide)
    return spread


class Field:
    """Whitened data, fixed block and columns at one noise, each block scaled to a whitened length of 1.

    Of `only` some nodes, if that is not None.
    """

    def __init__(
        self, setting: Setting, columns: Columns, noise: NoiseModel, only: Sequence[int] | None = None
    ):
        self.setting, self.columns = setting, columns
        self.whitening = Whitening(noise, setting)
        self.fixed = self.whitening.stacked(setting.fixed)
        self.base = LinearGaussian.of(self.whitening.stacked([r.gap for r in setting.scene.fit]))
        self.base = self.base.beside(self.fixed)
        picked = list(range(len(columns.nodes)) if only is None else only)
        spans = [(columns.nodes[i].start, columns.nodes[i].stop) for i in picked]
        raw = columns.by_run
        if only is not None:
            places = np.concatenate([np.arange(*span) for span in spans] or [np.arange(0)])
            raw = tuple(values[:, places] for values in raw[: setting.scene.fitted])
        self.white = self.whitening.stacked(raw)
        edges = np.cumsum([0, *(stop - start for start, stop in spans)])
        whole = np.einsum("ij,ij->j", self.white, self.white)
        kept = whole - np.sum((self.base.basis.T @ self.white) ** 2, axis=0)
        whole, kept = (np.add.reduceat(v, edges[:-1]) if picked else v for v in (whole, kept))
        shown = kept > np.maximum(setting.priors.noise.in_constants * whole, 1e-18)
        # What would stay below a standard deviation at the greatest size that there is can't be seen.
        largest = np.array([self._largest(f) for f in range(len(columns.families))])
        shown &= kept >= largest[np.array([columns.nodes[i].family for i in picked], dtype=np.intp)] ** -2.0
        scales = np.where(shown, 1.0 / np.sqrt(np.where(shown, kept, 1.0)), 0.0)
        self.white *= np.repeat(scales, np.diff(edges))
        self.scale = {i: float(s) for i, s in zip(picked, scales) if s}
        self.at = {
            i: slice(int(a), int(b)) for i, (a, b), s in zip(picked, pairwise(edges.tolist()), scales) if s
        }

    def block(self, node: int) -> FloatArray:
        """Whitened columns of a node of whitened length 1, shape (n, k)."""
        return self.white[:, self.at[node]]

    def design(self, members: Iterable[Member]) -> FloatArray:
        """Fixed block and members with their sizes, shape (n, q)."""
        return np.concatenate([self.fixed, *(m.size * self.block(m.node) for m in members)], axis=1)

    def places(self, members: Iterable[Member]) -> list[slice]:
        """Which columns of `design` are each member's."""
        widths = (self.at[m.node].stop - self.at[m.node].start for m in members)
        return [slice(a, b) for a, b in pairwise(accumulate(widths, initial=self.fixed.shape[1]))]

    def courses(self, members: Sequence[Member], coefficients: FloatArray) -> list[FloatArray]:
        """What each member makes at coefficients of `design`, whitened, shape (n,)."""
        told = zip(members, self.places(members))
        return [m.size * self.block(m.node) @ coefficients[at] for m, at in told]

    def beside(self, members: Iterable[Member]) -> LinearGaussian:
        """The data beside the fixed block and members with their sizes."""
        held = self.base
        for m in members:
            held = held.beside(self.block(m.node), m.size)
        return held

    def _largest(self, family: int) -> float:
        """The greatest amplitude that a family's effect can have, infinite of what is none."""
        declared = self.setting.scene.candidates.get(self.columns.families[family].id)
        return math.inf if declared is None else max(map(abs, declared.amplitude.limits))

    def usual_most(self, family: int) -> float:
        """The greatest amplitude of the card's range, or of the family where it is of no card."""
        held, scene = self.columns.families[family], self.setting.scene
        known = held.kind == "known"
        return scene.candidates[held.id].amplitude.range(scene.grade)[1] if known else held.largest

    def shows(self, family: int, length: float) -> bool:
        """Whether some form of a family reaches a whitened length within its usual range."""
        most, nodes = self.usual_most(family), self.columns.nodes
        return any(s * length <= most for i, s in self.scale.items() if nodes[i].family == family)

    def made(self, declared: Effect, amplitude: float, shape: Mapping[str, float]) -> FloatArray:
        """What an effect at its amplitude makes of the fit runs, whitened, shape (n,)."""
        values, runs = self.setting.values, self.setting.scene.fit
        return self.whitening.stacked([r.made(declared, amplitude, shape, values) for r in runs])


@dataclass(frozen=True, eq=False)
class Group:
    """Blocks of one width: their rows among the nodes, places of their columns, their inner products.

    Those are positive whose sign physics gives. Wide ones hold eigenvalues and eigenvectors, too.
    """

    rows: IndexArray
    places: IndexArray
    grams: FloatArray
    positive: BoolArray
    modes: tuple[FloatArray, FloatArray] | None

    def gains(
        self, part: slice, across: FloatArray, fits: FloatArray, lengths: FloatArray, first: int = 0
    ) -> FloatArray:
        """Gains of some of the blocks at their sizes, and what signs add, shape (2, blocks, sizes).

        Columns begin at `first`.
        """
        at = self.places[part] - first
        beside = across.T[at]
        if self.modes is not None:
            values, vectors = (held[part] for held in self.modes)
            told = zip(values, vectors, beside, fits[at], lengths)
            gains = np.array([wide_gains(*one) for one in told])
            return np.stack([gains, np.zeros(gains.shape)])
        gram = self.grams[part] - beside @ beside.transpose(0, 2, 1) if len(across) else self.grams[part]
        gains, known = size_gains(gram, fits[at], lengths), self.positive[part]
        signs = np.zeros(gains.shape)
        if known.any():
            signs[known] = sign_gains(gram[known], fits[at][known], lengths[known])
        return np.stack([gains, signs])


class Blocks:
    """All nodes, in the order of families.

    Parameters
    ----------
    held
        Columns at one noise.
    across
        Inner products of the constants' basis with all columns.

    Attributes
    ----------
    nodes
        Node of each row.
    rows
        Rows of each family that has blocks.
    spans
        Places of each family's columns.
    lengths, prior
        Sizes, and the logarithms of their priors, shape (rows, sizes).
    """

    def __init__(self, held: Field, across: FloatArray) -> None:
        priors, families, every = held.setting.priors, held.columns.families, held.columns.nodes
        nodes = [i for i in range(len(every)) if i in held.at]
        family = np.array([every[i].family for i in nodes])
        self.nodes, self.rows, self.spans = nodes, {}, {}
        for f in dict.fromkeys(family.tolist()):
            low, high = np.searchsorted(family, [f, f + 1]).tolist()
            self.rows[f] = slice(low, high)
            self.spans[f] = slice(held.at[nodes[low]].start, held.at[nodes[high - 1]].stop)
        plant = np.array([families[f].kind == "plant" for f in family])
        self.lengths = np.where(plant[:, None], priors.plant_lengths, priors.lengths)
        weights = np.array([every[n].log_weight for n in nodes])
        self.prior = weights[:, None] - math.log(priors.sizes) + _range_penalties(held, nodes, self.lengths)
        widths: dict[int, list[int]] = {}
        for row, n in enumerate(nodes):
            widths.setdefault(held.at[n].stop - held.at[n].start, []).append(row)
        self._groups = []
        self._parts: dict[int, list[tuple[Group, slice]]] = {f: [] for f in self.rows}
        for width, rows in widths.items():
            places = np.array([np.arange(held.at[nodes[r]].start, held.at[nodes[r]].stop) for r in rows])
            beside = across.T[places]
            grams = np.array([held.block(nodes[r]).T @ held.block(nodes[r]) for r in rows])
            grams -= beside @ beside.transpose(0, 2, 1)
            modes = None
            if width > priors.search.wide:
                values, vectors = np.linalg.eigh(grams)
                modes = np.maximum(values, 0.0), vectors
            positive = np.array([every[nodes[r]].positive for r in rows])
            group = Group(np.array(rows), places, grams, positive, modes)
            self._groups.append(group)
            for f, span in self.rows.items():
                low, high = np.searchsorted(rows, [span.start, span.stop]).tolist()
                if high > low:
                    self._parts[f].append((group, slice(low, high)))

    def gains(self, across: FloatArray, fits: FloatArray) -> FloatArray:
        """Gain in log evidence of every node at its sizes, and what its sign adds, shape (2, rows, sizes).

        `across` are inner products with what is held beyond the constants, `fits` those with the data
        beside it, of all columns.
        """
        out = np.empty((2, *self.lengths.shape))
        for group in self._groups:
            out[:, group.rows] = group.gains(slice(None), across, fits, self.lengths[group.rows])
        return out

    def gains_of(self, f: int, across: FloatArray, fits: FloatArray, first: int = 0) -> FloatArray:
        """The same of one family, shape (2, own rows, sizes); columns begin at `first`."""
        top = self.rows[f].start
        out = np.empty((2, self.rows[f].stop - top, self.lengths.shape[1]))
        for group, part in self._parts[f]:
            rows = group.rows[part]
            out[:, rows - top] = group.gains(part, across, fits, self.lengths[rows], first)
        return out


def _range_penalties(held: Field, nodes: list[int], lengths: FloatArray) -> FloatArray:
    """Logarithm of how likely each node's sizes are by the card's or family's range, shape (nodes, sizes)."""
    by_family = np.array([held.usual_most(f) for f in range(len(held.columns.families))])
    highest = by_family[[held.columns.nodes[n].family for n in nodes]]
    scales = np.array([held.scale[n] for n in nodes])
    return held.setting.priors.log_usual(scales[:, None] * lengths / highest[:, None])
