"""Arithmetic that a plan takes at each sample."""

from __future__ import annotations

from fogml.export.layout import ring_of
from fogml.export.plan import Plan

WINDOW_OPERATIONS = {"block": 8, "slope": 10, "exp": 6, "first": 4}
"""Additions, multiplications and divisions of a window's value at a sample."""
HELD_OPERATIONS = {"block": 14, "slope": 26}
"""Those for each sample, or bin of samples, that a window holds."""
EXPONENTIAL_OPERATIONS = 20
MEMORY_OPERATIONS = {"lag": 6, "play": 8, "beyond": 9, "since_on": EXPONENTIAL_OPERATIONS + 1}
"""The same of a memory's step, at a steady sample interval."""


def operations_per_sample(plan: Plan) -> int:
    """Additions, multiplications and divisions at a sample inside the trained box, windows full."""
    count = 0
    windows = {(atom.signal, atom.window, atom.operator == "diff") for atom in plan.atoms if atom.window}
    for _, window, _ in windows:
        assert window is not None
        count += WINDOW_OPERATIONS[window.method]
        if window.method in HELD_OPERATIONS:
            count += HELD_OPERATIONS[window.method] * ring_of([window], plan.sample_s)[0]
    count += sum(MEMORY_OPERATIONS[a.operator] for a in plan.atoms if a.operator in MEMORY_OPERATIONS)
    count += sum(2 * len(atom.signal.parts) - 1 for atom in plan.atoms)
    count += 4 * len(plan.atoms)
    count += sum(len(step.atoms) - (step.column is None) for step in plan.steps)
    count += 2 * len(plan.names) + 1
    if plan.gives_rate:
        count += 6
    if plan.centres:
        along = 4 * plan.dimensions + 2 if plan.edge_columns else 0
        count += plan.centres * (4 * plan.dimensions + along + EXPONENTIAL_OPERATIONS + 2)
        count += 2 * len(plan.edge_columns) + plan.dimensions
    return count
