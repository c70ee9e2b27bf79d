"""Coefficients of drift models, of the joint one among them, against true ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_errors
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, kept_rows, thermometer
from fogml.arrays import FloatArray
from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run

STEPS = (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0)


@dataclass(frozen=True)
class Cycle:
    """A run over temperature, what the drift is made of, and how it is recorded.

    ``model`` and ``features`` are fitted; the truth has the same columns. Soaks and ramps are of `soak_s` and
    `ramp_s`; turns of `turn_deg_s` for a minute each way in every soak, none for 0. The thermometer that is
    recorded lags by `lag_s` behind the one that makes the drift.
    """

    noise: Noise
    model: str
    features: str | None = None
    sample_s: float = 4.0
    soak_s: float = 1800.0
    ramp_s: float = 1200.0
    turn_deg_s: float = 0.0
    lag_s: float = 0.0
    resolution: float = 1.0 / 16.0
    dropped: float = 0.0


CASES = {
    "joint, tactical": Cycle(TACTICAL, "joint", turn_deg_s=10.0),
    "joint, navigation grade": Cycle(NAVIGATION, "joint", turn_deg_s=10.0),
    "joint, navigation grade, 10 s samples": Cycle(NAVIGATION, "joint", turn_deg_s=10.0, sample_s=10.0),
    "joint, rows dropped, counts of 1 arcsec": Cycle(
        Noise(0.005, 0.01, 0.01, 1.0), "joint", turn_deg_s=10.0, dropped=0.02
    ),
    "joint, navigation grade, 30 % of rows lost": Cycle(NAVIGATION, "joint", turn_deg_s=10.0, dropped=0.3),
    "joint, short": Cycle(TACTICAL, "joint", turn_deg_s=10.0, soak_s=600.0, ramp_s=300.0),
    "joint, thermometer lags 2 min": Cycle(TACTICAL, "joint", turn_deg_s=10.0, lag_s=120.0),
    "polynomial, tactical": Cycle(TACTICAL, "polynomial", "T^1..2, dT"),
    "polynomial, navigation grade": Cycle(NAVIGATION, "polynomial", "T^1..2, dT"),
    "polynomial, thermometer lags 5 min": Cycle(TACTICAL, "polynomial", "T^1..2, dT", lag_s=300.0),
    "polynomial, whole degrees": Cycle(NAVIGATION, "polynomial", "T^1..2, dT", resolution=1.0),
    "four points": Cycle(TACTICAL, "multipoint-2-1"),
    "four points, 30 % of rows lost": Cycle(TACTICAL, "multipoint-2-1", dropped=0.3),
    "four points, navigation grade": Cycle(NAVIGATION, "multipoint-2-1"),
}


def _rate(temperature: FloatArray, step_s: float) -> FloatArray:
    """The model's own rate of a window of 64 s, of whatever sensor reads [degC/min]."""
    rows = max(round(64.0 / step_s), 1)
    sums = np.concatenate((np.zeros(2 * rows), np.cumsum(temperature - temperature[0])))
    newer = sums[2 * rows :] - sums[rows:-rows]
    older = sums[rows:-rows] - sums[: -2 * rows]
    return np.asarray((newer - older) / rows / (rows * step_s / 60.0))


def temperatures(cycle: Cycle) -> tuple[FloatArray, FloatArray]:
    """Chamber's temperature [degC] and the table's rate [deg/s], each of shape (n,)."""
    step = cycle.sample_s
    soak, ramp, turn = (round(part / step) for part in (cycle.soak_s, cycle.ramp_s, 60.0))
    warmth, rate, last = [], [], 20.0
    for level in (*STEPS, *STEPS[-2::-1]):
        warmth += [np.linspace(last, level, ramp, endpoint=False), np.full(soak, level)]
        still = np.zeros(soak)
        middle = 2 * soak // 3
        still[middle : middle + turn] = cycle.turn_deg_s
        still[middle + turn : middle + 2 * turn] = -cycle.turn_deg_s
        rate += [np.zeros(ramp), still]
        last = level
    return np.concatenate(warmth), np.concatenate(rate)


def recorded(cycle: Cycle, rng: np.random.Generator) -> tuple[Run, dict[str, float]]:
    """A run and its true coefficients by the names of the model's columns."""
    step = cycle.sample_s
    chamber, rate = temperatures(cycle)
    quiet = {"step_s": step, "resolution": 1e-9}
    four = cycle.model.startswith("multi")
    names = ["T1", "T2", "T3", "T4"] if four else ["T_in", "T_out"]
    lags = rng.uniform(100.0, 900.0, len(names)) if four else np.array([600.0, 200.0])
    true = [thermometer(rng, chamber, lag_s=float(lag), **quiet) for lag in lags]
    read = [thermometer(rng, one, step, max(cycle.lag_s, 1e-3), cycle.resolution) for one in true]
    columns: dict[str, FloatArray] = {}
    if four:
        for place, one in enumerate(true, start=1):
            columns |= {f"T{place}": one, f"T{place}^2": one**2 / 100.0, f"dT{place}": _rate(one, step)}
    elif cycle.model == "joint":
        columns = {"T": true[0], "T_in-T_out": true[0] - true[1], "dT": _rate(true[0], step)}
    else:
        columns = {"T": true[0], "T^2": true[0] ** 2 / 100.0, "dT": _rate(true[0], step)}
    size = {name: float(rng.normal(0.0, 0.1 if name.startswith("dT") else 0.01)) for name in columns}
    bias = sum(size[name] * values for name, values in columns.items()) + rng.normal(0.0, 0.5)
    truth = {name: value / (100.0 if name.endswith("^2") else 1.0) for name, value in size.items()}
    time = step * (np.arange(len(chamber)) + 1.0)
    noise = cycle.noise.draw(rng, len(time), step)
    if cycle.model == "joint":
        # The rate is (a0 + a1 T + a2 T^2) D + bias: the output is what the rate makes of it.
        a = 1.0 + 1e-4 * rng.standard_normal(), 1e-6 * rng.standard_normal(), 1e-8 * rng.standard_normal()
        gain = a[0] + a[1] * true[0] + a[2] * true[0] ** 2
        gyro = (3600.0 * rate - bias) / gain + noise
        truth |= {"D": a[0], "T*D": a[1], "T^2*D": a[2]}
    else:
        gyro = bias + noise
    gyro = cycle.noise.counted(gyro, step)
    kept = kept_rows(rng, len(time), cycle.dropped)
    given = {"time": time, "gyro": gyro, **dict(zip(names, read, strict=True))}
    if cycle.turn_deg_s:
        given["rate"] = rate
    return Run("cycle", {name: values[kept] for name, values in given.items()}, Facts()), truth


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    cycle = CASES[name]
    told: dict[str, list[Told | None]] = {}
    given = () if cycle.features is None else (cycle.features,)
    for repeat in range(repeats):
        run, truth = recorded(cycle, np.random.default_rng([seed, repeat]))
        found = make_model(cycle.model, *given).fit(run).describe()["coefficients"]
        for column, value in truth.items():
            key = next((k for k in found if k == column or k.split("[")[0] == column), None)
            if key is None:
                raise KeyError(f"{column} is none of {list(found)}")
            told.setdefault(column, []).append(of_errors(found[key]["value"] - value, found[key]["se"]))
    return [coverage(name, quantity, every) for quantity, every in told.items()]
