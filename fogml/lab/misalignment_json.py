"""What ``fogml lab misalignment`` tells, the classical test and one state alone beside it, as JSON values."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fogml.errors import InputError, counted
from fogml.lab.misalignment import Misalignment, TableMeasurements, decouple, fit_state
from fogml.lab.misalignment_errors import LEVEL
from fogml.lab.misalignment_states import STATES
from fogml.numerals import percent, short
from fogml.runs.columns import REPLAYED, column_spec

_SAME_TILT_DEG = 0.05


@dataclass(frozen=True)
class Method:
    """What one method says; None where it can't.

    ``K`` in output per deg/s, angles in deg.
    """

    name: str
    K: float | None
    delta_x_deg: float | None
    delta_y_deg: float | None
    why: str


def compare_methods(measured: TableMeasurements, cross_tilt: bool | None = None) -> tuple[Method, ...]:
    """The classical test, single state and four states on the same measurements.

    The classical test takes state 1 upright for K (cos d taken as 1) and the first state of each axis lying
    at 90 deg for the misalignment (sin d taken as d), where the states are quarter turns; it sees the
    fixture's zero error as misalignment. One state alone gives R = K sqrt(1 - a_y^2) for K and, with the
    fixture's zero error in it, one angle.
    """
    four = decouple(measured, cross_tilt)
    alone = fit_state(measured, 1, four.cross_tilt)
    cosine, sine = alone.coefficients[:2]
    angle = float(np.degrees(np.arctan2(sine, cosine)))
    along_x, along_y = _quarter_turn(measured, 1)
    return (
        _classical(measured),
        Method(
            "single state",
            float(np.hypot(cosine, sine)),
            along_x * angle if along_x else None,
            along_y * angle if along_y else None,
            "state 1 over its tilts; what lies across its tilt plane stays unseen",
        ),
        Method(
            "four states",
            four.K,
            four.delta_x_deg,
            four.delta_y_deg,
            "opposite states tell the fixture's zero error from the gyro's",
        ),
    )


def _classical(measured: TableMeasurements) -> Method:
    why = "upright for K, lying for the misalignment, small angles"
    k = _slope_at(measured, 1, 0.0)
    if k is None:
        return Method("classical test", None, None, None, f"{why}; no tilt 0 in state 1")
    found: list[float | None] = [None, None]
    for state in reversed(STATES):
        slope = _slope_at(measured, state, 90.0)
        for axis, sign in enumerate(_quarter_turn(measured, state)):
            if sign and slope is not None:
                found[axis] = float(np.degrees(sign * slope / k))
    x, y = found
    return Method("classical test", k, x, y, why if x is not None else f"{why}; no tilt 90 deg in state 1")


def _quarter_turn(measured: TableMeasurements, state: int) -> tuple[int, int]:
    """Signs of a_x and a_y along the fixture's x axis in a state; both 0 where it is no quarter turn."""
    turn = np.radians(measured.state_angles_deg[state - 1])
    along = np.array([np.cos(turn), np.sin(turn)])
    whole = np.round(along)
    if np.abs(along - whole).max() > np.radians(_SAME_TILT_DEG):
        return 0, 0
    return int(whole[0]), int(whole[1])


def _slope_at(measured: TableMeasurements, state: int, tilt_deg: float) -> float | None:
    """Slope over the table rate at one tilt, None where it was not measured."""
    near = (measured.state == state) & (np.abs(measured.tilt_deg - tilt_deg) < _SAME_TILT_DEG)
    rate, output = measured.rate_deg_s[near], measured.output[near]
    if len(rate) == 0:
        return None
    centred = rate - rate.mean() if len(np.unique(rate)) > 1 else rate
    return float(centred @ output / (centred @ centred))


def relative_error_ppm(found: float | None, true: float) -> float | None:
    """Error of a found value [ppm]; None where there is none.

    Raises
    ------
    InputError
        If the true value is zero.
    """
    if true == 0.0:
        raise InputError("a true scale factor of 0 gives no relative error")
    return None if found is None else 1e6 * (found / true - 1.0)


