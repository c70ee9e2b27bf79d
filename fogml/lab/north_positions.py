"""North from recorded positions: means of each, azimuth, drift, standard errors; and such runs simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, known_are
from fogml.lab.north import (
    DEFAULT_ORDER,
    Drift,
    DriftError,
    Scheme,
    check_design,
    design_matrix,
    horizontal_rate,
)
from fogml.runs.facts import Facts
from fogml.runs.run import Run

METHODS = ("auto", "plain", "drift-observing")
_SEEN = 3.0
_ROUND_OFF = 1e-11


@dataclass(frozen=True)
class NorthFix:
    """An azimuth from recorded positions.

    Attributes
    ----------
    azimuth_deg, se_deg
        Azimuth clockwise from north of the input axis in the first angle's position, and its standard
        error [deg]; None where each position has one sample only.
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


@dataclass(frozen=True)
class _Stays:
    positions: FloatArray
    means: FloatArray
    times: FloatArray
    counts: FloatArray
    variance: float | None


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
        ``plain``, ``drift-observing``, or ``auto``: the second where a linear drift shows, at three
        standard errors.
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
    wide_design = design_matrix(angles, sense, stays.times)
    weights = np.sqrt(stays.counts)
    plain, plain_cov = _fitted(plain_design, stays.means, weights, stays.variance)
    tells_drift = _tells_drift(wide_design)
    if method == "drift-observing" and not tells_drift:
        check_design(wide_design, True)
    wide, wide_cov = (
        _fitted(wide_design, stays.means, weights, stays.variance) if tells_drift else (None, None)
    )
    drift = float(wide[3]) if wide is not None else None
    drift_se = float(np.sqrt(wide_cov[3, 3])) if wide_cov is not None else None
    observed = method == "drift-observing" or (
        method == "auto" and drift is not None and _shows(drift, drift_se, stays)
    )
    chosen, covariance = (wide, wide_cov) if observed else (plain, plain_cov)
    assert chosen is not None
    horizontal = float(np.hypot(chosen[0], chosen[1]))
    notes = _notes(run, latitude_deg, horizontal, covariance)
    shape = (stays.times - stays.times.mean()) / 3600.0
    p = _solver(plain_design, weights)[:2] @ shape * (drift if observed and drift is not None else 1e-9)
    return NorthFix(
        azimuth_deg=_azimuth(chosen),
        se_deg=_azimuth_se(chosen, covariance),
        method="drift-observing" if observed else "plain",
        plain_deg=_azimuth(plain),
        observed_deg=_azimuth(wide) if wide is not None else None,
        drift_deg_h_h=drift,
        drift_se=drift_se,
        horizontal_deg_h=horizontal,
        offset_deg_h=float(chosen[2]),
        error=DriftError(float(p[0]), float(p[1]), horizontal),
        means_deg_h=stays.means,
        times_s=stays.times,
        positions=stays.positions,
        noise_deg_h=None if stays.variance is None else float(np.sqrt(stays.variance)),
        notes=notes,
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
    counts = np.bincount(stay).astype(np.float64)
    level = float(gyro[0])
    means = level + np.bincount(stay, weights=gyro - level) / counts
    times = np.bincount(stay, weights=time) / counts
    residuals, offsets = gyro - means[stay], time - times[stay]
    spread = float(offsets @ offsets)
    slope = float(offsets @ residuals) / spread if spread > 0.0 else 0.0
    residuals = residuals - slope * offsets
    dof = len(time) - len(counts) - 1
    variance = float(residuals @ residuals) / dof if dof > 0 else None
    return _Stays(position[edges[:-1]][number], means, times, counts, variance)


def _solver(design: FloatArray, weights: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.pinv(design * weights[:, None]) * weights)


def _fitted(
    design: FloatArray, means: FloatArray, weights: FloatArray, variance: float | None
) -> tuple[FloatArray, FloatArray | None]:
    solver = _solver(design, weights)
    if variance is None:
        return np.asarray(solver @ means), None
    return np.asarray(solver @ means), np.asarray(variance * (solver / weights**2) @ solver.T)


def _tells_drift(design: FloatArray) -> bool:
    try:
        check_design(design, True)
    except InputError:
        return False
    return True


def _shows(drift: float, se: float | None, stays: _Stays) -> bool:
    span_h = float(np.ptp(stays.times)) / 3600.0
    round_off = _ROUND_OFF * float(np.abs(stays.means).max())
    return abs(drift) * span_h > round_off and (se is None or abs(drift) > _SEEN * se)


def _azimuth(found: FloatArray) -> float:
    return float(np.degrees(np.arctan2(found[1], found[0])) % 360.0)


def _azimuth_se(found: FloatArray, covariance: FloatArray | None) -> float | None:
    if covariance is None:
        return None
    square = float(found[0] ** 2 + found[1] ** 2)
    slope = np.array([-found[1], found[0]]) / square
    return float(np.degrees(np.sqrt(slope @ covariance[:2, :2] @ slope)))


def _notes(
    run: Run, latitude_deg: float | None, horizontal: float, covariance: FloatArray | None
) -> tuple[str, ...]:
    latitude = run.facts.latitude if latitude_deg is None else latitude_deg
    if latitude is None:
        return (f"no latitude is stated: the horizontal Earth rate is the one seen, {horizontal:.4g} deg/h",)
    expected = horizontal_rate(latitude)
    tolerance = 0.02 * expected + (
        5.0 * float(np.sqrt(covariance[:2, :2].trace())) if covariance is not None else 0.0
    )
    if abs(horizontal - expected) <= tolerance:
        return ()
    return (
        f"the positions show {horizontal:.4g} deg/h of Earth rate, {expected:.4g} deg/h were expected at "
        f"latitude {latitude:g} deg: the axis is not level, the scale factor is off, or the positions are "
        "not what they are called",
    )


def simulated_positions(
    scheme: Scheme,
    azimuth_deg: float,
    latitude_deg: float,
    drift: Drift,
    *,
    bias_deg_h: float = 0.0,
    random_walk_deg_sqrt_h: float = 0.0,
    sample_s: float = 1.0,
    seed: int = 0,
) -> Run:
    """A synthetic run of a scheme with a column ``position``, each sample the mean over its interval.

    Samples that are not wholly in a position have position 0; the axis is not simulated on the way.

    Raises
    ------
    InputError
        If a stay is shorter than a sample, or the latitude is not accepted.
    """
    if not (np.isfinite(sample_s) and 0.0 < sample_s <= scheme.dwell_s):
        raise InputError(f"sample interval {sample_s:g} s: above 0 and no longer than the dwell is needed")
    begin, end = scheme.spans_s
    count = int(np.ceil((end[-1] - begin[0]) / sample_s - 1e-9))
    start = begin[0] + sample_s * np.arange(count)
    stay = np.searchsorted(begin, start + 1e-9, side="right") - 1
    inside = start + sample_s <= end[stay] + 1e-9
    order = list(dict.fromkeys(scheme.order_deg))
    numbers = np.array([order.index(angle) + 1 for angle in scheme.order_deg], dtype=np.float64)
    outputs = scheme.outputs(azimuth_deg, horizontal_rate(latitude_deg))[stay]
    gyro = np.where(inside, outputs, 0.0) + bias_deg_h + drift.mean(start, start + sample_s)
    noise = random_walk_deg_sqrt_h / np.sqrt(sample_s / 3600.0)
    gyro += noise * np.random.default_rng(seed).standard_normal(count)
    facts = Facts(
        unit="synthetic", latitude=latitude_deg, powered_on=0.0, notes="synthetic: simulated positions"
    )
    columns = {"time": start, "gyro": gyro, "position": np.where(inside, numbers[stay], 0.0)}
    return Run("synthetic positions", columns, facts)
