"""Misalignment in four states (`lab misalignment`): recordings of a rate table against true angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_interval, share
from experiments.lab_uncertainty.signals import NAVIGATION, TACTICAL, Noise, lagged
from fogml.arrays import FloatArray
from fogml.lab.misalignment import decouple
from fogml.lab.misalignment_segments import Rows, from_samples

STEP_S, REST_S, TURN_S, ACCELERATION = 1.0, 60, 72, 10.0
ANGLES_DEG = (0.0, 180.0, 270.0, 90.0)
RATES = (10.0, 50.0, 100.0)
EARTH_DEG_S, LATITUDE = 15.041067 / 3600.0, np.radians(40.0)


@dataclass(frozen=True)
class Test:
    """A test of four states: its noise, tilts [deg] and what is off.

    It warms by `warms` [degC] over the test, evenly or, `slows`, as an exponential: the scale factor moves by
    `ppm` and the bias by `bias` [deg/h] for each degC; settings of the tilts err by `tilt_sd` [deg], the
    output lags by `lag_s`.
    """

    noise: Noise
    warms: float = 5.0
    slows: bool = False
    ppm: float = 0.0
    bias: float = 0.0
    tilt_sd: float = 0.0
    lag_s: float = 0.0


CASES = {
    "tactical": Test(TACTICAL),
    "navigation grade": Test(NAVIGATION),
    "bias warms by 0.1 deg/h": Test(TACTICAL, bias=0.02),
    "scale factor warms by 50 ppm": Test(TACTICAL, ppm=10.0),
    "scale factor warms by 50 ppm, ever more slowly": Test(TACTICAL, ppm=10.0, slows=True),
    "scale factor warms by 50 ppm, tilts off by 10 arcsec": Test(TACTICAL, ppm=10.0, tilt_sd=0.003),
    "tilts off by 10 arcsec": Test(TACTICAL, tilt_sd=0.003),
    "lag of 1 s": Test(TACTICAL, lag_s=1.0),
}


def recorded(test: Test, rng: np.random.Generator) -> tuple[Rows, FloatArray, dict[str, float]]:
    """Samples of the whole test, and the truth."""
    delta = rng.uniform(-0.5, 0.5, 2)
    x, y = np.sin(np.radians(delta))
    z = np.sqrt(1.0 - x * x - y * y)
    error, k = rng.uniform(-0.3, 0.3), 3600.0 * (1.0 + 1e-4 * rng.standard_normal())
    parts = []
    for rate in RATES:
        rising = np.arange(0.0, rate, ACCELERATION * STEP_S)[1:]
        for sense in (1.0, -1.0):
            turn = np.concatenate((rising, np.full(TURN_S, rate), rising[::-1]))
            parts += [np.zeros(REST_S), sense * turn]
    one = np.concatenate((*parts, np.zeros(REST_S)))
    tilts = (0.0, 30.0, 60.0, 90.0)
    settings = [(state, tilt) for state in range(4) for tilt in tilts]
    along = []
    for state, tilt in settings:
        turned = np.radians(ANGLES_DEG[state])
        leaning = np.radians(tilt + error + test.tilt_sd * rng.standard_normal())
        along.append((x * np.cos(turned) + y * np.sin(turned)) * np.sin(leaning) + z * np.cos(leaning))
    axis = np.repeat(along, len(one))
    rate = np.tile(one, len(settings))
    time = STEP_S * np.arange(len(rate))
    course = time / time[-1]
    if test.slows:
        course = (1.0 - np.exp(-course / 0.3)) / (1.0 - np.exp(-1.0 / 0.3))
    warm = test.warms * (course - course.mean())
    earth = axis * np.sin(LATITUDE) + np.sqrt(1.0 - axis**2) * np.cos(LATITUDE) * np.cos(
        np.radians(np.cumsum(rate) * STEP_S)
    )
    output = k * (1.0 + 1e-6 * test.ppm * warm) * (axis * rate + EARTH_DEG_S * earth)
    output += test.bias * warm + 5.0 + test.noise.draw(rng, len(rate), STEP_S)
    if test.lag_s:
        output = lagged(output, STEP_S, test.lag_s)
    state, tilt = np.repeat(np.array(settings), len(one), axis=0).T
    rows = Rows("test", "deg/h", state + 1.0, tilt, rate, output, ANGLES_DEG)
    return rows, time, {"K": k, "delta_x_deg": float(delta[0]), "delta_y_deg": float(delta[1])}


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    told: dict[str, list[Told | None]] = {}
    tilted = 0
    for repeat in range(repeats):
        rows, time, true = recorded(CASES[name], np.random.default_rng([seed, repeat]))
        found = decouple(from_samples(rows, time))
        tilted += found.cross_tilt and not any("unevenly" in note for note in found.notes)
        for key, value in true.items():
            told.setdefault(key, []).append(of_interval(getattr(found, key), value, found.intervals[key]))
    found_rows = [coverage(name, key, every) for key, every in told.items()]
    return [
        *found_rows,
        share(name, "a fixture tilted across told outright of one that is not", tilted, repeats, 0.01),
    ]
