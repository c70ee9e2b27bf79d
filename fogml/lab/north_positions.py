"""North from recorded positions: means of each, azimuth, drift, and standard errors under its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError, known_are
from fogml.lab.north import (
    DEFAULT_ORDER,
    DriftError,
    check_design,
    design_matrix,
    horizontal_rate,
)
from fogml.models.linear import LinearRegressor
from fogml.models.row_noise import MEANS_A_STAY, noise_covariance
from fogml.models.table import RunRows
from fogml.runs.run import Run

METHODS = ("auto", "plain", "drift-observing")


@dataclass(frozen=True)
class NorthFix:
    """An azimuth from recorded positions.

    Attributes
    ----------
    azimuth_deg, se_deg
        Azimuth clockwise from north of the input axis in the first angle's position, and its standard
        error under the gyro's own noise [deg]; None where the samples are too few to tell that.
    method
        ``plain`` or ``drift-observing``.
    plain_deg, observed_deg
        Both results [deg]; the second None where the positions do not tell a drift.
    drift_deg_h_h, drift_se
        Linear drift seen [deg/h per h] and its standard error; None where they do not tell it.
    horizontal_deg_h
        Horizontal Earth rate that the positions show [deg/h].
    offset_deg_h
        Bias [deg/h].
    error
        What the drift that was seen, or a small one where none was, does to the plain result.
    means_deg_h, times_s, positions
        Each stay's mean, middle time and position, each of shape (m,).
    noise_deg_h
        Standard deviation of one sample within the stays; None where there is one sample only.
    notes
        What to mind.
    """

    azimuth_deg: float
    se_deg: float | None
    method: str
    plain_deg: float
    observed_deg: float | None
    drift_deg_h_h: float | None
    drift_se: float | None
    horizontal_deg_h: float
    offset_deg_h: float
    error: DriftError
    means_deg_h: FloatArray
    times_s: FloatArray
    positions: FloatArray
    noise_deg_h: float | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Stays:
    """Position, mean, middle time and length [s] of each stay; time, output and stay of every sample."""

    positions: FloatArray
    means: FloatArray
    times: FloatArray
    lengths_s: FloatArray
    time: FloatArray
    gyro: FloatArray
    stay: IndexArray


def north_from_positions(
    run: Run,
    *,
    sense: str = "cw",
    order_deg: Sequence[float] = DEFAULT_ORDER,
    method: str = "auto",
    settle_s: float = 0.0,
    latitude_deg: float | None = None,
    angle_tolerance_deg: float = 0.5,
) -> NorthFix:
    """North from a run with a column ``position``; 0 or nothing there is on the way.

    Without that column positions follow from ``angle``, the table's: where it rests at the angle of one.

    Parameters
    ----------
    run
        The input axis horizontal in every position.
    sense
        ``cw`` or ``ccw``.
    order_deg
        Angle of position 1, 2, ... [deg].
    method
        ``plain``, ``drift-observing``, or ``auto``: the second where the positions tell a linear drift. A
        drift of the bias too small to show is a multiple of the plain result's standard error.
    settle_s
        Time left out at the begin of each stay [s].
    latitude_deg
        For a check on the rate seen; that of the run's facts if None.
    angle_tolerance_deg
        Without ``position``: how far from its angle the table may be and count as in a position [deg].

    Raises
    ------
    InputError
        If positions are missing or are none, or the settings are not accepted.
    """
    if method not in METHODS:
        raise InputError(f"no method '{method}'; {known_are(method, METHODS)}")
    stays = _stays(run, order_deg, sense, settle_s, angle_tolerance_deg)
    angles = np.asarray(order_deg, dtype=np.float64)[stays.positions.astype(int) - 1]
    plain_design = design_matrix(angles, sense, None)
    check_design(plain_design, False)
    try:
        check_design(design_matrix(angles, sense, stays.times), True)
    except InputError:
        if method == "drift-observing":
            raise
        wide = None
    else:
        wide = _fitted(stays, plain_design, True)
    plain = _fitted(stays, plain_design, False)
    observed = wide is not None and method != "plain"
    chosen, covariance = wide if wide is not None and observed else plain
    drift = None if wide is None else float(wide[0][3])
    horizontal = float(np.hypot(chosen[0], chosen[1]))
    # What a drift of 1 deg/h per h does to the plain result.
    hours = _solved(stays, plain_design, (stays.time - stays.time.mean()) / 3600.0, False)
    p = hours.coef_[:2] * (drift if observed and drift else 1e-9)
    return NorthFix(
        azimuth_deg=_azimuth(chosen),
        se_deg=_azimuth_se(chosen, covariance),
        method="drift-observing" if observed else "plain",
        plain_deg=_azimuth(plain[0]),
        observed_deg=None if wide is None else _azimuth(wide[0]),
        drift_deg_h_h=drift,
        drift_se=None if wide is None or wide[1] is None else float(np.sqrt(wide[1][3, 3])),
        horizontal_deg_h=horizontal,
        offset_deg_h=float(chosen[2]),
        error=DriftError(float(p[0]), float(p[1]), horizontal),
        means_deg_h=stays.means,
        times_s=stays.times,
        positions=stays.positions,
        noise_deg_h=_sample_noise(stays),
        notes=_notes(run, latitude_deg, horizontal, covariance, drift),
    )


def _recorded_positions(run: Run, order_deg: Sequence[float], sense: str, tolerance_deg: float) -> FloatArray:
    """Position of each sample as recorded, or as the table's angle tells it; shape (n,)."""
    if "position" in run.columns:
        return run.columns["position"]
    if "angle" not in run.columns:
        raise InputError(
            f"{run.name}: no column 'position', 1 to {len(order_deg)} in a position and 0 on the way, and no "
            "column 'angle [deg]' of the table that would tell it; one of them is needed"
        )
    # The table's angle counts counter-clockwise.
    turned = run.columns["angle"] * (-1.0 if sense == "cw" else 1.0)
    off = (turned[:, None] - np.asarray(order_deg, dtype=np.float64) + 180.0) % 360.0 - 180.0
    nearest = np.argmin(np.abs(off), axis=1)
    there = np.abs(off[np.arange(len(off)), nearest]) <= tolerance_deg
    position = np.where(there, nearest + 1.0, 0.0)
    # A sample is a mean over its interval, so its neighbours have to be there as well.
    padded = np.concatenate([position[:1], position, position[-1:]])
    return np.where((padded[:-2] == position) & (padded[2:] == position), position, 0.0)


