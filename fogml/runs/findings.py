"""What was noticed in a run: each finding says where, how much, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

DEAD = "dead_output"
"""Code of an output that has one value in every sample."""
SATURATION = "saturation"
"""Code of an output that stays at its greatest or least value."""
FIRST_OF_ALL = (
    DEAD,
    "already_compensated",
    "implausible_temperature",
    "thermometers_apart",
    "implausible_clock",
    "implausible_earth_rate",
    "implausible_scale_factor",
    "implausible_rest",
    "late_rate",
    "temperature_dropouts",
    "marks_of_thousands",
)
"""Codes of the findings that make every figure wrong, and are said before any other."""
SPOILING = (DEAD, "stuck_sensor", SATURATION)
"""Codes of samples that are not what the gyro senses, where they are the gyro's."""
OF_DRIFT = ("unknown_column", "small_temperature_span")
"""Codes of the findings that matter to drift models alone."""
IMPLAUSIBLE = {
    "already_compensated": "the output",
    "implausible_temperature": "the temperature",
    "thermometers_apart": "the temperature",
    "implausible_clock": "the clock",
    "implausible_earth_rate": "the output or the attitude",
    "implausible_scale_factor": "the output or the table's rate",
    "implausible_rest": "the output or the table's rate",
}
"""What can't be as the run states it, by the code of the finding."""

OF_TEMPERATURE = tuple(code for code, what in IMPLAUSIBLE.items() if what == "the temperature")
"""Codes of what can't be of a temperature."""
OF_OUTPUT = ("implausible_earth_rate", "implausible_scale_factor", "implausible_rest")
"""Codes of what can't be of an output."""


def first_of_all(findings: Iterable[Finding]) -> list[Finding]:
    """Findings, each once, those first that make every figure wrong."""
    return sorted(dict.fromkeys(findings), key=lambda finding: finding.code not in FIRST_OF_ALL)


def standstill(findings: Iterable[Finding]) -> Finding | None:
    """The finding that a gyro's output stands still, in every sample or for long; None where it moves."""
    stuck = ("stuck_sensor", "gyro")
    return next((one for one in findings if one.code == DEAD or (one.code, one.column) == stuck), None)


def beside_drift(findings: Iterable[Finding]) -> list[Finding]:
    """Findings on a run that no drift model is made of, such as a static one."""
    return [one for one in findings if one.code not in OF_DRIFT]


def of_any_use(run: str, findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """What a laboratory's procedure tells of a run's findings, with the run's name, JSON-ready."""
    return [{"run": run, **one.as_dict()} for one in beside_drift(findings)]


def saturated(findings: Iterable[Finding]) -> tuple[str, int] | None:
    """What is said of a gyro at the ends of its range while no table turns, and how many samples are."""
    found = [one for one in findings if one.code == SATURATION and one.at_rest]
    if not found:
        return None
    return "; ".join(one.message for one in found), sum(one.at_rest or 0 for one in found)


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
    at_rest
        How many of these samples lie where no table turns, where that makes a difference.
    """

    code: str
    message: str
    column: str | None = None
    row: int | None = None
    count: int = 1
    at_rest: int | None = None

    def as_dict(self) -> dict[str, Any]:
        """The finding as JSON-ready values, without empty fields."""
        return {key: value for key, value in asdict(self).items() if value is not None}
