"""Arithmetic that a model takes at each sample: the one count that sweeps and exports state."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.features.atoms import Atom
from fogml.features.bins import ring_of
from fogml.features.terms import Step
from fogml.models.compact import Compact

WINDOW_OPERATIONS = {"block": 8, "slope": 10, "exp": 6, "first": 4}
"""Additions, multiplications and divisions of a window's value at a sample."""
HELD_OPERATIONS = {"block": 14, "slope": 26}
"""Those for each sample, or bin of samples, that a window holds; of one's own as many as a slope's."""
EXPONENTIAL_OPERATIONS = 20


def operations_of_features(atoms: Sequence[Atom], steps: Sequence[Step], sample_s: float) -> int:
    """Additions, multiplications and divisions from a sample to feature columns, windows full.

    Operators of one's own count for what they state.

    Parameters
    ----------
    atoms, steps
        What features are made of, and how.
    sample_s
        Sample interval [s].
    """
    count = 0
    windows = {(atom.signal, atom.window, atom.operator == "diff") for atom in atoms if atom.window}
    for _, window, _ in windows:
        assert window is not None
        alike = "slope" if window.own is not None else window.method
        count += WINDOW_OPERATIONS[alike]
        count += HELD_OPERATIONS.get(alike, 0) * ring_of([window], sample_s)[0]
    count += sum(declared.operations for atom in atoms if (declared := atom.declared))
    count += sum(2 * len(atom.signal.parts) - 1 for atom in atoms)
    count += 4 * len(atoms)
    return count + sum(len(step.atoms) - (step.column is None) for step in steps)


def operations_of_compact(compact: Compact) -> int:
    """The same from feature columns to drift, inside the trained box."""
    network = compact.network
    count = 2 * len(network.linear) + 1 + 2 * len(compact.scale)
    centres, inputs = network.centres.shape
    if centres:
        edges = len(network.edge.columns)
        along = 4 * inputs + 2 if edges else 0
        count += centres * (4 * inputs + along + EXPONENTIAL_OPERATIONS + 2) + 2 * edges + inputs
    return count
