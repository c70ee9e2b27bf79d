"""What `monitor.json` says, in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fogml.fleet.summary import label_of
from fogml.report.words import number, plural

FIGURE_WORDS = {
    "level": "bias",
    "temperature_slope": "slope against temperature",
    "rate_slope": "slope against the rate of temperature",
    "scatter": "scatter",
    "scale_factor": "scale factor error",
}
STATE_WORDS = {"baseline": "first runs", "steady": "steady", "alarm": "changed"}


def unit_label(unit: Mapping[str, Any]) -> str:
    """Serial number and axis, or that there is none."""
    return label_of(unit) or "(no name)"


def state_words(unit: Mapping[str, Any]) -> str:
    """A unit's state in a word or two, with its last change."""
    words = STATE_WORDS[unit["state"]]
    if unit["alarms"]:
        words += f": {FIGURE_WORDS[unit['alarms'][-1]['figure']]} since {onset_words(unit['alarms'][-1])}"
    return words


def onset_words(alarm: Mapping[str, Any]) -> str:
    """When a change began: the day where it is known, else the run."""
    started = alarm["onset_started"]
    return str(started)[:10] if started else str(alarm["onset"])


def alarm_words(alarm: Mapping[str, Any]) -> str:
    """An alarm in a few sentences."""
    figure = FIGURE_WORDS[alarm["figure"]]
    size, (low, high) = alarm["size"], alarm["size_ci90"]
    how = f"moves by {number(size)} {alarm['unit']} (90 %: {_interval(low, high)})"
    if alarm["figure"] == "scatter" and alarm["shape"] == "step":
        factors = [math.exp(min(value, 50.0)) for value in (size, low, high)]
        how = f"is {number(factors[0])} times what it was (90 %: {_interval(*factors[1:])})"
    elif alarm["shape"] == "ramp":
        how = f"drifts by {number(size)} {alarm['unit']} (90 %: {_interval(low, high)})"
    first, last = alarm["onset_ci90"]
    between = "" if first == last else f", with 90 % between {first} and {last}"
    return (
        f"The {figure} {how} since {onset_words(alarm)} ({alarm['onset']}{between}); noticed with "
        f"{alarm['raised_at']}. Effects that do so: {', '.join(alarm['nearest'])}."
    )


def calibration_words(unit: Mapping[str, Any]) -> str:
    """When to calibrate again, in a sentence; empty where nothing is known."""
    told = unit["calibration"]
    if told is None:
        return ""
    due, (earliest, latest) = told["due_days"], told["due_ci90"]
    beyond = f"the bias has moved by {number(told['limit_deg_h'])} deg/h"
    if latest is None:
        span = unit["age"][-1] - unit["age"][0]
        if earliest is not None and earliest < span:
            return f"Too few runs to foretell when {beyond}: no trend is seen in {_days(span)}."
        soonest = "100 years" if earliest is None else _days(earliest)
        return f"No trend is seen: not before {soonest} (95 %) will it be that {beyond}."
    return f"Calibrate again in {_days(due)} (90 %: {_days(earliest)} to {_days(latest)}), when {beyond}."


def _days(days: float | None) -> str:
    if days is None:
        return "over 100 years"
    if days < 60:
        return plural(max(round(days), 1), "day")
    return plural(round(days / 30.44), "month") if days < 730 else plural(round(days / 365.25), "year")


def _interval(low: float | None, high: float | None) -> str:
    return f"{number(low)} … {number(high)}"
