"""What a line of units tells: how much of its gap a cause makes, and which units are unlike the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import coverage, of_interval, share
from fogml.fleet.constants import UnitConstants, fleet_constants
from fogml.fleet.diagnosis import RULES
from fogml.fleet.shares import discoveries, share_interval


@dataclass(frozen=True)
class Line:
    """Units, the deviation of the logarithm of their gaps, and constants of the form."""

    units: int
    differ: float = 1.0
    constants: int = 0


CASES = {
    "4 units": Line(4),
    "12 units": Line(12),
    "24 units": Line(24),
    "12 units, gaps alike": Line(12, 0.5),
    "12 units, 2 constants": Line(12, constants=2),
    "24 units, 2 constants": Line(24, constants=2),
    "24 units, 6 constants": Line(24, constants=6),
}


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    case = CASES[name]
    rng = np.random.default_rng([seed, case.units, case.constants])
    if case.constants:
        return [_named(name, case, repeats, rng)]
    told = []
    for _ in range(repeats):
        gap = np.exp(case.differ * rng.standard_normal(case.units))
        low, high = share_interval(rng.beta(2.0, 3.0, case.units) * gap, gap)
        told.append(of_interval(0.5 * (low + high), 0.4, (low, high)))
    return [coverage(name, "what a cause makes of the gap", told)]


def _named(name: str, case: Line, repeats: int, rng: np.random.Generator) -> dict[str, Any]:
    """How often a fleet without an odd unit names one: constants normal, told to a tenth of their spread."""
    wrong = 0
    width = case.constants
    for _ in range(repeats):
        units = []
        for constants in rng.standard_normal((case.units, width)):
            rows = 10.0 * np.column_stack([np.eye(width), constants + 0.1 * rng.standard_normal(width)])
            told = (
                rows[None],
                {"N": 1.0, "B": 0.0, "K": 0.0},
                0.0,
                100,
                np.zeros(width - 1),
                np.ones(width - 1),
            )
            form = ", ".join(["T^1..3", "dT", "T*dT"]) if width == 6 else f"T^1..{width - 1}"
            units.append(UnitConstants(form, *told, {"T": [0.0, 1.0]}))
        wrong += bool(discoveries(fleet_constants(units).probabilities, RULES.false_share).any())
    return share(name, "an ordinary unit is named", wrong, repeats, RULES.false_share)
