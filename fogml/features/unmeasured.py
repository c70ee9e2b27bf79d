"""Rows at which a temperature was not measured: no window over them is full."""

from __future__ import annotations

import numpy as np

from fogml.features.atoms import Atom, Memories, evaluate
from fogml.runs.run import BoolArray, FloatArray, Run
from fogml.signals.clock import longest_gap_s


def evaluate_measured(
    atoms: tuple[Atom, ...],
    run: Run,
    sample_s: float | None,
    values: FloatArray,
    memories: Memories | None,
    skip: int,
) -> tuple[BoolArray, BoolArray]:
    """As `evaluate` of atoms into `values` of shape (n, a), with windows full only of measurements.

    No window is full where a temperature was not measured (`Run.dropouts`), nor after so long a time
    without a measurement that it would be a gap.
    """
    full, settled = evaluate(atoms, run, sample_s, list(values.T), memories, skip)
    names = dict.fromkeys(name for atom in atoms for name in atom.signal.sensors)
    unmeasured = [bad for name in names if (bad := run.dropouts(name)) is not None]
    if not unmeasured:
        return full, settled
    window_s = max((atom.window.span_s for atom in atoms if atom.window is not None), default=0.0)
    spoiled = _spoiled(run, np.logical_or.reduce(unmeasured), window_s, sample_s)
    for atom, column in zip(atoms, values.T, strict=True):
        if atom.window is not None:
            column[spoiled] = 0.0
    return full & ~spoiled, settled


def _spoiled(run: Run, unmeasured: BoolArray, window_s: float, sample_s: float | None) -> BoolArray:
    """Rows without a measurement, and those after so many that a window would take them for a gap."""
    if not window_s or not unmeasured.any():
        return unmeasured
    longest = longest_gap_s(window_s, run.sample_s if sample_s is None else sample_s)
    edges = np.flatnonzero(np.diff(unmeasured, prepend=False, append=False))
    spoiled = unmeasured.copy()
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if stop < len(run) and run.time[stop] - run.time[max(start - 1, 0)] > longest:
            spoiled[stop : int(np.searchsorted(run.time, run.time[stop] + window_s))] = True
    return spoiled
