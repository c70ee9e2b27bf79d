"""The model of a next unit drawn to its fleet's constants: its intervals, and its fleet's spread."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_errors, of_runs
from experiments.lab_uncertainty.models import share_within
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, lagged, thermometer
from fogml.arrays import FloatArray
from fogml.fleet import FORM
from fogml.fleet.constants import FleetConstants, UnitConstants, fleet_constants
from fogml.fleet.shared import shared_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run

STEP_S = 10.0
MEAN = np.array([0.3, 0.2, 0.1, 0.05, 0.12, 0.04])
SPREAD = np.array([0.1, 0.06, 0.03, 0.015, 0.03, 0.012])
"""Of a unit's constant, its T to T^3 in units of 40 degC about 10 degC, and its dT and T*dT [deg/h]."""
WHITE = Noise(0.02)
FLEETS = 10
"""Fleets that next units are shared among, as fitting a fleet takes longest."""


@dataclass(frozen=True)
class Fleet:
    """Units of a fleet, hours of the next one's run, noise, and how far the bias moves between runs."""

    units: int = 24
    hours: float = 12.0
    noise: Noise = WHITE
    runs: int = 1
    moves: float = 0.0


CASES = {
    "24 units, 4 h": Fleet(hours=4.0),
    "6 units, 4 h": Fleet(units=6, hours=4.0),
    "24 units, tactical noise, 4 h": Fleet(hours=4.0, noise=TACTICAL),
    "24 units, tactical noise, whole cycle": Fleet(noise=TACTICAL),
    "24 units, flicker, 4 h": Fleet(hours=4.0, noise=Noise(0.02, 0.05)),
    "24 units, navigation grade, 4 h": Fleet(hours=4.0, noise=NAVIGATION),
    "24 units of two runs, bias moves, 4 h": Fleet(hours=4.0, runs=2, moves=0.05),
    "24 units of two runs, tactical noise, bias moves, 4 h": Fleet(
        hours=4.0, noise=TACTICAL, runs=2, moves=0.05
    ),
}


def recorded(size: FloatArray, case: Fleet, rng: np.random.Generator, hours: float, rate: float) -> Run:
    """A run from 25 to -30, to 50 and to 25 degC at a rate [degC/min] of a unit with such constants."""
    corners = np.array([25.0, 25.0, -30.0, -30.0, 50.0, 50.0, 25.0, 25.0])
    waits = np.array([0.5, 55.0 / rate / 60.0, 1.5, 80.0 / rate / 60.0, 1.5, 25.0 / rate / 60.0, 1.0])
    time = np.arange(0.0, min(hours, waits.sum()) * 3600.0, STEP_S)
    chamber = np.interp(time, 3600.0 * np.concatenate(([0.0], np.cumsum(waits))), corners)
    coil = lagged(lagged(chamber, STEP_S, 600.0), STEP_S, 400.0)
    change, warm = np.gradient(coil, STEP_S / 60.0), (coil - 10.0) / 40.0
    bias = np.column_stack([np.ones(len(time)), warm, warm**2, warm**3, change, warm * change]) @ size
    gyro = bias + case.moves * rng.standard_normal() + case.noise.draw(rng, len(time), STEP_S)
    columns = {"time": time + STEP_S, "gyro": gyro, "T": thermometer(rng, coil, STEP_S, 1e-3, 1.0 / 64.0)}
    return Run("run", columns, Facts(unit="U", axis="z", latitude=0.0, input_axis="up"))


def unit(rng: np.random.Generator) -> FloatArray:
    """A unit's constants."""
    return np.asarray(MEAN + SPREAD * rng.standard_normal(len(MEAN)))


@lru_cache(maxsize=FLEETS)
def fleet_of(case: Fleet, seed: int) -> tuple[FleetConstants, list[FloatArray]]:
    """The constants of one fleet, and its units' true ones."""
    rng = np.random.default_rng([seed, 77])
    units, sizes = [], []
    for _ in range(case.units):
        size = unit(rng)
        sizes.append(size)
        runs = [recorded(size, case, rng, 24.0, 1.0 + 0.2 * number) for number in range(case.runs)]
        units.append(UnitConstants.of(runs, FORM))
    return fleet_constants(units), sizes


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    case = CASES[name]
    told: dict[str, list[Told | None]] = {}
    shares: list[float] = []
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        size = unit(rng)
        fleet, _ = fleet_of(case, seed + repeat % FLEETS)
        model = shared_model(fleet).fit(recorded(size, case, rng, case.hours, 1.0))
        if any("left to its own runs" in note for note in model.card_.notes):
            continue
        fitted = model.describe()["coefficients"]
        for key, value in _as_terms(size).items():
            found = fitted[key]
            told.setdefault(key, []).append(of_errors(found["value"] - value, found["se"]))
        test = recorded(size, case, rng, 24.0, 0.8)
        shares.append(share_within(model, test))
    rows = [coverage(name, key, every) for key, every in told.items()]
    rows += _of_units([fleet_of(case, seed + number) for number in range(min(FLEETS, repeats))], name)
    return [*rows, of_runs(name, "averages on another run", shares)]


def _of_units(fleets: list[tuple[FleetConstants, list[FloatArray]]], name: str) -> list[dict[str, Any]]:
    """Rows of the fleets' tables of their own units' constants, in the tables' columns."""
    told: dict[str, list[Told | None]] = {}
    for fleet, sizes in fleets:
        into = np.linalg.inv(fleet.prior.to_raw())
        for size, values, errors in zip(sizes, fleet.values, fleet.errors, strict=True):
            true = into @ list(_as_terms(size).values())
            for key, value, truth, error in zip(fleet.names, values, true, errors, strict=True):
                told.setdefault(key, []).append(of_errors(value - truth, error))
    return [coverage(name, f"{key} of the fleet's units", every) for key, every in told.items()]


def _as_terms(size: FloatArray) -> dict[str, float]:
    """The constants as coefficients of temperature as it is [degC]."""
    warm = np.polynomial.Polynomial([-0.25, 1.0 / 40.0])
    level = np.polynomial.Polynomial(size[:4])(warm).coef
    change = np.polynomial.Polynomial(size[4:])(warm).coef
    return dict(zip(("1", "T", "T^2", "T^3", "dT", "T*dT"), (*level, *change), strict=True))
