"""``monitor.json``: units in service, schema ``fogml.monitor/1``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from fogml.monitor.changes import Change, Outlier
from fogml.monitor.record import FIGURES
from fogml.monitor.watch import NEAREST, Calibration, UnitWatch

SCHEMA = "fogml.monitor/1"


def monitor_json(
    units: Sequence[UnitWatch],
    *,
    runs_between_false_alarms: float,
    wander: bool = True,
    added: int,
    repeated: int,
    refused: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """What is known of units in service.

    Parameters
    ----------
    units
        As `fogml.monitor.watch.watch` gives them.
    runs_between_false_alarms
        Least mean number of a unit's runs until a false alarm.
    wander
        Whether a bias that wanders counted as no change.
    added, repeated
        Runs that are new, and runs that the store held before.
    refused
        Runs that can't be used, and why.
    """
    return {
        "schema": SCHEMA,
        "runs_between_false_alarms": runs_between_false_alarms,
        "wander": wander,
        "runs": {"added": added, "repeated": repeated},
        "refused": [{"run": run, "reason": reason} for run, reason in (refused or {}).items()],
        "figures": dict(FIGURES),
        "units": [_unit(unit, runs_between_false_alarms) for unit in units],
    }


def _unit(unit: UnitWatch, limit: float) -> dict[str, Any]:
    return {
        "unit": unit.unit,
        "axis": unit.axis,
        "state": unit.state,
        "age_unit": "d" if unit.dated else "run",
        "age": unit.age.tolist(),
        "runs": [asdict(record) for record in unit.records],
        "statistic": unit.chart.statistic.tolist(),
        "alarms": [
            _alarm(unit, change, unit.chart.changes[place:], limit)
            for place, change in enumerate(unit.chart.changes, start=1)
        ],
        "outliers": [_outlier(unit, outlier) for outlier in unit.chart.outliers],
        "calibration": None if unit.calibration is None else _calibration(unit.calibration),
        "notes": list(unit.notes),
    }


def _alarm(unit: UnitWatch, change: Change, later: Sequence[Change], limit: float) -> dict[str, Any]:
    age, runs = unit.age, unit.records
    first, last = change.onset_ci90
    per = "" if change.shape == "step" else f" per {'day' if unit.dated else 'run'}"
    return {
        "raised_at": runs[change.raised_at].run,
        "raised_at_index": change.raised_at,
        "onset": runs[change.onset].run,
        "onset_index": change.onset,
        "onset_started": runs[change.onset].started or None,
        "onset_age": float(age[change.onset]),
        "onset_ci90": [runs[first].run, runs[last].run],
        "statistic": change.statistic,
        "latest_statistic": change.latest_statistic,
        "stands": change.latest_statistic >= limit,
        "figure": change.figure,
        "shape": change.shape,
        "off_course": change.off_course,
        "goes_on": change.shape == "ramp" and all(one.figure != change.figure for one in later),
        "probability": change.probability,
        "size": change.size,
        "size_ci90": list(change.size_ci90),
        "unit": FIGURES[change.figure] + per,
        "nearest": list(NEAREST[change.figure, change.shape]),
    }


def _outlier(unit: UnitWatch, outlier: Outlier) -> dict[str, Any]:
    return {
        "run": unit.records[outlier.index].run,
        "index": outlier.index,
        "told_at": unit.records[outlier.told_at].run,
        "figure": outlier.figure,
        "size": outlier.size,
        "size_ci90": list(outlier.size_ci90),
        "unit": FIGURES[outlier.figure],
    }


def _calibration(told: Calibration) -> dict[str, Any]:
    """Values, with None for what is not foretold."""

    def finite(days: float) -> float | None:
        return days if np.isfinite(days) else None

    return {
        "limit_deg_h": told.limit,
        "trend_deg_h_per_day": told.trend,
        "trend_ci90": list(told.trend_ci90),
        "due_days": finite(told.due_days),
        "due_ci90": [finite(days) for days in told.due_ci90],
    }
