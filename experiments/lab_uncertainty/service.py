"""What a run in service tells of its unit, and when to calibrate again, against true figures."""

from __future__ import annotations

from dataclasses import dataclass, fields
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_errors, of_interval, share
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, flicker, kept_rows, thermometer
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.monitor.record import TEXTS, RunRecord, record_run
from fogml.monitor.watch import watch
from fogml.runs.facts import Facts
from fogml.runs.run import Run


@dataclass(frozen=True)
class Service:
    """A run in service: its noise, its length [h], its sample interval [s], and whether temperature moves."""

    noise: Noise
    hours: float = 3.0
    sample_s: float = 1.0
    warms: bool = True
    turns: bool = False
    dropped: float = 0.0


@dataclass(frozen=True)
class Years:
    """Levels of a unit's runs, 30 days apart: deviations of white, flicker and walk between them, and trend.

    The trend [deg/h per day] is normal with the given deviation.
    """

    runs: int = 12
    white: float = 0.01
    flicker: float = 0.0
    walk: float = 0.0
    trend: float = 1e-4


CASES: dict[str, Service | Years] = {
    "run of 3 h, tactical": Service(TACTICAL),
    "run of 3 h, navigation grade": Service(NAVIGATION),
    "run of 40 min, navigation grade": Service(NAVIGATION, hours=0.7),
    "run of 3 h at one temperature": Service(NAVIGATION, warms=False),
    "run of 3 h with turns, 10 Hz, rows dropped": Service(TACTICAL, turns=True, sample_s=0.1, dropped=0.02),
    "12 runs, white": Years(),
    "6 runs, white": Years(runs=6),
    "12 runs, flicker": Years(white=0.003, flicker=0.01),
    "12 runs, random walk": Years(white=0.003, walk=0.005),
    "30 runs, flicker": Years(runs=30, white=0.003, flicker=0.01),
}


def _temperature(rng: np.random.Generator, count: int, step_s: float, low: float, high: float) -> Any:
    turns = np.cumsum(rng.uniform(1800.0, 5400.0, 64))
    levels = rng.uniform(low, high, 65)
    return np.interp(step_s * np.arange(count), np.concatenate(([0.0], turns)), levels)


@lru_cache(maxsize=1)
def model() -> DriftModel:
    """A model that has nothing to compensate, trained from 0 to 50 degC, good to 0.1 deg/h."""
    rng = np.random.default_rng(99)
    runs = []
    for _ in range(3):
        temperature = np.interp(np.arange(14400.0), [0.0, 7200.0, 14400.0], [0.0, 50.0, 0.0])
        gyro = rng.standard_normal(len(temperature))
        columns = {"time": np.arange(14400.0) + 1.0, "gyro": gyro, "T": temperature}
        runs.append(Run("training", columns, Facts(unit="U", axis="z", latitude=0.0, input_axis="up")))
    return make_model("polynomial", "T, dT").fit(runs)


def recorded(service: Service, rng: np.random.Generator) -> tuple[Run, dict[str, float]]:
    """A run and its true figures."""
    step = service.sample_s
    count = round(3600.0 * service.hours / step)
    chamber = (
        _temperature(rng, count, step, 5.0, 45.0)
        if service.warms
        else np.full(count, 0.5 * sum(model().card_.box["T"]))
    )
    coil = thermometer(rng, chamber, step, 300.0, 1e-9)
    fitted = model().describe()["coefficients"]
    own = [fitted[key]["value"] for key in ("1", *model().feature_names)]
    middle = 0.5 * sum(model().card_.box["T"])
    true = {"level": rng.normal(0.0, 0.1)}
    rate = np.gradient(coil, step / 60.0)
    gyro = np.full(count, true["level"])
    if service.warms:
        true |= {"temperature_slope": rng.normal(0.0, 3e-3), "rate_slope": rng.normal(0.0, 0.02)}
        gyro += true["temperature_slope"] * (coil - middle) + true["rate_slope"] * rate
    time = step * (np.arange(count) + 1.0)
    columns = {"time": time, "T": np.round(coil * 64.0) / 64.0}
    if service.turns:
        true["scale_factor"] = rng.normal(0.0, 20.0)
        within = time % 2400.0
        turn = np.where(within < 1800.0, 0.0, np.where(within < 2100.0, 10.0, -10.0))
        gyro += 3600.0 * turn * (1.0 + 1e-6 * true["scale_factor"])
        columns["rate"] = turn
    columns["gyro"] = service.noise.counted(gyro + service.noise.draw(rng, count, step), step)
    # What is left is less by what the model takes off.
    true["level"] -= own[0] + own[1] * middle
    if service.warms:
        true["temperature_slope"] -= own[1]
        true["rate_slope"] -= own[2]
    kept = kept_rows(rng, count, service.dropped)
    facts = Facts(unit="U", axis="z", latitude=0.0, input_axis="up")
    return Run("service", {name: values[kept] for name, values in columns.items()}, facts), true


def records(years: Years, rng: np.random.Generator) -> tuple[list[RunRecord], float]:
    """Records of a unit's runs and its true trend [deg/h per day]."""
    trend = years.trend * rng.standard_normal()
    age = 30.0 * np.arange(years.runs)
    level = trend * age + years.white * rng.standard_normal(years.runs)
    level += years.walk * np.cumsum(rng.standard_normal(years.runs)) + years.flicker * flicker(
        rng, years.runs
    )
    began = datetime(2024, 1, 1, tzinfo=UTC)
    made = []
    for place, (days, value) in enumerate(zip(age.tolist(), level.tolist(), strict=True)):
        told: dict[str, Any] = {f.name: "" if f.name in TEXTS else float("nan") for f in fields(RunRecord)}
        told |= {"key": str(place), "unit": "U", "started": (began + timedelta(days=days)).isoformat()}
        made.append(
            RunRecord(
                **told
                | {"level": value, "level_se": 0.1 * years.white, "averaging_s": 100.0, "half_width": 1.0}
            )
        )
    return made, trend


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    case = CASES[name]
    told: dict[str, list[Told | None]] = {}
    late = 0
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        if isinstance(case, Service):
            run, true = recorded(case, rng)
            found = record_run(model(), run)
            for figure, value in true.items():
                error, se = getattr(found, figure) - value, getattr(found, f"{figure}_se")
                told.setdefault(figure, []).append(of_errors(error, se) if np.isfinite(se) else None)
            continue
        made, trend = records(case, rng)
        unit = watch(made, bias_limit=0.5)[0]
        if unit.calibration is None or unit.chart.changes:
            continue
        due = unit.calibration
        told.setdefault("trend a day", []).append(of_interval(due.trend, trend, due.trend_ci90))
        days = 0.5 / abs(trend) - 30.0 * (case.runs - 1)
        late += not due.due_ci90[0] <= days <= due.due_ci90[1]
    rows = [coverage(name, quantity, every) for quantity, every in told.items()]
    if isinstance(case, Years):
        rows.append(share(name, "calibration not due in its 90 % interval", late, rows[0]["runs"], 0.1))
    return rows
