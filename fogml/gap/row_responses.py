"""Responses of candidates on a run's rows: means over its samples, or on means where that is as good."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fogml.gap.block_means import BlockMeans
from fogml.gap.model import Decimating, Foreseeable, Responding
from fogml.runs.run import FloatArray, Run

if TYPE_CHECKING:
    from fogml.gap.observation import Observation

LARGEST_SHARE = 1e-3
"""A response taken on means differs by no more than this share of its rms from the mean response."""
MOST_KEPT_BYTES = 160e6
"""Responses of a run that are kept for the next search."""
MOST_OTHER_SETS = 2
"""Sets of shapes of a candidate that are kept beside its grid: the latest."""
PARTS = (1, 3, 9, 27)
"""Parts of a row that inputs are averaged over; the fewest that do are taken."""


class RowResponses:
    """Responses on the rows of one run.

    Whether an effect's response is taken on means, and of how fine parts, is settled once at shapes
    that the model states: those that are asked for later then differ by nothing but their shape.

    Parameters
    ----------
    observation
        The run with its rows and its model.
    """

    def __init__(self, observation: Observation) -> None:
        self._observation = observation
        self._settled: dict[str, OnMeans | None] = {}
        self._finer: dict[int, OnMeans] = {}
        self._kept: dict[str, list[tuple[list[Mapping[str, float]], FloatArray]]] = {}

    @property
    def on_means(self) -> frozenset[str]:
        """Ids of the effects so far whose responses were taken on means."""
        return frozenset(id for id, means in self._settled.items() if means is not None)

    def of(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Response per unit of a candidate's amplitude [deg/h], shape (m,)."""
        o = self._observation
        if id not in self._settled:
            self._settled[id] = self._settle(id, constants)
        means = self._settled[id]
        if means is None:
            return o.averaged(o.model.response(id, shape, constants))
        return means.response(id, shape, constants)

    def at(
        self, id: str, shapes: Sequence[Mapping[str, float]], constants: Mapping[str, float]
    ) -> FloatArray:
        """Responses at several shapes [deg/h], shape (m, shapes).

        Those that stay as they are at other constants are kept.
        """
        for before, kept in self._kept.get(id, ()):
            if before == shapes:
                return kept
        rows = np.column_stack([self.of(id, shape, constants) for shape in shapes])
        model = self._observation.model
        room = MOST_KEPT_BYTES - sum(kept.nbytes for sets in self._kept.values() for _, kept in sets)
        if (
            isinstance(model, Foreseeable)
            and rows.nbytes <= room
            and not any(model.depends_on_constants(id, shape) for shape in shapes)
        ):
            sets = self._kept.setdefault(id, [])
            sets.append((list(shapes), rows))
            # The first set is the grid itself, which every search asks for.
            del sets[1:-MOST_OTHER_SETS]
        return rows

    def _settle(self, id: str, constants: Mapping[str, float]) -> OnMeans | None:
        """The coarsest means that give an effect's response as it is."""
        o = self._observation
        if o.width == 1 or not isinstance(o.model, Decimating):
            return None
        shapes = o.model.shapes_to_compare(id)
        if not shapes:
            return None
        wanted = [o.averaged(o.model.response(id, shape, constants)) for shape in shapes]
        for parts in PARTS:
            # Parts of a sample or two would save next to nothing.
            if o.width < 2 * parts - 1:
                break
            if parts not in self._finer:
                self._finer[parts] = OnMeans.of(o, o.model, parts)
            means = self._finer[parts]
            if all(_agree(means.response(id, s, constants), w) for s, w in zip(shapes, wanted)):
                return means
        return None


def _agree(taken: FloatArray, wanted: FloatArray) -> bool:
    return bool(np.linalg.norm(taken - wanted) <= LARGEST_SHARE * np.linalg.norm(wanted))


@dataclass(frozen=True, eq=False)
class OnMeans:
    """A model on means over parts of rows.

    Attributes
    ----------
    model
        The model; its responses have shape (b,).
    means
        From parts to rows; as many samples count for a part as it holds.
    """

    model: Responding
    means: BlockMeans

    @classmethod
    def of(cls, o: Observation, model: Decimating, parts: int) -> OnMeans:
        """A run's model on so many parts of each row."""
        starts = parts_of_blocks(blocks_of_all(o.run, o.width, o.starts), len(o.run), parts)
        rows = np.searchsorted(starts, o.starts), np.searchsorted(starts, o.stops)
        return cls(model.on_means(starts), BlockMeans(*rows, np.diff(starts, append=len(o.run))))

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Response on the rows per unit of a candidate's amplitude [deg/h], shape (m,)."""
        return self.means(self.model.response(id, shape, constants))


def blocks_of_all(run: Run, width: int, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """First samples of blocks that together hold all samples of a run, shape (b,).

    They are the rows' own and, before them, blocks of `width` samples back to the start of each
    stretch: what remembers the past begins there.
    """
    starts = [rows]
    for part in run.stretches:
        following = int(np.searchsorted(rows, part.start))
        first = min(int(rows[following]), part.stop) if following < len(rows) else part.stop
        back = np.arange(first - width, part.start - width, -width, dtype=np.intp)
        starts.append(np.maximum(back, part.start))
    return np.unique(np.concatenate(starts))


def parts_of_blocks(starts: NDArray[np.intp], count: int, parts: int) -> NDArray[np.intp]:
    """First samples of `parts` about equal parts of each block of `count` samples, shape (b,)."""
    lengths = np.diff(starts, append=count)
    return np.unique(starts[:, None] + lengths[:, None] * np.arange(parts) // parts)