def _stays(run: Run, order_deg: Sequence[float], sense: str, settle_s: float, tolerance_deg: float) -> _Stays:
    """Mean, middle time and number of samples of each stay, and the variance of a sample within."""
    count = len(order_deg)
    recorded = _recorded_positions(run, order_deg, sense, tolerance_deg)
    if not (np.isfinite(settle_s) and settle_s >= 0.0):
        raise InputError(f"settle {settle_s:g} s: a time that is not negative is needed")
    position = np.nan_to_num(recorded, nan=0.0, posinf=-1.0, neginf=-1.0)
    wrong = (position < 0.0) | (position > count) | (position != np.round(position))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{run.name}, column 'position', row {row + 1}: {recorded[row]:g} is no position; "
            f"1 to {count} in a position and 0 on the way were expected"
        )
    missing = sorted(set(range(1, count + 1)) - set(position[position > 0].astype(int).tolist()))
    if missing:
        named = ", ".join(str(number) for number in missing)
        raise InputError(
            f"{run.name}, column 'position': no samples in position {named}; all of 1 to {count} are needed"
        )
    edges = np.concatenate([[0], np.flatnonzero(np.diff(position) != 0.0) + 1, [len(position)]])
    stay = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
    begin = run.time[edges[:-1]]
    used = (position > 0.0) & (run.time - begin[stay] >= settle_s)
    number, stay = np.unique(stay[used], return_inverse=True)
    left = set(position[used].astype(int).tolist())
    if len(left) < count:
        raise InputError(
            f"{run.name}: nothing is left of some positions after {settle_s:g} s to settle; leave out less"
        )
    time, gyro = run.time[used], run.gyro_deg_h[used]
    counts, level = np.bincount(stay), float(gyro[0])
    means = level + np.bincount(stay, weights=gyro - level) / counts
    times = np.bincount(stay, weights=time) / counts
    ends = np.cumsum(counts)
    lengths = time[ends - 1] - time[ends - counts]
    return _Stays(position[edges[:-1]][number], means, times, lengths, time, gyro, stay)


