"""What a gyro's drift, or what a model leaves of it, costs a strapdown inertial navigator at rest.

Error states in north, east, down: attitude phi [rad], velocity dv [m/s], latitude and longitude [rad]::

    phi'  = -w x phi + dw - e                w = (W cos L, 0, -W sin L)
    dw    = (dv_E/R - W sin L dL,  -dv_N/R,  -dv_E tan L/R - W cos L dL)
    dv_N' =  g phi_E - 2 W sin L dv_E        dL' = dv_N/R
    dv_E' = -g phi_N + 2 W sin L dv_N        dl' = dv_E/(R cos L)

with e the gyros' drift, W the Earth rate, level at rest at latitude L, undamped, height held. The modes are
Schuler's 84.4 min, split by Foucault's rate W sin L, and 24 h.

Source: the standard error model (Britting, Inertial Navigation Systems Analysis, 1971; Titterton and Weston,
Strapdown Inertial Navigation Technology), derived here for a spherical Earth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.signal import fftconvolve

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.runs.facts import EARTH_RATE_DEG_H
from fogml.validation.results import Judgement, RunJudgement

EARTH_RATE_RAD_S = np.radians(EARTH_RATE_DEG_H) / 3600.0
EARTH_RADIUS_M = 6_371_000.0
GRAVITY_M_S2 = 9.80665
AXES = ("north", "east", "down")
"""Where the input axis of the drifting gyro points; up is down with the sign reversed."""
_POLE_DEG = 89.0
_DRIFT_RAD_S = np.radians(1.0) / 3600.0


@dataclass(frozen=True)
class NavigationError:
    """Errors over time, each array of shape (n,).

    ``time_s`` from the start, ``heading_deg`` what is told less what is (-phi_D), ``north_m`` and
    ``east_m`` of the position, ``velocity_m_s`` of the speed, ``tilt_deg`` off the level.
    """

    time_s: FloatArray
    heading_deg: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    velocity_m_s: FloatArray
    tilt_deg: FloatArray

    @property
    def position_m(self) -> FloatArray:
        """Distance from the true place [m], shape (n,)."""
        return np.asarray(np.hypot(self.north_m, self.east_m))


def error_matrices(latitude_deg: float, axis: str) -> tuple[FloatArray, FloatArray]:
    """F (8, 8) and b (8,) of x' = F x + b e, e the drift [deg/h] of the gyro on one axis.

    x = (phi_N, phi_E, phi_D, dv_N, dv_E, dL, dl, 0); the last place is spare for a constant drift.

    Raises
    ------
    InputError
        If the axis is unknown or the latitude is none or too close to a pole.
    """
    if not (np.isfinite(latitude_deg) and abs(latitude_deg) <= _POLE_DEG):
        raise InputError(
            f"latitude {latitude_deg:g} deg: a number from -{_POLE_DEG:g} to {_POLE_DEG:g} is needed"
        )
    if axis not in (*AXES, "up"):
        raise InputError(f"axis '{axis}': north, east, up or down was expected")
    latitude = np.radians(latitude_deg)
    down, north = EARTH_RATE_RAD_S * np.sin(latitude), EARTH_RATE_RAD_S * np.cos(latitude)
    f = np.zeros((8, 8))
    f[0, [1, 4, 5]] = -down, 1.0 / EARTH_RADIUS_M, -down
    f[1, [0, 2, 3]] = down, north, -1.0 / EARTH_RADIUS_M
    f[2, [1, 4, 5]] = -north, -np.tan(latitude) / EARTH_RADIUS_M, -north
    f[3, [1, 4]] = GRAVITY_M_S2, -2.0 * down
    f[4, [0, 3]] = -GRAVITY_M_S2, 2.0 * down
    f[5, 3] = 1.0 / EARTH_RADIUS_M
    f[6, 4] = 1.0 / (EARTH_RADIUS_M * np.cos(latitude))
    b = np.zeros(8)
    b[AXES.index("down" if axis == "up" else axis)] = _DRIFT_RAD_S if axis == "up" else -_DRIFT_RAD_S
    return f, b


def constant_drift(
    drift_deg_h: float, hours: FloatArray | Sequence[float], latitude_deg: float, axis: str = "east"
) -> NavigationError:
    """Errors after given times under a constant drift [deg/h], in closed form (a matrix exponential each)."""
    times = 3600.0 * np.atleast_1d(np.asarray(hours, dtype=np.float64))
    if not (np.isfinite(drift_deg_h) and np.all((times >= 0.0) & np.isfinite(times))):
        raise InputError("drift and hours: finite numbers, and times from 0 on, are needed")
    f, b = error_matrices(latitude_deg, axis)
    scale = _scale()
    # The eighth state is the drift itself, held at its value.
    f[:7, 7] = b[:7]
    balanced = f * scale[None, :] / scale[:, None]
    states = expm(balanced[None] * times[:, None, None])[:, :, 7] * scale * drift_deg_h
    return _told(times, states, latitude_deg)


def drift_series(
    drift_deg_h: FloatArray, step_s: float, latitude_deg: float, axis: str = "east"
) -> NavigationError:
    """Errors under a drift that is constant over each step: exact at the steps' ends.

    Parameters
    ----------
    drift_deg_h
        Means over the steps, shape (n,).
    step_s
        Length of a step [s].
    latitude_deg, axis
        As `constant_drift`.

    Returns
    -------
    NavigationError
        Of shape (n + 1,), from rest at time 0.
    """
    drift = np.asarray(drift_deg_h, dtype=np.float64)
    if drift.ndim != 1 or len(drift) == 0 or not np.all(np.isfinite(drift)):
        raise InputError("the drift series is empty or not finite; one number for each step is needed")
    if not (np.isfinite(step_s) and step_s > 0.0):
        raise InputError(f"step {step_s:g} s: a time above 0 is needed")
    f, b = error_matrices(latitude_deg, axis)
    f[:7, 7] = b[:7]
    scale = _scale()
    step = expm(f * scale[None, :] / scale[:, None] * step_s)
    kernel = _powers_on(step[:7, :7], step[:7, 7], len(drift))
    states = np.zeros((len(drift) + 1, 8))
    states[1:, :7] = fftconvolve(kernel, drift[:, None], axes=0)[: len(drift)]
    times = np.asarray(step_s * np.arange(len(drift) + 1), dtype=np.float64)
    return _told(times, states * scale, latitude_deg)


def _powers_on(matrix: FloatArray, vector: FloatArray, count: int) -> FloatArray:
    """``matrix**k @ vector`` for k = 0 ... count - 1, shape (count, m), by doubling."""
    powers = vector[None, :]
    ahead = matrix
    while len(powers) < count:
        powers = np.concatenate([powers, powers @ ahead.T])
        ahead = ahead @ ahead
    return powers[:count]


def _scale() -> FloatArray:
    """Sizes of the states next to each other, so that the exponential is well balanced."""
    schuler = float(np.sqrt(GRAVITY_M_S2 * EARTH_RADIUS_M))
    return np.array([1.0, 1.0, 1.0, schuler, schuler, 1.0, 1.0, 1.0])


def _told(times: FloatArray, states: FloatArray, latitude_deg: float) -> NavigationError:
    cosine = np.cos(np.radians(latitude_deg))
    return NavigationError(
        time_s=times,
        heading_deg=-np.degrees(states[:, 2]),
        north_m=EARTH_RADIUS_M * states[:, 5],
        east_m=EARTH_RADIUS_M * cosine * states[:, 6],
        velocity_m_s=np.hypot(states[:, 3], states[:, 4]),
        tilt_deg=np.degrees(np.hypot(states[:, 0], states[:, 1])),
    )


def gyrocompass_error_deg(drift_deg_h: float, latitude_deg: float) -> float:
    """Heading error of an alignment that seeks east with a gyro that drifts, e_E / (W cos L) [deg]."""
    error_matrices(latitude_deg, "east")
    return float(np.degrees(drift_deg_h / (EARTH_RATE_DEG_H * np.cos(np.radians(latitude_deg)))))


HOURS = (1.0, 2.0, 4.0, 8.0, 12.0, 24.0)
LONGEST_H = 24.0
_POINTS = 289


def navigation_costs(judgement: Judgement, latitude_deg: float) -> dict[str, Any]:
    """Heading and position errors of a strapdown system at rest for each test run, JSON-ready.

    The recorded drift, averaged as the judgement is, goes through the error dynamics as far as the run
    goes; beside it stands a constant drift of the run's rms over 24 h. One gyro drifts at a time.

    Returns
    -------
    dict
        ``latitude_deg``, ``axes`` and per test run ``time_h`` with errors before and after per axis, and
        ``constant`` with the errors at 1 to 24 h. Positions in km, headings in deg.

    Raises
    ------
    InputError
        If the latitude is not accepted.
    """
    return {
        "latitude_deg": latitude_deg,
        "axes": list(AXES),
        "hours": list(HOURS),
        "test": [_costs(run, latitude_deg) for run in judgement.test],
    }


def _costs(run: RunJudgement, latitude_deg: float) -> dict[str, Any]:
    series = run.series
    count = max(
        1, round(min(float(np.ptp(series.time)) + run.averaging_s, 3600.0 * LONGEST_H) / run.averaging_s)
    )
    grid = series.time[0] + run.averaging_s * np.arange(count)
    shown = np.unique(np.linspace(0, count, min(count + 1, _POINTS)).round().astype(int))
    recorded: dict[str, Any] = {"time_h": (run.averaging_s * shown / 3600.0).tolist()}
    constant: dict[str, Any] = {}
    for when, values, rms in (
        ("before", series.before, run.before.rms),
        ("after", series.after, run.after.rms),
    ):
        # A gap is bridged by a straight line: what happened in it is not known.
        drift = np.interp(grid, series.time, values)
        recorded[when] = {axis: _recorded(drift, run.averaging_s, latitude_deg, axis, shown) for axis in AXES}
        constant[when] = {axis: _constant(rms, latitude_deg, axis) for axis in AXES}
        constant[when]["drift_deg_h"] = rms
        constant[when]["gyrocompass_heading_deg"] = gyrocompass_error_deg(rms, latitude_deg)
    return {
        "run": run.run,
        "averaging_s": run.averaging_s,
        "floor": run.floor,
        **recorded,
        "constant": constant,
    }


def _recorded(
    drift: FloatArray, step_s: float, latitude_deg: float, axis: str, shown: FloatArray
) -> dict[str, list[float]]:
    error = drift_series(drift, step_s, latitude_deg, axis)
    return {
        "position_km": (error.position_m[shown] / 1e3).tolist(),
        "heading_deg": error.heading_deg[shown].tolist(),
    }


def _constant(rms: float, latitude_deg: float, axis: str) -> dict[str, list[float]]:
    """Largest errors up to each of the hours: an oscillation may pass through zero at any one of them."""
    hours = np.linspace(0.0, LONGEST_H, 577)
    error = constant_drift(rms, hours, latitude_deg, axis)
    position = np.maximum.accumulate(error.position_m) / 1e3
    heading = np.maximum.accumulate(np.abs(error.heading_deg))
    places = np.searchsorted(hours, np.asarray(HOURS) - 1e-9)
    return {"position_km": position[places].tolist(), "heading_deg": heading[places].tolist()}
