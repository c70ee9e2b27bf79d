"""What the drift that a judged model leaves would cost a navigator at rest, before and after compensation."""

from __future__ import annotations

from typing import Any

import numpy as np

from fogml.lab.navigation import AXES, constant_drift, drift_series, gyrocompass_error_deg
from fogml.runs.run import FloatArray
from fogml.validation.results import Judgement, RunJudgement

HOURS = (1.0, 2.0, 4.0, 8.0, 12.0, 24.0)
LONGEST_H = 24.0
_POINTS = 289


def navigation_costs(judgement: Judgement, latitude_deg: float) -> dict[str, Any]:
    """Heading and position errors of a strapdown system at rest for each test run, JSON-ready.

    The recorded drift, averaged as the judgement is, goes through the error dynamics as far as the run
    goes; beside it stands a constant drift of the run's rms over 24 h. One gyro drifts at a time.

    Parameters
    ----------
    judgement
        A judged model.
    latitude_deg
        Where the system stands.

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
