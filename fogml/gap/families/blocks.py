"""A family's nodes at one noise: priors by size, and inner products beside the constants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.gap.families.family import Family
from fogml.gap.families.frame import Field
from fogml.runs.run import FloatArray


@dataclass(frozen=True, eq=False)
class Blocks:
    """A family's nodes at one noise: their prior by size, and their inner products beside the constants.

    ``groups`` hold blocks of one width: rows among the nodes, places of columns, inner products.
    """

    nodes: list[int]
    prior: FloatArray
    lengths: FloatArray
    span: slice
    groups: list[tuple[FloatArray, FloatArray, FloatArray]]

    @classmethod
    def of(cls, held: Field, across: FloatArray, f: int) -> Blocks:
        """Of a family; `across` are the constants' inner products with all columns."""
        family, priors = held.columns.families[f], held.setting.priors
        nodes = [i for i, n in enumerate(held.columns.nodes) if n.family == f and i in held.at]
        lengths = priors.plant_lengths if family.kind == "plant" else priors.lengths
        weights = np.array([held.columns.nodes[n].log_weight for n in nodes])
        prior = weights[:, None] - math.log(len(lengths)) + _range_penalties(held, family, nodes, lengths)
        widths: dict[int, list[int]] = {}
        for row, n in enumerate(nodes):
            widths.setdefault(held.at[n].stop - held.at[n].start, []).append(row)
        groups = []
        for rows in widths.values():
            places = np.array([np.arange(held.at[nodes[r]].start, held.at[nodes[r]].stop) for r in rows])
            grams = np.array([held.block(nodes[r]).T @ held.block(nodes[r]) for r in rows])
            beside = across.T[places]
            groups.append((np.array(rows), places, grams - beside @ beside.transpose(0, 2, 1)))
        spans = [held.at[n] for n in nodes]
        span = slice(min(s.start for s in spans), max(s.stop for s in spans)) if spans else slice(0, 0)
        return cls(nodes, prior, lengths, span, groups)


def _range_penalties(held: Field, family: Family, nodes: Sequence[int], lengths: FloatArray) -> FloatArray:
    """Logarithm of how likely each node's sizes are by the card's range, shape (nodes, sizes)."""
    if family.kind != "known":
        return np.zeros((len(nodes), len(lengths)))
    from fogml.twin.registry import effect

    _, high = effect(family.id).amplitude.range(held.setting.scene.grade)  # type: ignore[arg-type]
    scales = np.array([held.scale[n] for n in nodes])
    over = np.log(np.maximum(scales[:, None] * lengths / high, 1.0))
    return np.asarray(-0.5 * (over / math.log(held.setting.priors.beyond_range)) ** 2)
