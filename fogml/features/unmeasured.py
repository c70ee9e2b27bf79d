"""Rows at which a temperature was not measured: no window or memory takes them in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.features.atoms import Atom, Memories, evaluate
from fogml.runs.run import BoolArray, FloatArray, Run


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
