"""An effect that goes with a temperature within the winding, which no sensor sits on.

A recorded temperature is that of a face. What acts in the whole winding follows its mean, which a ramp
parts from the face by some degrees: with the amplitude a part of that is in the output, in proportion to it.
Without room for it a large effect would have another one's name beside it, or be taken for unknown.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.model import FeltWithin
from fogml.runs.run import FloatArray

if TYPE_CHECKING:
    from fogml.gap.basis import Basis


def within_columns(basis: Basis, node: int) -> FloatArray:
    """The whitened column, shape (n, 1), of one standard deviation of the place; (n, 0) where there is none.

    Beside the node's own columns, for an amplitude with a whitened length of 1.
    """
    chosen, frame = basis.nodes[node], basis.frame
    parts = []
    for o in frame.observations:
        change = (
            o.model.felt_within(chosen.candidate, chosen.node.draws[0], frame.values)
            if isinstance(o.model, FeltWithin)
            else None
        )
        if change is None:
            return np.zeros((len(basis.rows), 0))
        parts.append(o.averaged(change)[:, None])
    return chosen.size * basis.beside_own(chosen, frame.white(parts))
