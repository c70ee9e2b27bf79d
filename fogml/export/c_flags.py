"""What decides flags, as the constants of C code: what a thermometer can show, and trained ranges."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

import numpy as np

from fogml.arrays import IntArray
from fogml.escaping import c_text
from fogml.export.plan import Plan
from fogml.runs.dropouts import DropoutRule

_CLOCK_US = 2**32 - 1
"""Longest time that a 32-bit clock tells [us]."""


def thermometer_rule(
    rule: DropoutRule, number: Callable[[Any], str], readable_degC: float, step_degC: float | None = None
) -> dict[str, str]:
    """The templates' values of a rule.

    Parameters
    ----------
    rule
        What a thermometer can show.
    number
        How a number is written in C.
    readable_degC
        Furthest from 0 that a reading is taken.
    step_degC
        Temperatures are whole numbers of such steps; None where they are none.
    """

    def steps(value: float) -> float:
        return value if step_degC is None else round(value / step_degC)

    low, high = steps(max(rule.low_degC, -readable_degC)), steps(min(rule.high_degC, readable_degC))
    rate = steps(rule.rate_degC_s)
    return {
        "low": number(low),
        "high": number(high),
        "jump": number(steps(rule.jump_degC)),
        "rate": number(rate),
        "continuing": number(steps(rule.continuing_degC)),
        "spell_us": str(round(1e6 * rule.spell_s)),
        "any_heat_us": str(min(ceil(1e6 * (high - low) / max(rate, 1e-6)), _CLOCK_US)),
    }


def slice_inputs(plan: Plan, bits: IntArray | None = None) -> list[str]:
    """Each input as an expression of atoms.

    Parameters
    ----------
    plan
        The plan.
    bits
        In fixed point, the bits behind the point of each atom, shape (a,).
    """
    if plan.limits.slices is None:
        return []
    found = []
    for i, j in zip(plan.limits.slices.of, plan.limits.slices.less):
        text = f"atom[{i}]" if j < 0 else f"atom[{i}] - atom[{j}]"
        if bits is not None and j >= 0:
            least = int(min(bits[i], bits[j]))
            text = f"scaled(atom[{i}], {bits[i] - least}) - scaled(atom[{j}], {bits[j] - least})"
        found.append(text)
    return found


def slice_numbers(plan: Plan, bits: IntArray | None = None) -> dict[str, Any]:
    """What the code holds: ``first``, ``width``, ``low`` and ``high``, the last two of shape (c, s)."""
    slices = plan.limits.slices
    assert slices is not None
    low, high = slices.bounds
    if bits is None:
        return {"first": slices.first, "width": slices.width, "low": low, "high": high}
    level = 2.0 ** bits[slices.level]
    pairs = zip(slices.of, slices.less)
    steps = 2.0 ** np.array([min(bits[i], bits[j]) if j >= 0 else bits[i] for i, j in pairs])[:, None]
    return {
        "first": round(slices.first * level),
        "width": max(1, round(slices.width * level)),
        "low": np.round(low * steps),
        "high": np.round(high * steps),
    }


def slice_comment(plan: Plan) -> list[str]:
    """The lines above those numbers."""
    slices, names = plan.limits.slices, [atom.text for atom in plan.atoms]
    assert slices is not None
    inputs = [names[i] + (f" less {names[j]}" if j >= 0 else "") for i, j in zip(slices.of, slices.less)]
    return [
        "",
        f"/* Trained ranges in each slice of {c_text(names[slices.level])}: {c_text(', '.join(inputs))}. */",
        f"#define SLICED {len(slices.of)}",
        f"#define SLICES {slices.low.shape[1]}",
    ]
