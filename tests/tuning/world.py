"""Small runs with a known drift, and a plan of a small sweep over them."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.tuning.plan import Plan, Space

SPACE: dict[str, Any] = {
    "features": {"static": ["T", "T^1..2"], "rate": ["", "dT[{builder}, {window} s]"]},
    "builder": ["block", "exp"],
    "window": {"low": 16, "high": 64},
    "models": {"polynomial": {"ridge": {"low": 1e-8, "high": 1e-2, "log": True}}},
}


def runs(count: int = 2, rows: int = 1200) -> list[Run]:
    """Cycles of temperature at several rates; drift linear in T and its rate, white noise of 0.02 deg/h."""
    made = []
    for number in range(count):
        rng = np.random.default_rng(number)
        time = 4.0 * np.arange(rows)
        temperature = 20.0 + 30.0 * np.sin(2 * np.pi * time * (1 + 0.3 * number) / time[-1])
        gyro = 1.0 + 0.05 * temperature + 3.0 * np.gradient(temperature, time) + 0.02 * rng.normal(size=rows)
        columns = {"time": time, "gyro": gyro, "T": temperature}
        made.append(Run(f"{number}.csv", columns, Facts(unit="FOG-1", axis="x")))
    return made


def plan(folder: object, **more: Any) -> Plan:
    """A plan of a few quick trials."""
    settings: dict[str, Any] = {"trials": 8, "heartbeat_s": 0.5, "prune": False, "references": {}, **more}
    space = Space.model_validate(settings.pop("space", SPACE))
    return Plan("test", runs, space, folder=str(folder), **settings)