def _doubts(
    measured: TableMeasurements, found: Misalignment, *, most_off: float = 0.01, far: float = 0.5
) -> list[str]:
    """What the turns show that is no scale factor's.

    Parameters
    ----------
    measured, found
        Turns, and what they gave.
    most_off
        Share of the greatest output by which a turn may miss what all show: the error that ends a gyro's
        range.
    far
        Share by which no gyro misses the scale factor of the unit that its output is stated in.
    """
    doubts = []
    spec = column_spec(REPLAYED)  # whose units are those of rates, and no counts
    assert spec is not None
    expected = 3600.0 / spec.units.get(measured.unit, (np.nan, 0.0))[0]
    if abs(found.K / expected - 1.0) > far:
        doubts.append(
            f"K is {short(found.K, 4)} where an output in {measured.unit} shows about {short(expected, 4)}: "
            "is its unit stated wrongly?"
        )
    along = {fit.state: fit.coefficients for fit in found.states}
    c = np.array([np.append(along[int(state)], 0.0)[:3] for state in measured.state])
    tilt = np.radians(measured.tilt_deg)
    shown = measured.rate_deg_s * (c[:, 0] * np.cos(tilt) + c[:, 1] * np.sin(tilt) + c[:, 2])
    off = np.abs(measured.output - shown) / np.abs(shown).max()
    worst, count = int(np.argmax(off)), int(np.count_nonzero(off > most_off))
    if count:
        more = (
            "" if count == 1 else f", as do {counted(count - 1, 'other turn')} by over {percent(most_off, 0)}"
        )
        doubts.append(
            f"the output of the turn at {measured.rate_deg_s[worst]:g} deg/s in state "
            f"{measured.state[worst]:g}, tilt {measured.tilt_deg[worst]:g} deg misses what all turns show by "
            f"{percent(off[worst], 0)} of the greatest{more}: does the output saturate, or was a turn not as "
            "stated?"
        )
    return doubts


SCHEMA = "fogml.misalignment/1"


def misalignment_json(measured: TableMeasurements, cross_tilt: bool | None = None) -> dict[str, Any]:
    """Scale factor and misalignment of a gyro, with the other methods beside, as ``fogml.misalignment/1``.

    Parameters
    ----------
    measured
        What the turns gave.
    cross_tilt
        Whether to fit a constant over the tilts; if None, where the data show one.
    """
    found = decouple(measured, cross_tilt)
    per_rate = f"{measured.unit} per deg/s"
    region = found.region
    return {
        "schema": SCHEMA,
        "source": measured.source,
        "synthetic": measured.synthetic,
        "K": found.K,
        "unit": per_rate,
        "delta_x_deg": found.delta_x_deg,
        "delta_y_deg": found.delta_y_deg,
        "delta_deg": found.delta_deg,
        "fixture_error_deg": list(found.fixture_error_deg),
        "se": dict(found.se or {}),
        "dof": found.dof,
        "level": LEVEL,
        "intervals": {name: list(ends) for name, ends in found.intervals.items()},
        "region": None
        if region is None
        else {
            "level": region.level,
            "half_axes_deg": list(region.half_axes_deg),
            "angle_deg": region.angle_deg,
            "outline_deg": region.outline_deg.tolist(),
        },
        "cross_tilt": found.cross_tilt,
        "cross_tilt_deg": found.cross_tilt_deg,
        "scale_drift_ppm": found.scale_drift_ppm,
        "scale_drift_se_ppm": found.scale_drift_se_ppm,
        "slope_noise": {"by_rates": found.rate_noise, "by_tilts": found.tilt_noise, "unit": per_rate},
        "state_angles_deg": list(measured.state_angles_deg),
        "order_p": found.order_p,
        "turns": len(measured.output),
        "rates_deg_s": np.unique(np.round(measured.rate_deg_s, 6)).tolist(),
        "states": [
            {
                "state": fit.state,
                "tilts_deg": fit.tilts_deg.tolist(),
                "slopes": fit.slopes.tolist(),
                "residuals": fit.residuals.tolist(),
                "coefficients": fit.coefficients.tolist(),
            }
            for fit in found.states
        ],
        "methods": [
            {**asdict(method), "K_difference_ppm": relative_error_ppm(method.K, found.K)}
            for method in compare_methods(measured, found.cross_tilt)
        ],
        "notes": [*_doubts(measured, found), *found.notes],
    }
