"""North from recorded positions: means of each, azimuth, drift, and standard errors under its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError, known_are
from fogml.lab.north import (
    DEFAULT_ORDER,
    SENSES,
    DriftError,
    check_design,
    design_matrix,
)
from fogml.lab.north_fix import LeftIn, NorthFix, angle_notes, azimuth_se, fix_notes, set_up_notes, standing
from fogml.lab.north_schemes import wrapped
from fogml.models.linear import LinearRegressor
from fogml.models.row_noise import MEANS_A_STAY, noise_covariance
from fogml.models.table import RunRows
from fogml.runs.run import Run

METHODS = ("auto", "plain", "drift-observing", "bend-observing")


@dataclass(frozen=True, eq=False)
class _Stays:
    """Position, mean, middle time and length [s] of each stay; time, output and stay of samples; notes."""

    positions: FloatArray
    means: FloatArray
    times: FloatArray
    lengths_s: FloatArray
    time: FloatArray
    gyro: FloatArray
    stay: IndexArray
    notes: tuple[str, ...] = ()


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
        ``plain``, ``drift-observing``, ``bend-observing``, or ``auto``. Where the positions tell a linear
        drift, that takes it out, as one too small to show may be a multiple of the plain result's standard
        error. A square of time as well, as at start-up, costs up to twice the standard error: so ``auto``
        averages the results without it, with it and with a cube by how probable they are.
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
    check_design(design_matrix(order_deg, sense, None), False)
    stays = _stays(run, order_deg, sense, settle_s, angle_tolerance_deg)
    angles = np.asarray(order_deg, dtype=np.float64)[stays.positions.astype(int) - 1]
    plain_design = design_matrix(angles, sense, None)
    check_design(plain_design, False)
    highest = 3 if _tells_drift(angles, sense, stays, method) else 0
    while highest > 1 and not _tells_power(stays, plain_design, highest):
        highest -= 1
    fits = [_fitted(stays, plain_design, order) for order in range(highest + 1)]
    order = {"plain": 0, "drift-observing": 1, "bend-observing": 2, "auto": min(highest, 1)}[method]
    if order > highest:
        raise InputError(f"{run.name}: the samples in each position are too few to tell a bend of the bias")
    (chosen, covariance), share, called = fits[order], None, METHODS[1 + order]
    averaged = _averaged(fits[1:], len(stays.means)) if method == "auto" else None
    if averaged is not None:
        chosen, covariance, share = averaged
        called = "averaged"
    drift, drift_se = _term(fits[max(order, 1)], 3) if highest else (None, None)
    bend, bend_se = _term(fits[2], 4) if highest > 1 else (None, None)
    horizontal = float(np.hypot(chosen[0], chosen[1]))
    # What a drift of 1 deg/h per h does to the plain result, where none is taken out.
    hours = (stays.time - stays.time.mean()) / 3600.0
    taken = np.polynomial.polynomial.polyval(hours, np.concatenate(([0.0], chosen[3:])))
    p = _solved(stays, plain_design, taken if np.any(taken) else 1e-9 * hours, 0).coef_
    found = [_azimuth(fit[0]) for fit in fits]
    fix = NorthFix(
        azimuth_deg=_azimuth(chosen),
        se_deg=azimuth_se(chosen, covariance),
        method=called,
        plain_deg=found[0],
        observed_deg=found[1] if len(found) > 1 else None,
        bent_deg=found[2] if len(found) > 2 else None,
        drift_deg_h_h=drift,
        drift_se=drift_se,
        bend_deg_h_h2=bend,
        bend_se=bend_se,
        bend_probability=share,
        horizontal_deg_h=horizontal,
        offset_deg_h=float(chosen[2]),
        error=DriftError(float(p[0]), float(p[1]), horizontal),
        means_deg_h=stays.means,
        times_s=stays.times,
        positions=stays.positions,
        noise_deg_h=_sample_noise(stays),
    )
    # What the chosen result leaves in, at least in part.
    beyond = 2 if called in METHODS[1:3] else 3
    left = None
    if beyond <= highest:
        left = LeftIn(*_term(fits[beyond], 2 + beyond), found[beyond], azimuth_se(*fits[beyond]))
    notes = [
        *stays.notes,
        *fix_notes(fix, covariance, left),
        *set_up_notes(run, fix, covariance, latitude_deg),
        *angle_notes(run, stays.times, angles * SENSES[sense], angle_tolerance_deg, fix.azimuth_deg),
    ]
    return replace(fix, notes=tuple(notes))


def _tells_drift(angles: FloatArray, sense: str, stays: _Stays, method: str) -> bool:
    try:
        check_design(design_matrix(angles, sense, stays.times), True)
    except InputError:
        if method in METHODS[2:]:
            raise
        return False
    return True


def _tells_power(stays: _Stays, design: FloatArray, order: int) -> bool:
    """Whether the samples tell a power of time from all that is solved for beside it."""
    columns = _columns(stays, design, order)
    columns = np.column_stack((np.ones(len(columns)), columns / np.linalg.norm(columns, axis=0)))
    return bool(np.linalg.matrix_rank(columns, tol=1e-6) == columns.shape[1])


def _averaged(
    fits: Sequence[tuple[FloatArray, FloatArray | None]], stays: int
) -> tuple[FloatArray, FloatArray, float] | None:
    """Mean of results with ever more powers of time, its covariance, and the probability of a bend.

    How far they part is in the covariance. Each power is as likely there as not where the one before it is.
    Before the data their coefficients are normal about 0, as wide as a single stay would tell them: unit
    information (R. E. Kass & L. Wasserman, J. Am. Stat. Assoc. 90, 1995).

    Parameters
    ----------
    fits
        With a linear drift first: coefficients, and their covariance.
    stays
        How many tell them.

    Returns
    -------
    found, covariance, probability
        None where there is nothing to average, or no covariance.
    """
    told = [(found, own) for found, own in fits if own is not None and np.all(np.diag(own) > 0.0)]
    if len(told) < max(len(fits), 2):
        return None
    size, logs = len(told[-1][0]), np.zeros(len(told))
    for bends, (found, own) in enumerate(told):
        prior = -np.log(2.0) * min(bends + 1, len(told) - 1)
        square = float(found[4:] @ np.linalg.solve(own[4:, 4:], found[4:]))
        logs[bends] = prior + 0.5 * square * stays / (1.0 + stays) - 0.5 * bends * np.log1p(stays)
    weights = np.exp(logs - np.logaddexp.reduce(logs))
    padded = np.array([np.pad(found, (0, size - len(found))) for found, _ in told])
    mean, covariance = weights @ padded, np.zeros((size, size))
    for weight, off, (_, own) in zip(weights, padded - mean, told, strict=True):
        covariance += weight * (np.pad(own, (0, size - len(own))) + np.outer(off, off))
    return mean, covariance, float(1.0 - weights[0])


def _term(fit: tuple[FloatArray, FloatArray | None], place: int) -> tuple[float, float | None]:
    found, covariance = fit
    return float(found[place]), None if covariance is None else float(np.sqrt(covariance[place, place]))


def _recorded_positions(run: Run, order_deg: Sequence[float], sense: str, tolerance_deg: float) -> FloatArray:
    """Position of each sample as recorded, or as the table's angle tells it; shape (n,)."""
    if "position" in run.columns:
        return run.columns["position"]
    if "angle" not in run.columns:
        raise InputError(
            f"{run.name}: no column 'position', 1 to {len(order_deg)} in a position and 0 on the way, and no "
            "column 'angle [deg]' of the table that would tell it; one of them is needed"
        )
    if not 0.0 < tolerance_deg < 180.0:
        raise InputError(f"tolerance of the table's angle {tolerance_deg:g} deg: 0 to 180 deg is needed")
    # The table's angle counts counter-clockwise.
    turned = run.columns["angle"] * (-1.0 if sense == "cw" else 1.0)
    off = wrapped(turned[:, None] - np.asarray(order_deg, dtype=np.float64))
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
        column, where = "position", ""
        if "position" not in run.columns:
            column = "angle"
            at = ", ".join(f"{angle % 360.0:g}" for angle in -SENSES[sense] * np.asarray(order_deg))
            where = f", where it rests within {tolerance_deg:g} deg of {at} deg: --order states other angles"
        raise InputError(
            f"{run.name}, column '{column}': no samples in position {named}; "
            f"all of 1 to {count} are needed{where}"
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
    still, notes = standing(time, gyro, stay)
    time, gyro, stay = time[still], gyro[still], stay[still]
    counts, level = np.bincount(stay), float(gyro[0])
    means = level + np.bincount(stay, weights=gyro - level) / counts
    times = np.bincount(stay, weights=time) / counts
    ends = np.cumsum(counts)
    lengths = time[ends - 1] - time[ends - counts]
    return _Stays(position[edges[:-1]][number], means, times, lengths, time, gyro, stay, notes)


def _sample_noise(stays: _Stays) -> float | None:
    """Deviation of a sample about its stay's mean and a drift [deg/h]; None where too few tell it."""
    residuals, offsets = stays.gyro - stays.means[stays.stay], stays.time - stays.times[stays.stay]
    freedom = len(stays.time) - len(stays.means) - 1
    if freedom < 1:
        return None
    residuals = residuals - float(offsets @ residuals) / float(offsets @ offsets) * offsets
    return float(np.sqrt(residuals @ residuals / freedom))


def _columns(stays: _Stays, design: FloatArray, order: int) -> FloatArray:
    """Columns of every sample beside the constant: H cos(theta), H sin(theta), powers of time up to one."""
    hours = (stays.time - stays.time.mean()) / 3600.0
    return np.column_stack([design[stays.stay, :2], *(hours**power for power in range(1, order + 1))])


def _solved(stays: _Stays, design: FloatArray, values: FloatArray, order: int) -> LinearRegressor:
    return LinearRegressor().fit(_columns(stays, design, order), values)


def _fitted(stays: _Stays, design: FloatArray, order: int) -> tuple[FloatArray, FloatArray | None]:
    """H cos(theta), H sin(theta), offset, powers of time up to an order; their covariance under the noise.

    None for that where the stays are too short to tell a noise, which is not taken for white: the mean of a
    quiet gyro over a stay is as uncertain as its flicker makes it.
    """
    level = float(stays.gyro.mean())
    solved = _solved(stays, design, stays.gyro - level, order)
    rows = RunRows(_columns(stays, design, order), stays.gyro - level, stays.time)
    step_s = float(np.median(np.diff(stays.time))) if len(stays.time) > 1 else 0.0
    averaging_s = float(np.median(stays.lengths_s)) / MEANS_A_STAY
    covariance = noise_covariance(
        [rows], lambda columns: columns, solved, averaging_s if averaging_s > step_s else 0.0
    )
    place = [1, 2, 0, *range(3, 3 + order)]
    found = np.concatenate(([solved.intercept_ + level], solved.coef_))[place]
    return found, None if covariance is None else covariance[np.ix_(place, place)]


def _azimuth(found: FloatArray) -> float:
    return float(np.degrees(np.arctan2(found[1], found[0])) % 360.0)
