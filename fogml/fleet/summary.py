"""``fleet.json``: what a fleet's units tell together, schema ``fogml.fleet/1``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fogml.errors import InputError
from fogml.fleet.constants import LEAST_UNITS, FleetConstants, UnitConstants, fleet_constants
from fogml.fleet.diagnosis import RULES, line_diagnosis
from fogml.fleet.manifest import JOBS
from fogml.fleet.shares import discoveries
from fogml.fleet.tasks import DONE
from fogml.intervals import SIGMA_PER_MEDIAN
from fogml.numerals import in_order_of_serial, percent, short

FLEET_SCHEMA = "fogml.fleet/1"
_OUTLYING = 3.5
# Robust standard deviations (B. Iglewicz & D. Hoaglin, How to Detect and Handle Outliers, 1993).
_OF_OUTPUTS = (" stands still: ", " saturates: ", " can't be as stated: ")
_OUTSIDE = 0.1
_FLOORS = 3.0
_LEAST_OUTLIER_UNITS = 5
_TREND_LEVEL = 0.01


def fleet_json(outcomes: Sequence[Mapping[str, Any]], settings: Mapping[str, Any]) -> dict[str, Any]:
    """What the units tell together."""
    units = [_unit(outcome) for outcome in outcomes]
    judged = judged_once(units)
    constants = _constants(outcomes)
    values: dict[str, Any] = {
        "schema": FLEET_SCHEMA,
        "settings": dict(settings),
        "counts": dict(Counter(unit["status"] for unit in units)),
        "distribution": {key: _quantiles([u[key] for u in judged]) for key in ("before", "after", "floor")},
        "units": units,
        "outliers": _outliers(judged, constants),
        "again": _again(units),
    }
    told = [outcome for outcome in outcomes if outcome.get("found", {}).get("diagnosis")]
    if told:
        labels = [label_of(outcome) for outcome in told]
        values["diagnosis"] = line_diagnosis(labels, [one["found"]["diagnosis"] for one in told])
    if constants is not None:
        labels, found = constants
        values["constants"] = _constants_json(labels, found)
        values["shared"] = {
            "features": found.features,
            "prior": found.prior.as_dict(),
            "box": found.box,
            "own": found.own,
            "noise": found.noise,
        }
        if found.effects.columns.names:
            values["shared"]["covariates"] = found.effects.as_dict()
    return values


def _unit(outcome: Mapping[str, Any]) -> dict[str, Any]:
    found = outcome.get("found", {})
    worst = found.get("worst") or {}
    return {
        "unit": outcome["unit"],
        "axis": outcome["axis"],
        "job": outcome["job"],
        "folder": outcome["folder"],
        "status": outcome["status"],
        "reason": outcome.get("reason", ""),
        "model": found.get("model", ""),
        "run": worst.get("run", ""),
        "averaging_s": worst.get("averaging_s"),
        "before": worst.get("before"),
        "after": worst.get("after"),
        "floor": worst.get("floor"),
        "outside_training": worst.get("outside_training"),
        "met": found.get("met"),
        "verdict": found.get("verdict", ""),
        "reasons": list(found.get("reasons", ())),
        "effects": list(found.get("effects", ())),
        "notes": list(found.get("notes", ())),
    }


def judged_once(units: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Units with figures, each once: by a drift model, ``train`` before ``compare``; by twins where none is.

    What a twin leaves of a recording is another figure than what a drift model leaves.
    """
    by_job = {
        job: {unit_of(unit): unit for unit in units if unit["after"] is not None and unit["job"] == job}
        for job in JOBS
    }
    chosen = by_job["compare"] | by_job["train"] or by_job["diagnose"]
    return [unit for unit in units if chosen.get(unit_of(unit)) is unit]


def unit_of(unit: Mapping[str, Any]) -> tuple[str, str]:
    """Serial number and axis apart: ``A`` with axis ``x`` is another than ``A x`` without one."""
    return unit["unit"], unit["axis"]


def label_of(unit: Mapping[str, Any]) -> str:
    """Serial number and axis."""
    return f"{unit['unit']} {unit['axis']}".strip()


def _quantiles(values: Sequence[float]) -> dict[str, float] | None:
    if not values:
        return None
    shares = (0.0, 0.1, 0.5, 0.9, 1.0)
    names = ("least", "q10", "median", "q90", "largest")
    return {name: float(q) for name, q in zip(names, np.quantile(values, shares), strict=True)}


