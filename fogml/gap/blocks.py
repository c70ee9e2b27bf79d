"""Every family's nodes at one noise: priors by size, inner products beside the constants, gains."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.gap.frame import Field
from fogml.gap.linear_gaussian import sign_gains, size_gains, wide_gains
from fogml.runs.run import FloatArray

WIDE = 40
"""Columns from which on a block is met through its eigenvectors, which are worked out once."""


@dataclass(frozen=True, eq=False)
class Group:
    """Blocks of one width: their rows among the nodes, places of their columns, their inner products.

    Those are positive whose sign physics gives. Wide ones hold eigenvalues and eigenvectors, too.
    """

    rows: NDArray[np.intp]
    places: NDArray[np.intp]
    grams: FloatArray
    positive: NDArray[np.bool_]
    modes: tuple[FloatArray, FloatArray] | None

    def gains(
        self, part: slice, across: FloatArray, fits: FloatArray, lengths: FloatArray, first: int = 0
    ) -> FloatArray:
        """Gains of some of the blocks at their sizes, shape (blocks, sizes); columns begin at `first`."""
        at = self.places[part] - first
        beside = across.T[at]
        if self.modes is not None:
            values, vectors = (held[part] for held in self.modes)
            told = zip(values, vectors, beside, fits[at], lengths)
            return np.array([wide_gains(*one) for one in told])
        gram = self.grams[part] - beside @ beside.transpose(0, 2, 1) if len(across) else self.grams[part]
        gains, known = size_gains(gram, fits[at], lengths), self.positive[part]
        if known.any():
            gains[known] += sign_gains(gram[known], fits[at][known], lengths[known])
        return gains


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
        priors, families = held.setting.priors, held.columns.families
        nodes = [i for i, n in enumerate(held.columns.nodes) if i in held.at]
        family = np.array([held.columns.nodes[i].family for i in nodes])
        self.nodes, self.rows, self.spans = nodes, {}, {}
        for f in dict.fromkeys(family.tolist()):
            low, high = np.searchsorted(family, [f, f + 1]).tolist()
            self.rows[f] = slice(low, high)
            self.spans[f] = slice(held.at[nodes[low]].start, held.at[nodes[high - 1]].stop)
        plant = np.array([families[f].kind == "plant" for f in family])
        self.lengths = np.where(plant[:, None], priors.plant_lengths, priors.lengths)
        weights = np.array([held.columns.nodes[n].log_weight for n in nodes])
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
            if width > WIDE:
                values, vectors = np.linalg.eigh(grams)
                modes = np.maximum(values, 0.0), vectors
            positive = np.array([held.columns.nodes[nodes[r]].positive for r in rows])
            group = Group(np.array(rows), places, grams, positive, modes)
            self._groups.append(group)
            for f, span in self.rows.items():
                low, high = np.searchsorted(rows, [span.start, span.stop]).tolist()
                if high > low:
                    self._parts[f].append((group, slice(low, high)))

    def gains(self, across: FloatArray, fits: FloatArray) -> FloatArray:
        """Gain in log evidence of every node at its sizes, shape (rows, sizes).

        `across` are inner products with what is held beyond the constants, `fits` those with the data
        beside it, of all columns.
        """
        out = np.empty(self.lengths.shape)
        for group in self._groups:
            out[group.rows] = group.gains(slice(None), across, fits, self.lengths[group.rows])
        return out

    def gains_of(self, f: int, across: FloatArray, fits: FloatArray, first: int = 0) -> FloatArray:
        """The same of one family, shape (own rows, sizes); columns begin at `first`."""
        top = self.rows[f].start
        out = np.empty((self.rows[f].stop - top, self.lengths.shape[1]))
        for group, part in self._parts[f]:
            rows = group.rows[part]
            out[rows - top] = group.gains(part, across, fits, self.lengths[rows], first)
        return out


def _range_penalties(held: Field, nodes: list[int], lengths: FloatArray) -> FloatArray:
    """Logarithm of how likely each node's sizes are by the card's or family's range, shape (nodes, sizes)."""
    families, scene = held.columns.families, held.setting.scene
    highest = np.array(
        [
            scene.candidates[f.id].amplitude.range(scene.grade)[1] if f.kind == "known" else f.largest  # type: ignore[arg-type]
            for f in families
        ]
    )[[held.columns.nodes[n].family for n in nodes]]
    scales = np.array([held.scale[n] for n in nodes])
    over = np.log(np.maximum(scales[:, None] * lengths / highest[:, None], 1.0))
    return np.asarray(-0.5 * (over / math.log(held.setting.priors.beyond_range)) ** 2)
