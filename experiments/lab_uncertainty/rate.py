"""Scale factors from a rate table against true ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_interval, share
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, kept_rows, lagged, thermometer
from fogml.arrays import FloatArray
from fogml.lab.rate_json import rate_json
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.validation.scale_factor import nonlinearity_ppm

UP = (0.0, 5.0, 10.0, 20.0, 50.0, 100.0)
BOTH = tuple(sign * rate for rate in UP[1:] for sign in (1.0, -1.0))


@dataclass(frozen=True)
class Ladder:
    """Rates of a table [deg/s], and what gyro, table and logger do.

    Dwell and settling of gyro and table [s], scale factor's cubic part (share at the greatest rate, deviation
    of a normal one) and asymmetry likewise [ppm], sensitivity to temperature [ppm/degC] and the soaks [degC].
    """

    noise: Noise
    rates: tuple[float, ...] = (0.0, *BOTH, 0.0)
    dwell_s: float = 60.0
    sample_s: float = 1.0
    settle_s: float = 0.3
    cubic_ppm: float = 0.0
    asymmetry_ppm: float = 0.0
    sensitivity_ppm: float = 0.0
    soaks: tuple[float, ...] = ()
    bias_slope: float = 0.0
    table_ppm: float = 0.0
    dropped: float = 0.0


CASES = {
    "tactical": Ladder(TACTICAL),
    "navigation grade": Ladder(NAVIGATION),
    "navigation grade, 5 min a rate": Ladder(NAVIGATION, dwell_s=300.0),
    "navigation grade, up and down": Ladder(
        NAVIGATION, rates=(*(-r for r in UP[:0:-1]), *UP, *UP[::-1], *(-r for r in UP[1:]))
    ),
    "navigation grade, each rate once, up": Ladder(NAVIGATION, rates=(*(-r for r in UP[:0:-1]), *UP)),
    "navigation grade, three rates": Ladder(NAVIGATION, rates=(0.0, 10.0, -10.0, 0.0)),
    "navigation grade, nonlinear": Ladder(NAVIGATION, cubic_ppm=20.0),
    "navigation grade, asymmetric": Ladder(NAVIGATION, asymmetry_ppm=20.0),
    "table's rates off by 5 ppm": Ladder(NAVIGATION, table_ppm=5.0),
    "100 Hz, counts of 1 arcsec, rows dropped": Ladder(
        Noise(0.005, 0.01, 0.01, 1.0), sample_s=0.01, dwell_s=20.0, dropped=0.02
    ),
    "five soaks, bias drifts with temperature": Ladder(
        TACTICAL,
        rates=(0.0, 10.0, -10.0, 0.0, 20.0, -20.0, 0.0),
        sensitivity_ppm=2.0,
        soaks=(-40.0, -15.0, 10.0, 35.0, 60.0),
        bias_slope=0.02,
    ),
    "three soaks": Ladder(
        TACTICAL,
        rates=(0.0, 10.0, -10.0, 0.0),
        sensitivity_ppm=2.0,
        soaks=(-40.0, 10.0, 60.0),
        bias_slope=0.02,
    ),
    "five soaks turned one way": Ladder(
        TACTICAL,
        rates=(0.0, 10.0, 0.0, 20.0, 0.0),
        sensitivity_ppm=2.0,
        soaks=(-40.0, -15.0, 10.0, 35.0, 60.0),
        bias_slope=0.02,
    ),
}


@dataclass(frozen=True)
class Truth:
    """Scale factor of the line through the rates, asymmetry, nonlinearity [ppm], sensitivity [ppm/degC]."""

    scale: float
    asymmetry: float
    nonlinearity: float | None
    sensitivity: float


def recorded(ladder: Ladder, rng: np.random.Generator) -> tuple[Run, Truth]:
    """A run and what is true of it."""
    rows, step = round(ladder.dwell_s / ladder.sample_s), ladder.sample_s
    soaks = ladder.soaks or (25.0,)
    rest = round(3600.0 / step) if ladder.soaks else 0
    commanded, warmth = [], []
    for place, soak in enumerate(soaks):
        before = soaks[max(place - 1, 0)]
        commanded += [np.zeros(rest), np.repeat(ladder.rates, rows)]
        ramp = np.clip(np.arange(rest) * step / 1800.0, 0.0, 1.0)
        warmth += [before + (soak - before) * ramp, np.full(rows * len(ladder.rates), soak)]
    rate, temperature = np.concatenate(commanded), np.concatenate(warmth)
    scale = 1.0 + 1e-6 * rng.normal(0.0, 100.0)
    cubic, asymmetry, sensitivity = (
        size * rng.standard_normal()
        for size in (ladder.cubic_ppm, ladder.asymmetry_ppm, ladder.sensitivity_ppm)
    )
    greatest = np.abs(rate).max()
    off = {value: ladder.table_ppm * rng.standard_normal() for value in np.unique(rate)}
    table = rate * (1.0 + 1e-6 * np.array([off[value] for value in rate]))
    coil = thermometer(rng, temperature, step, 300.0, 1e-6)

    def output(values: FloatArray) -> FloatArray:
        parts = cubic * (values / greatest) ** 2 + 0.5 * asymmetry * np.sign(values)
        return np.asarray(3600.0 * values * (scale + 1e-6 * parts))

    time = step * (np.arange(len(rate)) + 1.0)
    gyro = output(lagged(table, step, ladder.settle_s)) * (1.0 + 1e-6 * sensitivity * (coil - coil.mean()))
    gyro += rng.normal(0.0, 0.5) + ladder.bias_slope * coil + ladder.noise.draw(rng, len(rate), step)
    gyro = ladder.noise.counted(gyro, step)
    kept = kept_rows(rng, len(rate), ladder.dropped)
    columns = {"time": time, "rate": rate, "gyro": gyro}
    if ladder.soaks:
        columns["T"] = thermometer(rng, temperature, step, 120.0, 1.0 / 16.0)
    levels = np.array(ladder.rates)
    once = np.unique(levels)
    line = np.column_stack([np.ones(len(levels)), levels])
    truth = np.linalg.lstsq(line, output(levels) / 3600.0, rcond=None)[0][1]
    return Run("ladder", {name: part[kept] for name, part in columns.items()}, Facts()), Truth(
        float(truth), float(asymmetry), nonlinearity_ppm(once, output(once)), sensitivity
    )


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    ladder = CASES[name]
    quantity = "sensitivity [ppm/degC]" if ladder.soaks else "scale factor"
    told: list[Told | None] = []
    uneven: list[Told | None] = []
    bent, outside = 0, 0
    for repeat in range(repeats):
        run, truth = recorded(ladder, np.random.default_rng([seed, repeat]))
        values = rate_json([run], source="synthetic")
        line, sensed = values["scale_factor"], values["temperature_sensitivity"]
        if not ladder.soaks:
            told.append(of_interval(line["scale_factor"], truth.scale, line["ci90"]))
            if line["asymmetry_ci90_ppm"] is not None:
                uneven.append(of_interval(line["asymmetry_ppm"], truth.asymmetry, line["asymmetry_ci90_ppm"]))
            if truth.nonlinearity is not None and line["nonlinearity_ci90_ppm"] is not None:
                low, high = line["nonlinearity_ci90_ppm"]
                bent += 1
                outside += not low - 1e-3 <= truth.nonlinearity <= high
        elif sensed is not None:
            told.append(of_interval(sensed["ppm_per_degC"], truth.sensitivity, sensed["ci90"]))
    rows = [coverage(name, quantity, told)]
    if uneven:
        rows.append(coverage(name, "asymmetry [ppm]", uneven))
    return [*rows, share(name, "nonlinearity not in its 90 % interval", outside, bent, 0.1)] if bent else rows
