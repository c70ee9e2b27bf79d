"""What a thermometer can show, as the constants of C code."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

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
