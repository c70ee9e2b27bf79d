"""What ``fogml lab north`` tells, of recorded positions or a simulation: the values of ``north.json``."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.lab.north import Drift, DriftError, Scheme, drift_error, horizontal_rate
from fogml.lab.north_positions import north_from_positions
from fogml.lab.north_schemes import (
    CoarseFine,
    Way,
    error_of,
    quiet_azimuths,
    seek,
    standard_error,
    ways_of_equal_time,
    wrapped,
)
from fogml.runs.checks import refuse_dead
from fogml.runs.findings import of_any_use
from fogml.runs.run import Run

SCHEMA = "fogml.north/1"
CIRCLE_DEG = np.arange(0.0, 360.0, 1.0)
ROUND_OFF_DEG = 360.0 * float(np.finfo(np.float64).eps)
"""Errors below this are none: angles on a circle differ by no less."""
MAP_LATITUDES_DEG = np.arange(0.0, 81.0, 5.0)
MAP_DWELLS_S = np.array([15.0, 30.0, 60.0, 90.0, 120.0, 180.0, 240.0, 300.0])


def recorded_north_json(
    run: Run,
    *,
    sense: str = "cw",
    order_deg: tuple[float, ...],
    method: str = "auto",
    settle_s: float = 0.0,
    latitude_deg: float | None = None,
) -> dict[str, Any]:
    """North from a recorded run, schema ``fogml.north/1``; see :func:`north_from_positions`."""
    refuse_dead([run])
    fix = north_from_positions(
        run, sense=sense, order_deg=order_deg, method=method, settle_s=settle_s, latitude_deg=latitude_deg
    )
    error = fix.error
    off_from = fix.observed_deg if fix.method == "plain" else fix.azimuth_deg
    return {
        "schema": SCHEMA,
        "kind": "recorded",
        "source": run.name,
        "synthetic": run.facts.synthetic,
        "azimuth_deg": fix.azimuth_deg,
        "drift_deg_h_per_h": fix.drift_deg_h_h,
        "quiet_azimuth_deg": list(error.quiet_deg),
        "worst_azimuth_deg": list(error.worst_deg),
        "error_deg": None if off_from is None else float(wrapped(fix.plain_deg - off_from)),
        "se": fix.se_deg,
        "drift_se": fix.drift_se,
        "bend_deg_h_per_h2": fix.bend_deg_h_h2,
        "bend_se": fix.bend_se,
        "bend_probability": fix.bend_probability,
        "method": fix.method,
        "plain_azimuth_deg": fix.plain_deg,
        "drift_observing_azimuth_deg": fix.observed_deg,
        "bend_observing_azimuth_deg": fix.bent_deg,
        "greatest_error_deg": error.greatest if fix.method != "plain" else None,
        "horizontal_deg_h": fix.horizontal_deg_h,
        "offset_deg_h": fix.offset_deg_h,
        "sample_noise_deg_h": fix.noise_deg_h,
        "sense": sense,
        "order_deg": list(order_deg),
        "stays": [
            {"position": int(p), "time_s": t, "mean_deg_h": m}
            for p, t, m in zip(fix.positions.tolist(), fix.times_s.tolist(), fix.means_deg_h.tolist())
        ],
        "errors_by_azimuth": _circle(error) if fix.method != "plain" else None,
        "notes": list(fix.notes),
        "findings": of_any_use(run.name, run.findings),
    }


def simulated_north_json(
    scheme: Scheme,
    azimuth_deg: float,
    latitude_deg: float,
    drift: Drift,
    *,
    way: str = "plain",
    coarse_dwell_s: float = 6.0,
    random_walk_deg_sqrt_h: float = 0.0,
) -> dict[str, Any]:
    """What a drift does to a seek, in closed form and simulated, schema ``fogml.north/1``.

    Parameters
    ----------
    scheme
        The plain seek whose time every other way takes too.
    azimuth_deg, latitude_deg
        Where it is done.
    drift
        Of the bias from power-on.
    way
        ``plain``, ``drift-observing``, ``palindrome`` or ``coarse-fine``: which one the headline is about.
    coarse_dwell_s
        Time in each coarse position [s].
    random_walk_deg_sqrt_h
        Angle random walk [deg/sqrt(h)] for standard errors.

    Raises
    ------
    InputError
        If a setting is not accepted.
    """
    horizontal = horizontal_rate(latitude_deg)
    ways, left_out = ways_of_equal_time(scheme, coarse_dwell_s=coarse_dwell_s)
    if way not in ways:
        raise InputError(left_out[way])
    chosen = ways[way]
    table = {
        name: _told(each, azimuth_deg, latitude_deg, drift, random_walk_deg_sqrt_h)
        for name, each in ways.items()
    }
    told = table[way]
    shape = drift if drift_error(scheme, drift, latitude_deg).seen else Drift(1e-3)
    effective = drift_error(chosen if isinstance(chosen, Scheme) else chosen.fine, shape, latitude_deg)
    observer = ways.get("drift-observing")
    observed = None
    if isinstance(observer, Scheme):
        observed = float(observer.solver[3] @ drift.mean(*observer.spans_s))
    found = seek(chosen, np.array([azimuth_deg]), horizontal, drift.mean)[0]
    plain = drift_error(scheme, drift, latitude_deg)
    return {
        "schema": SCHEMA,
        "kind": "simulated",
        "source": "synthetic",
        "synthetic": True,
        "azimuth_deg": float(found),
        "true_azimuth_deg": azimuth_deg % 360.0,
        "drift_deg_h_per_h": observed,
        "quiet_azimuth_deg": list(effective.quiet_deg),
        "worst_azimuth_deg": list(effective.worst_deg),
        "error_deg": told["error_deg"],
        "simulated_error_deg": float(wrapped(found - azimuth_deg)),
        "se": told["se"],
        "greatest_error_deg": told["greatest_error_deg"],
        "rms_error_deg": told["rms_error_deg"],
        "way": way,
        "ways": table,
        "latitude_deg": latitude_deg,
        "horizontal_deg_h": horizontal,
        "drift": {
            "linear_deg_h_per_h": drift.linear_deg_h_h,
            "transients": [list(t) for t in drift.transients],
        },
        "random_walk_deg_sqrt_h": random_walk_deg_sqrt_h,
        "sense": scheme.sense,
        "order_deg": list(scheme.order_deg),
        "dwell_s": scheme.dwell_s,
        "transfer_s": scheme.transfer_s,
        "start_s": scheme.start_s,
        "duration_s": scheme.duration_s,
        "errors_by_azimuth": _circle(plain),
        "quiet_by_set_up": quiet_by_set_up(scheme, drift),
        "maps": _maps(scheme, shape),
        "notes": _notes(effective, drift, left_out),
    }


def _told(
    way: Way, azimuth_deg: float, latitude_deg: float, drift: Drift, random_walk: float
) -> dict[str, Any]:
    errors = error_of(way, CIRCLE_DEG, drift, latitude_deg)
    se = float(standard_error(way, azimuth_deg, random_walk, horizontal_rate(latitude_deg)))
    on_circle = standard_error(way, CIRCLE_DEG, random_walk, horizontal_rate(latitude_deg))
    scheme = way if isinstance(way, Scheme) else way.fine
    seeks = (way,) if isinstance(way, Scheme) else (way.coarse, way.fine)
    stays = sum(len(each.order_deg) for each in seeks)
    between = way.fine.transfer_s if isinstance(way, CoarseFine) else 0.0
    return {
        "error_deg": _seen(float(error_of(way, azimuth_deg, drift, latitude_deg))),
        "greatest_error_deg": _seen(way_greatest(way, errors, drift, latitude_deg)),
        "rms_error_deg": _seen(float(np.sqrt(np.mean(errors**2)))),
        "se": se if random_walk > 0.0 else None,
        "rms_se": float(np.sqrt(np.mean(on_circle**2))) if random_walk > 0.0 else None,
        "dwell_s": scheme.dwell_s,
        "stays": stays,
        "duration_s": sum(each.duration_s for each in seeks) + between,
    }


def _seen(error_deg: float) -> float:
    """An error, or none where it is the arithmetic's."""
    return error_deg if abs(error_deg) >= ROUND_OFF_DEG else 0.0


