"""Everything that may explain the runs, whitened and brought to a few columns.

All that follows is linear algebra on inner products of whitened columns, so that its cost does not
depend on the runs' length.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogml.gap.candidate_columns import NodeColumns, candidate_columns
from fogml.gap.frame import Frame, main_axes
from fogml.gap.group import Group
from fogml.gap.model import Candidate
from fogml.gap.screening import Screening
from fogml.runs.run import FloatArray


@dataclass(frozen=True, eq=False)
class Basis:
    """Whitened columns: the data, the constants, the unknown, the candidates.

    Attributes
    ----------
    frame
        The runs.
    rows
        The columns side by side, shape (n, p): residual, constants, unknown, candidates.
    constants
        Columns of the constants, each scaled by its prior's standard deviation.
    kinds
        Groups of the unknown.
    groups
        Columns of each group.
    nodes
        Candidates' nodes.
    within_constants
        Candidates that are one with the constants on these runs, or don't act at all.
    """

    frame: Frame
    rows: FloatArray
    constants: NDArray[np.intp]
    kinds: Mapping[str, Group]
    groups: Mapping[str, NDArray[np.intp]]
    nodes: tuple[NodeColumns, ...]
    within_constants: tuple[str, ...]


def build_basis(
    frame: Frame,
    candidates: Mapping[str, Candidate],
    groups: Sequence[Group],
    grade: str,
    progress: Callable[[str], None] | None = None,
) -> Basis:
    """Whiten everything on all runs.

    Parameters
    ----------
    frame
        The runs.
    candidates
        What may be named.
    groups
        The unknown.
    grade
        Whose ranges are usual.
    progress
        Told of each candidate.
    """
    blocks = [frame.residual, frame.fixed]
    places: dict[str, NDArray[np.intp]] = {}
    first = 1 + frame.fixed.shape[1]
    for group in groups:
        whitened = frame.white(group.columns)
        transform = main_axes(frame.beside(whitened), 1e-4)
        if transform.shape[1] == 0:
            continue
        blocks.append(whitened @ transform)
        places[group.name] = np.arange(first, first + transform.shape[1])
        first += transform.shape[1]
    screening = Screening(frame, blocks[2:])
    nodes: list[NodeColumns] = []
    within = []
    for id, candidate in candidates.items():
        if progress:
            progress(id)
        found = candidate_columns(candidate, frame, grade, screening)
        if not found:
            within.append(id)
        for node, columns in found:
            width = columns.shape[1]
            nodes.append(node.placed(first, width))
            blocks.append(columns)
            first += width
    rows = np.concatenate(blocks, axis=1)
    constants = np.arange(1, 1 + frame.fixed.shape[1])
    kinds = {group.name: group for group in groups if group.name in places}
    return Basis(frame, rows, constants, kinds, places, tuple(nodes), tuple(within))
