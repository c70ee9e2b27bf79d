"""What was noticed in a run: each finding says where, how much, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

DEAD = "dead_output"
"""Code of an output that has one value in every sample."""
FIRST_OF_ALL = (
    DEAD,
    "already_compensated",
    "implausible_temperature",
    "thermometers_apart",
    "implausible_clock",
    "implausible_earth_rate",
    "implausible_scale_factor",
    "temperature_dropouts",
    "marks_of_thousands",
)
"""Codes of the findings that make every figure wrong, and are said before any other."""
IMPLAUSIBLE = {
    "already_compensated": "the output",
    "implausible_temperature": "the temperature",
    "thermometers_apart": "the temperature",
    "implausible_clock": "the clock",
    "implausible_earth_rate": "the output or the attitude",
    "implausible_scale_factor": "the output or the table's rate",
}
"""What can't be as the run states it, by the code of the finding."""


def first_of_all(findings: Iterable[Finding]) -> list[Finding]:
    """Findings, those first that make every figure wrong."""
    return sorted(findings, key=lambda finding: finding.code not in FIRST_OF_ALL)


def standstill(findings: Iterable[Finding]) -> Finding | None:
    """The finding that a gyro's output stands still, in every sample or for long; None where it moves."""
    stuck = ("stuck_sensor", "gyro")
    return next((one for one in findings if one.code == DEAD or (one.code, one.column) == stuck), None)


def dead_words(value: float) -> str:
    """What is said of an output of one value."""
    return f"'gyro' is {value:.6g} in every sample, as of a gyro that is not connected or not switched on"


@dataclass(frozen=True)
class Finding:
    """One thing noticed on reading or checking a run.

    Attributes
    ----------
    code
        Stable name, e.g. ``gap``, ``stuck_sensor``, ``outliers``, ``repaired_rows``.
    message
        One sentence for people, without the file's name.
    column
        The column concerned, if any.
    row
        First data row concerned, counted from 1 after the header, if any.
    count
        How many samples, rows or gaps are concerned.
    """

    code: str
    message: str
    column: str | None = None
    row: int | None = None
    count: int = 1

    def as_dict(self) -> dict[str, Any]:
        """The finding as JSON-ready values, without empty fields."""
        return {key: value for key, value in asdict(self).items() if value is not None}
