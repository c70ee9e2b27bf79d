"""Warnings on temperatures and rates as errors, for those who ask for it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fogml.errors import InputError
from fogml.runs.findings import Finding

STRICT_CODES = ("small_temperature_span", "outside_training", "seen_in_training")
"""Codes of the findings that strictness makes errors."""


def hold_strict(findings: Iterable[tuple[str, Sequence[Finding]]]) -> None:
    """Raise for the first finding that strictness does not allow.

    Parameters
    ----------
    findings
        Name of each run with its findings.

    Raises
    ------
    InputError
        Naming the run and what was found.
    """
    for name, found in findings:
        for finding in found:
            if finding.code in STRICT_CODES:
                raise InputError(f"{name}: {finding.message} (an error because --strict is set)")