def _outliers(
    judged: Sequence[Mapping[str, Any]], constants: tuple[list[str], FleetConstants] | None
) -> list[dict[str, Any]]:
    """Units whose residual or whose constants are unlike the others'."""
    told = []
    if len(judged) >= _LEAST_OUTLIER_UNITS:
        after = np.log([max(unit["after"], 1e-12) for unit in judged])
        middle = np.median(after)
        spread = SIGMA_PER_MEDIAN * float(np.median(np.abs(after - middle)))
        for unit, value in zip(judged, after, strict=True):
            if spread > 0.0 and value - middle > _OUTLYING * spread:
                told.append(
                    {
                        "unit": label_of(unit),
                        "why": f"leaves {short(np.exp(value - middle), 2)} times the fleet's median rms",
                    }
                )
    if constants is not None:
        labels, found = constants
        own = np.abs(found.values - found.prior.mean) / np.sqrt(np.diag(found.prior.covariance))
        odd = discoveries(found.probabilities, RULES.false_share)
        for place, label in enumerate(labels):
            if odd[place]:
                name = found.names[int(np.argmax(own[place]))]
                what = "constant" if name == "1" else f"coefficient of {name}"
                told.append(
                    {
                        "unit": label,
                        "why": f"its {what} is {short(own[place].max(), 2)} standard deviations from the "
                        "fleet's",
                    }
                )
    return told


def _again(units: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    """Units that need attention, such as another run, and why."""
    told = []
    for unit in units:
        why = _why_again(unit)
        if why:
            told.append({"unit": label_of(unit), "job": unit["job"], "why": why})
    return told


def _why_again(unit: Mapping[str, Any]) -> str:
    if unit["status"] != DONE:
        return f"its job failed: {unit['reason']}"
    if unit["met"] is False:
        return "; ".join(unit["reasons"]) or "a stated limit is not met"
    if unit["after"] is None:
        return ""
    if doubts := [note for note in unit["notes"] if any(word in note for word in _OF_OUTPUTS)]:
        return doubts[0]
    if unit["after"] > unit["before"]:
        return "the model does harm on the test run: training and test runs do not tell the same"
    if (unit["outside_training"] or 0.0) > _OUTSIDE:
        return (
            f"{percent(unit['outside_training'], 0)} of the test run lie outside what was trained: "
            "train over more"
        )
    one_way = [note for note in unit["notes"] if "moving one way only" in note]
    if one_way:
        return "trained on temperature moving one way only: train on a run that goes up and down"
    if unit["floor"] and unit["after"] > _FLOORS * unit["floor"] and unit["model"] == "mean":
        return "no model beats the mean, and what is left is far above the noise"
    return "its verdict is 'do not use': its own page says why" if unit["verdict"] == "do_not_use" else ""


def told_of(unit: Mapping[str, Any]) -> str:
    """The verdict on a unit in words, behind the kind of its model."""
    return ": ".join(filter(None, (unit["model"], unit["verdict"].replace("_", " "))))


def _constants(outcomes: Sequence[Mapping[str, Any]]) -> tuple[list[str], FleetConstants] | None:
    """Labels in order of serial numbers, and the fleet's constants; None where too few units tell them."""
    held = [
        (label_of(outcome), UnitConstants.from_dict(outcome["found"]["constants"]))
        for outcome in outcomes
        if outcome.get("found", {}).get("constants")
    ]
    held.sort(key=lambda one: in_order_of_serial(one[0]))
    if len(held) < LEAST_UNITS:
        return None
    try:
        return [label for label, _ in held], fleet_constants([constants for _, constants in held])
    except (InputError, np.linalg.LinAlgError):
        return None


def _constants_json(labels: Sequence[str], found: FleetConstants) -> dict[str, Any]:
    from scipy.stats import kendalltau, theilslopes

    scale = np.append(1.0, found.prior.scale)
    trends = []
    for column, name in enumerate(found.names):
        values = found.values[:, column] / scale[column]
        # What is drawn to one mean shows too little of a slope, but tells best whether there is one.
        alone = found.alone[:, column] / scale[column]
        slope = float(theilslopes(alone)[0]) if len(values) > 1 else 0.0
        probability = float(kendalltau(np.arange(len(values)), values).pvalue) if len(values) > 1 else 1.0
        trends.append(
            {
                "name": name,
                "per_unit": slope,
                "probability": probability,
                "seen": bool(probability < _TREND_LEVEL),
            }
        )
    return {
        "features": found.features,
        "names": found.names,
        "units": list(labels),
        "values": (found.values / scale).tolist(),
        "se": (found.errors / scale).tolist(),
        "mean": (found.prior.mean / scale).tolist(),
        "std": (np.sqrt(np.diag(found.prior.covariance)) / scale).tolist(),
        "distance": found.distances.tolist(),
        "probability": found.probabilities.tolist(),
        "at": dict(zip(found.names[1:], found.prior.shift.tolist(), strict=True)),
        "trends": trends,
    }
