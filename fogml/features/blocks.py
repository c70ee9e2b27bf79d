"""Atom values block by block, for recordings that don't fit into memory, and where nothing was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom, AtomValues, Memories, evaluate
from fogml.runs.run import Run

if TYPE_CHECKING:
    from fogml.features.features import Features


def unmeasured_rows(atoms: Sequence[Atom], run: Run) -> BoolArray | None:
    """Rows at which a temperature of the atoms was not measured (`Run.dropouts`); None if there are none."""
    names = dict.fromkeys(name for atom in atoms for name in atom.signal.sensors)
    masks = [bad for name in names if (bad := run.dropouts(name)) is not None]
    return np.logical_or.reduce(masks) if masks else None


def evaluate_measured(
    atoms: tuple[Atom, ...],
    run: Run,
    sample_s: float | None,
    values: FloatArray,
    memories: Memories | None,
    skip: int,
) -> tuple[BoolArray, BoolArray]:
    """As `evaluate` of atoms into `values` of shape (n, a), from the rows alone at which all was measured.

    To windows and memories the other rows are a gap. At those the values of the last measured row are held,
    before the first one its own, and no window counts.
    """
    unmeasured = unmeasured_rows(atoms, run)
    if unmeasured is None:
        return evaluate(atoms, run, sample_s, list(values.T), memories, skip)
    measured = ~unmeasured
    if not measured.any():
        values[:] = 0.0
        return measured, measured.copy()
    part = np.empty((int(np.count_nonzero(measured)), len(atoms)), order="F")
    taken = int(np.count_nonzero(measured[:skip]))
    nominal = run.sample_s if sample_s is None else sample_s
    full, settled = evaluate(atoms, _rows(run, measured), nominal, list(part.T), memories, taken)
    held = np.maximum(np.cumsum(measured) - 1, 0)
    values[:] = part[held]
    return full[held] & measured, settled[held]


def heeded_rows(atoms: Sequence[Atom], values: FloatArray, full: BoolArray | None) -> list[BoolArray | None]:
    """For each atom the rows (n,) at which its value (n, a) means something; None where all do.

    A windowed atom is 0 where its window holds nothing yet.
    """
    if full is None:
        return [None] * len(atoms)
    return [
        None if atom.window is None else full | (column != 0.0)
        for atom, column in zip(atoms, values.T, strict=True)
    ]


def _rows(run: Run, measured: BoolArray) -> Run:
    """The rows of a mask at which all was measured; a thermometer not in use goes on as it is held."""
    rows = np.flatnonzero(measured)
    columns = {name: values[rows] for name, values in run.without_dropouts.columns.items()}
    return Run.derived(run.name, columns, run.facts, run.gyro_unit)


class FeatureBlocks:
    """Atom values of consecutive blocks of one recording, equal to those of the whole.

    Between blocks it keeps as much history as the longest window needs, and the states of memory operators.

    Parameters
    ----------
    features
        The features.
    sample_s
        Nominal sample interval [s].
    """

    def __init__(self, features: Features, sample_s: float) -> None:
        self._features = features
        self._sample_s = sample_s
        self._history: Run | None = None
        self._memories: Memories = {}
        self._last: tuple[FloatArray, bool] | None = None

    def push(self, block: Run) -> AtomValues:
        """Atom values of the next block, as `Features.atom_values` gives them for the whole.

        Raises
        ------
        InputError
            If the block does not begin after the last one's end, or lacks a column.
        """
        block, history = block.read_by(self._features.thermometer), self._history
        if history is not None and len(block) and len(history) and not block.time[0] > history.time[-1]:
            raise InputError(
                f"{block.name}: a block begins at {block.time[0]} s, not after the last one's end at "
                f"{history.time[-1]} s; give the blocks in time order"
            )
        joined = block if history is None else _joined(history, block)
        added = len(joined) - len(block)
        values, full, settled = self._features.atom_values(
            joined, self._sample_s, memories=self._memories, skip=added
        )
        unmeasured = unmeasured_rows(self._features.atoms, joined)
        if unmeasured is not None and self._last is not None:
            # Before the block's first measured row, what the block before ended with is held.
            held = slice(added, added + int(np.argmin(np.append(unmeasured[added:], False))))
            values[held], settled[held] = self._last
        if len(joined):
            self._last = values[-1].copy(), bool(settled[-1])
            # Two intervals more than the memory, so that no window's edge can fall off.
            oldest = joined.time[-1] - self._features.memory_s - 2.0 * self._sample_s
            # From the row before that on: a gap may lie between, which windows span.
            kept = max(0, int(np.searchsorted(joined.time, oldest, side="right")) - 1)
            if unmeasured is not None:
                # From a measured row on, so that its windows are as long.
                kept = max([0, *np.flatnonzero(~unmeasured[: kept + 1])[-1:].tolist()])
            self._history = joined.end(kept, self._kept(joined))
        return AtomValues(values[added:], full[added:], settled[added:])

    def _kept(self, run: Run) -> tuple[str, ...]:
        """Columns that the features may be made of."""
        own = [name for name in self._features.sensors if name in run.columns]
        return tuple(dict.fromkeys(("time", "gyro", *run.temperature_columns, *own)))


def _joined(history: Run, block: Run) -> Run:
    missing = [name for name in history.columns if name not in block.columns]
    if missing:
        raise InputError(f"{block.name}: a block lacks {', '.join(missing)}, which the one before it held")
    return block.after(history)
