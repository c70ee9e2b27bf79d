"""Pages of many units with long serial numbers."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fogml.fleet.summary import fleet_json
from fogml.json_files import finite_json
from fogml.lab.batch import batch_json
from fogml.monitor.monitor_json import monitor_json
from fogml.monitor.watch import watch
from fogml.report.acceptance_page import acceptance_page, batch_page
from fogml.report.fleet_page import fleet_page
from fogml.report.monitor_page import monitor_page, unit_page
from tests.lab.test_batch import SERIAL, report
from tests.monitor.test_watch import service

UNITS = 200


def diagnosed(place: int) -> dict[str, Any]:
    """A unit's diagnosis, with a cause that the line shares."""
    rng = np.random.default_rng(place)
    cause = {
        "effect": "thermal_hysteresis",
        "members": ["thermal_hysteresis"],
        "probability": 0.9,
        "prior_probability": 0.03,
        "share": 0.7,
        "place": "coil",
        "amplitude": 0.02 * (5.0 if place == 8 else 1.0) + 0.001 * rng.normal(),
        "se": 0.001,
        "unit": "deg/h",
        "times_usual": 0.5,
    }
    told = {"causes": [cause], "unknown": 0.05, "undetectable": [], "gap_square": 4e-4, "floor_square": 1e-4}
    return {**told, "covariates": {}}


def fleet_values() -> dict[str, Any]:
    """A fleet of trained and accepted units, one that failed and one that stands out."""
    rng = np.random.default_rng(0)
    outcomes = []
    for place in range(UNITS):
        after = 0.02 * float(np.exp(0.1 * rng.normal())) * (8.0 if place == 3 else 1.0)
        worst = {"run": "b.csv", "averaging_s": 100.0, "before": 1.0, "after": after, "floor": 0.015}
        found: dict[str, Any] = {"model": "auto", "met": place != 5, "worst": worst, "notes": []}
        if place % 10 == 9:
            found = {"model": "", "met": False, "verdict": "rejected", "worst": None, "notes": []}
        outcome = {
            "unit": SERIAL.format(place),
            "axis": "xyz"[place % 3],
            "job": "acceptance" if place % 10 == 9 else "train",
            "folder": SERIAL.format(place),
            "status": "failed" if place == 4 else "done",
            "found": found if place != 4 else {},
        }
        if place == 4:
            outcome["reason"] = f"{SERIAL.format(4)}-cycle-1.csv, line 77: 3 fields where the header has 4"
        if place % 10 == 8:
            outcome |= {"job": "diagnose", "found": {**found, "diagnosis": diagnosed(place)}}
        outcomes.append(outcome)
    return {**finite_json(fleet_json(outcomes, {})), "constants": constants_of_units(rng)}


def constants_of_units(rng: np.random.Generator) -> dict[str, Any]:
    """Constants of all units in a form of six terms, of sizes that differ as powers of T do."""
    names = ["1", "T", "T^2", "T^3", "dT", "T*dT"]
    sizes = np.array([1.0, -1e-2, 1e-4, -1e-6, 0.2, 5e-3])
    values = sizes * rng.normal(1.0, 0.3, (UNITS, len(names)))
    trend = {"per_unit": -1e-6, "probability": 0.5, "seen": False}
    return {
        "features": "T^1..3, dT, T*dT",
        "names": names,
        "units": [SERIAL.format(place) for place in range(UNITS)],
        "values": values.tolist(),
        "se": np.abs(0.1 * values).tolist(),
        "mean": sizes.tolist(),
        "std": np.abs(0.3 * sizes).tolist(),
        "trends": [{"name": name, **trend} for name in names],
    }


@cache
def batch_biases() -> list[float]:
    """Bias of each unit of the batch [deg/h]."""
    found: list[float] = np.random.default_rng(0).normal(0.0, 0.03, UNITS).tolist()
    return found


def pages_of_many() -> dict[str, str]:
    """Name to HTML of each page."""
    batch = batch_json([(Path(f"{n}.json"), report(n, bias)) for n, bias in enumerate(batch_biases())])
    records = [
        one
        for place in range(UNITS)
        for one in service(
            20 if place == 3 else 12,
            step_at=12 if place == 3 else None,
            seed=place,
            unit=SERIAL.format(place),
        )
    ]
    monitor = monitor_json(watch(records), runs_between_false_alarms=1000.0, added=0, repeated=0)
    changed = next(unit for unit in monitor["units"] if unit["state"] == "alarm")
    return {
        "acceptance": acceptance_page(report(1, 0.01, runs=6)),
        "batch": batch_page(batch),
        "fleet": fleet_page(fleet_values(), "lot-17-of-the-second-line.csv", "batch.html"),
        "monitor": monitor_page(monitor),
        "monitored unit": unit_page(changed, 1000.0),
    }
