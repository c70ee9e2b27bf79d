"""Limits on the figures after compensation, and whether they are met; warnings as errors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence

from fogml.errors import InputError, known_are
from fogml.runs.findings import Finding
from fogml.validation.metrics import LEAST_RUNS, repeatability_of
from fogml.validation.results import LimitOutcome, Metrics, RunJudgement

_OVER_RUNS = {"bias_repeatability": "bias", "scale_factor_repeatability": "scale_factor"}
QUANTITIES = (*(field.name for field in dataclasses.fields(Metrics)), *_OVER_RUNS)
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
            raise InputError(f"limit on '{name}': no such figure; {known_are(name, QUANTITIES)}")
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
    if quantity in _OVER_RUNS:
        spread = repeatability_of(test)
        found = getattr(spread, _OVER_RUNS[quantity]) if spread is not None else None
        values = [found.after if found is not None else None]
    else:
        values = [getattr(run.after, quantity) for run in test]
    told = [abs(value) for value in values if value is not None]
    if not told:
        raise InputError(
            f"limit on '{quantity}': no test run tells it (scale factor needs turns of the table, "
            "nonlinearity several rates, temperature sensitivity and hysteresis soaks, turn-on time a "
            f"stated power-on and --turn-on-band, repeatability {LEAST_RUNS} test runs of one unit and "
            "axis); drop the limit or give such runs"
        )
    value = max(told)
    return LimitOutcome(quantity=quantity, limit=limit, value=value, met=bool(value <= limit))


STRICT_CODES = ("small_temperature_span", "outside_training", "seen_in_training")
"""Codes of the findings that strictness makes errors."""


def hold_strict(findings: Iterable[tuple[str, Sequence[Finding]]]) -> None:
    """Raise for the first finding that strictness does not allow."""
    for name, found in findings:
        for finding in found:
            if finding.code in STRICT_CODES:
                raise InputError(f"{name}: {finding.message} (an error because --strict is set)")
