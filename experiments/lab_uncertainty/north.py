"""North seeks against true azimuths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_errors
from experiments.lab_uncertainty.signals import Noise, kept_rows
from fogml.lab.north_positions import north_from_positions
from fogml.runs.facts import Facts
from fogml.runs.run import Run


@dataclass(frozen=True)
class Seek:
    """A seek: what the gyro's noise is, how it is recorded, and how the bias drifts meanwhile.

    Dwell and transfer [s], sample interval [s], linear drift [deg/h per h] (deviation of a normal one),
    start-up transient [deg/h] with its time constant [s], errors of the table's angles [deg].
    """

    noise: Noise
    order: tuple[float, ...] = (0.0, 90.0, 180.0, 270.0)
    dwell_s: float = 60.0
    transfer_s: float = 10.0
    sample_s: float = 1.0
    drift: float = 0.0
    transient: tuple[float, float] = (0.0, 600.0)
    index_deg: float = 0.0
    dropped: float = 0.0


NAVIGATION = Noise(0.001, 0.002, 0.002)
TACTICAL = Noise(0.02, 0.05, 0.05)
CASES = {
    "white, 1 Hz": Seek(Noise(0.003)),
    "navigation grade": Seek(NAVIGATION),
    "navigation grade, 10 min a position": Seek(NAVIGATION, dwell_s=600.0),
    "navigation grade, 0.1 Hz": Seek(NAVIGATION, dwell_s=240.0, sample_s=10.0),
    "navigation grade, 100 Hz, counts of 0.1 arcsec": Seek(
        Noise(0.001, 0.002, 0.002, 0.1), dwell_s=30.0, sample_s=0.01
    ),
    "tactical, rows dropped": Seek(TACTICAL, dwell_s=120.0, dropped=0.05),
    "navigation grade, drift": Seek(NAVIGATION, drift=0.05),
    "navigation grade, strong drift": Seek(NAVIGATION, drift=0.5),
    "palindrome, drift": Seek(
        NAVIGATION, order=(0.0, 90.0, 180.0, 270.0, 270.0, 180.0, 90.0, 0.0), dwell_s=30.0, drift=0.2
    ),
    "at start-up, 0.05 deg/h over 600 s": Seek(NAVIGATION, transient=(0.05, 600.0)),
    "at start-up, 0.5 deg/h over 300 s": Seek(NAVIGATION, transient=(0.5, 300.0)),
    "at start-up, 0.15 deg/h over 150 s": Seek(NAVIGATION, transient=(0.15, 150.0)),
    "at start-up, 1.5 deg/h over 150 s": Seek(NAVIGATION, transient=(1.5, 150.0)),
    "10 min a position, 0.5 deg/h over 1500 s": Seek(NAVIGATION, dwell_s=600.0, transient=(0.5, 1500.0)),
    "table's angles off by 0.01 deg": Seek(NAVIGATION, index_deg=0.01),
}


def recorded(seek: Seek, rng: np.random.Generator) -> tuple[Run, float, float]:
    """A run, its true azimuth [deg] and latitude [deg]."""
    azimuth, latitude = float(rng.uniform(0.0, 360.0)), float(rng.uniform(20.0, 60.0))
    horizontal = 15.041067 * np.cos(np.radians(latitude))
    angles = list(dict.fromkeys(seek.order))
    rows, way = round(seek.dwell_s / seek.sample_s), round(seek.transfer_s / seek.sample_s)
    position, angle = [], []
    for place, turned in enumerate(seek.order):
        if place and turned != seek.order[place - 1]:
            position += [0.0] * way
            angle += [0.0] * way
        position += [angles.index(turned) + 1.0] * rows
        angle += [turned + seek.index_deg * rng.standard_normal()] * rows
    at = np.array(position)
    time = seek.sample_s * (np.arange(len(at)) + 1.0)
    rate = horizontal * np.cos(np.radians(azimuth + np.array(angle))) + rng.normal(0.0, 0.5)
    rate += seek.drift * rng.standard_normal() * time / 3600.0
    rate += seek.transient[0] * np.exp(-time / seek.transient[1])
    rate = seek.noise.counted(rate + seek.noise.draw(rng, len(at), seek.sample_s), seek.sample_s)
    kept = kept_rows(rng, len(at), seek.dropped)
    columns = {"time": time[kept], "gyro": rate[kept], "position": at[kept]}
    return Run("seek", columns, Facts(latitude=latitude)), azimuth, latitude


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    seek, azimuths = CASES[name], []
    truth: list[Told | None] = []
    for repeat in range(repeats):
        run, azimuth, _ = recorded(seek, np.random.default_rng([seed, repeat]))
        fix = north_from_positions(run, order_deg=tuple(dict.fromkeys(seek.order)))
        off = (fix.azimuth_deg - azimuth + 180.0) % 360.0 - 180.0
        azimuths.append(fix.method)
        truth.append(of_errors(off, fix.se_deg))
    row = coverage(name, "azimuth [deg]", truth)
    return [row | {"averaged": azimuths.count("averaged") / repeats}]