def way_greatest(way: Way, errors: FloatArray, drift: Drift, latitude_deg: float) -> float:
    """Greatest error over the circle [deg]: closed form where there is one, else of the azimuths tried."""
    if isinstance(way, Scheme):
        return drift_error(way, drift, latitude_deg).greatest
    return float(np.abs(errors).max())


def quiet_by_set_up(scheme: Scheme, drift: Drift) -> list[dict[str, Any]]:
    """Quiet azimuths of a linear drift and of this one for both senses and the usual orders."""
    rows = []
    for sense in ("cw", "ccw"):
        for order in ((0.0, 90.0, 180.0, 270.0), (0.0, 180.0, 270.0, 90.0), (0.0, 180.0, 90.0, 270.0)):
            each = replace(scheme, sense=sense, order_deg=order, observes_drift=False)
            own = quiet_azimuths(each, drift) if drift != Drift() else quiet_azimuths(each)
            rows.append(
                {
                    "sense": sense,
                    "order_deg": list(order),
                    "linear_deg": list(quiet_azimuths(each)),
                    "this_drift_deg": list(own),
                    "here": sense == scheme.sense and order == scheme.order_deg,
                }
            )
    return rows


def _circle(error: DriftError) -> dict[str, list[float]]:
    return {"azimuth_deg": CIRCLE_DEG.tolist(), "error_deg": error.at(CIRCLE_DEG).tolist()}


def _maps(scheme: Scheme, drift: Drift) -> dict[str, Any]:
    """Greatest error [deg] over latitudes (rows) and dwells (columns)."""
    errors = [drift_error(replace(scheme, dwell_s=float(d)), drift, 0.0) for d in MAP_DWELLS_S]
    sizes = np.array([error.size for error in errors])
    rows = np.array([horizontal_rate(float(latitude)) for latitude in MAP_LATITUDES_DEG])
    greatest = np.degrees(np.arcsin(np.minimum(sizes / rows[:, None], 1.0)))
    return {
        "latitude_deg": MAP_LATITUDES_DEG.tolist(),
        "dwell_s": MAP_DWELLS_S.tolist(),
        "greatest_error_deg": greatest.tolist(),
        "drift": {
            "linear_deg_h_per_h": drift.linear_deg_h_h,
            "transients": [list(t) for t in drift.transients],
        },
    }


def _notes(effective: DriftError, drift: Drift, left_out: dict[str, str]) -> list[str]:
    notes = [f"{name} is left out: {reason}" for name, reason in left_out.items()]
    if drift == Drift():
        notes.append("no drift is stated: quiet and worst azimuths are those of a small linear one")
    if not effective.seen:
        notes.append(
            "this drift does nothing at any azimuth in this order: there is no quiet azimuth to choose"
        )
    return notes