def _sample_noise(stays: _Stays) -> float | None:
    """Deviation of a sample about its stay's mean and a drift [deg/h]; None where too few tell it."""
    residuals, offsets = stays.gyro - stays.means[stays.stay], stays.time - stays.times[stays.stay]
    freedom = len(stays.time) - len(stays.means) - 1
    if freedom < 1:
        return None
    residuals = residuals - float(offsets @ residuals) / float(offsets @ offsets) * offsets
    return float(np.sqrt(residuals @ residuals / freedom))


def _columns(stays: _Stays, design: FloatArray, observes_drift: bool) -> FloatArray:
    """Columns of every sample beside the constant: H cos(theta), H sin(theta) and, if observed, drift."""
    turned = design[stays.stay, :2]
    return np.column_stack((turned, (stays.time - stays.time.mean()) / 3600.0)) if observes_drift else turned


def _solved(stays: _Stays, design: FloatArray, values: FloatArray, observes_drift: bool) -> LinearRegressor:
    return LinearRegressor().fit(_columns(stays, design, observes_drift), values)


def _fitted(stays: _Stays, design: FloatArray, observes_drift: bool) -> tuple[FloatArray, FloatArray | None]:
    """H cos(theta), H sin(theta), offset and, if observed, drift; their covariance under the gyro's noise.

    None for that where the stays are too short to tell a noise, which is not taken for white: the mean of a
    quiet gyro over a stay is as uncertain as its flicker makes it.
    """
    level = float(stays.gyro.mean())
    solved = _solved(stays, design, stays.gyro - level, observes_drift)
    rows = RunRows(_columns(stays, design, observes_drift), stays.gyro - level, stays.time)
    step_s = float(np.median(np.diff(stays.time))) if len(stays.time) > 1 else 0.0
    averaging_s = float(np.median(stays.lengths_s)) / MEANS_A_STAY
    covariance = noise_covariance(
        [rows], lambda columns: columns, solved, averaging_s if averaging_s > step_s else 0.0
    )
    order = [1, 2, 0, 3] if observes_drift else [1, 2, 0]
    found = np.concatenate(([solved.intercept_ + level], solved.coef_))[order]
    return found, None if covariance is None else covariance[np.ix_(order, order)]


def _azimuth(found: FloatArray) -> float:
    return float(np.degrees(np.arctan2(found[1], found[0])) % 360.0)


def _azimuth_se(found: FloatArray, covariance: FloatArray | None) -> float | None:
    if covariance is None:
        return None
    square = float(found[0] ** 2 + found[1] ** 2)
    slope = np.array([-found[1], found[0]]) / square
    return float(np.degrees(np.sqrt(slope @ covariance[:2, :2] @ slope)))


def _notes(
    run: Run,
    latitude_deg: float | None,
    horizontal: float,
    covariance: FloatArray | None,
    drift: float | None,
) -> tuple[str, ...]:
    latitude = run.facts.latitude if latitude_deg is None else latitude_deg
    told = (
        []
        if drift is not None
        else ["the positions don't tell a drift: the standard error holds without one"]
    )
    if covariance is None:
        told.append("no standard error: the samples in each position are too few, or hold no noise")
    if latitude is None:
        told.append(
            f"no latitude is stated: the horizontal Earth rate is the one seen, {horizontal:.4g} deg/h"
        )
        return tuple(told)
    expected = horizontal_rate(latitude)
    tolerance = 0.02 * expected + (
        5.0 * float(np.sqrt(covariance[:2, :2].trace())) if covariance is not None else 0.0
    )
    if abs(horizontal - expected) > tolerance:
        told.append(
            f"the positions show {horizontal:.4g} deg/h of Earth rate, {expected:.4g} deg/h were expected "
            f"at latitude {latitude:g} deg: the axis is not level, the scale factor is off, or the positions "
            "are not what they are called"
        )
    return tuple(told)
