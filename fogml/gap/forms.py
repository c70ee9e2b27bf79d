"""Which rests are a matter of an effect's form: what an effect lacks is like the effect.

A rest that no effect of a set could make anything of is another cause, however small it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np

from fogml.gap.evidence import Field
from fogml.gap.priors import LENGTHS
from fogml.runs.run import FloatArray

UNLIKE = 0.02
"""Weight of a rest that can make nothing of the effect."""
_ROUNDING = 1e-6


class Forms:
    """How far groups of the unknown are like effects, over one field.

    Parameters
    ----------
    field
        Inner products of everything.
    """

    def __init__(self, field: Field) -> None:
        self._field = field
        self._made: dict[int, FloatArray] = {}

    def log_weights(self, effects: Iterable[tuple[int, float]]) -> FloatArray:
        """Logarithms of the weights of groups as rests of form, shape (groups, lengths).

        `effects` are nodes, with the largest whitened length that a rest of form of each may have.
        """
        shares = np.full((len(self._field.basis.groups), len(LENGTHS)), UNLIKE)
        for node, room in effects:
            fits = room >= LENGTHS
            shares[:, fits] = np.maximum(shares[:, fits], self.made(node)[:, None])
        return np.log(shares)

    def made(self, node: int) -> FloatArray:
        """Share of a node's response that each group can make beside the constants, shape (groups,)."""
        if node not in self._made:
            gram = self._field.gram
            own = np.array(self._field.basis.nodes[node].columns, dtype=np.intp)
            whole = float(np.trace(gram[np.ix_(own, own)]))
            shares = []
            for places, inverse in zip(self._field.basis.groups.values(), self._inverses):
                across = gram[np.ix_(places, own)]
                shares.append(float(np.sum(across * (inverse @ across))) / whole)
            self._made[node] = np.clip(shares, 0.0, 1.0)
        return self._made[node]

    @cached_property
    def _inverses(self) -> list[FloatArray]:
        """Of each group's inner products beside the constants."""
        inner = (self._field.gram[np.ix_(places, places)] for places in self._field.basis.groups.values())
        return [
            np.asarray(np.linalg.pinv(block, rcond=_ROUNDING, hermitian=True), np.float64) for block in inner
        ]
