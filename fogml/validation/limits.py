"""Limits on the figures after compensation, and whether they are met."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

from fogml.errors import InputError
from fogml.validation.results import LimitOutcome, Metrics, RunJudgement

QUANTITIES = tuple(field.name for field in dataclasses.fields(Metrics))
"""Names of the figures that a limit may be put on."""


def check_limits(limits: Mapping[str, float]) -> dict[str, float]:
    """The limits as floats.

    Raises
    ------
    InputError
        For an unknown quantity, listing the known, and for a limit that is no positive number.
    """
    checked = {}
    for name, limit in limits.items():
        if name not in QUANTITIES:
            raise InputError(f"limit on '{name}': no such figure; known are {', '.join(QUANTITIES)}")
        checked[name] = _positive(limit, f"limit {name}")
    return checked


def check_design_index(design_index: float | None) -> None:
    """Raise `InputError` for a design index that is no positive number."""
    if design_index is not None:
        _positive(design_index, "design index")


def _positive(value: float, what: str) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{what} {value:g}: a positive number is needed")
    return float(value)


def outcome_of(quantity: str, limit: float, test: Sequence[RunJudgement]) -> LimitOutcome:
    """A limit against the largest absolute value over the test runs that tell it."""
    values = [getattr(run.after, quantity) for run in test]
    told = [abs(value) for value in values if value is not None]
    if not told:
        raise InputError(
            f"limit on '{quantity}': no test run tells it (scale factor needs turns of the table, "
            "temperature sensitivity and hysteresis need soaks); drop the limit or give such a run"
        )
    value = max(told)
    return LimitOutcome(quantity=quantity, limit=limit, value=value, met=bool(value <= limit))
