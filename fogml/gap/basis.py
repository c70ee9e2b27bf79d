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
from fogml.gap.model import Candidate, told_by
from fogml.gap.screening import Screening
from fogml.runs.run import FloatArray

STILL = 0.01
"""A drive that changes by less of its size stands still."""


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
        Candidates that are one with the constants on these runs, or don't act at all, or can't be told
        from others because a drive stands still.
    """

    frame: Frame
    rows: FloatArray
    constants: NDArray[np.intp]
    kinds: Mapping[str, Group]
    groups: Mapping[str, NDArray[np.intp]]
    nodes: tuple[NodeColumns, ...]
    within_constants: tuple[str, ...]

    def beside_own(self, node: NodeColumns, columns: FloatArray) -> FloatArray:
        """Whitened columns, shape (n, k), less what a node's own columns can make of them."""
        own = self.rows[:, list(node.columns)]
        return np.asarray(columns - own @ np.linalg.lstsq(own, columns, rcond=None)[0])


def build_basis(
    frame: Frame,
    candidates: Mapping[str, Candidate],
    groups: Sequence[Group],
    grade: str,
    progress: Callable[[str], None] | None = None,
    beside: Sequence[FloatArray] | None = None,
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
    beside
        For each run columns beside which candidates are screened as well, shape (m, k).
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
    screening = Screening(frame, blocks[2:], None if beside is None else frame.white(beside))
    nodes: list[NodeColumns] = []
    within = []
    for id, candidate in candidates.items():
        if progress:
            progress(id)
        still = stands_still(candidate, frame)
        found = [] if still else candidate_columns(candidate, frame, grade, screening)
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


def stands_still(candidate: Candidate, frame: Frame) -> bool:
    """Whether what would tell a candidate from others is not recorded to change on these runs."""
    held = [o.run.columns for o in frame.observations]

    def changes(name: str) -> bool:
        drives = [columns[name] for columns in held if name in columns]
        return any(np.ptp(drive) > STILL * np.abs(drive).max() for drive in drives)

    return not all(any(map(changes, group)) for group in told_by(candidate))
