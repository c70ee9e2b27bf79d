"""Standard errors, intervals and the confidence region of the decoupled scale factor and misalignment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.distributions import student_ppf, variances_isf

LEVEL = 0.95
"""Confidence of intervals and of the region."""
ROUND_OFF = 1e-11
"""Share of the largest slope below which a difference is round-off."""
_LEAST_DOF = 4


@dataclass(frozen=True)
class StateFit:
    """One state's slopes over its tilts.

    ``tilts_deg``, ``slopes`` and ``residuals`` of shape (m,), slopes in output per deg/s;
    ``coefficients`` c_c, c_s and, with a cross tilt, the constant.
    """

    state: int
    tilts_deg: FloatArray
    slopes: FloatArray
    residuals: FloatArray
    coefficients: FloatArray
    design: FloatArray = field(repr=False)


@dataclass(frozen=True)
class Region:
    """Joint confidence region of (dx, dy): an ellipse about the estimate.

    Half-axes [deg], the angle of the longer one from the x axis [deg], the level, and points of the
    outline, shape (k, 2) [deg].
    """

    level: float
    half_axes_deg: tuple[float, float]
    angle_deg: float
    outline_deg: FloatArray


@dataclass(frozen=True)
class Slopes:
    """Slopes of one state over its tilts, arrays of shape (m,), and what the lines over the rates left.

    ``places`` is when they were measured, from -1/2 at the test's begin to 1/2 at its end; NaN if not known.
    """

    tilts: FloatArray
    values: FloatArray
    places: FloatArray
    squares: float
    dof: int
    inverse_spread: float


@dataclass(frozen=True)
class ScaleDrift:
    """Change of the scale factor over the test, as a share of it, its standard error, and what tells it.

    State by state: how much the scale factor is `grown` at each slope, shape (m,), derivatives of the drift's
    terms `by_slopes`, shape (k, m), and what a unit of each term `moves` the slopes by, shape (m, k).
    """

    share: float
    se: float
    grown: tuple[FloatArray, ...]
    by_slopes: tuple[FloatArray, ...]
    moves: tuple[FloatArray, ...]


def slope_noise(
    slopes: Mapping[int, Slopes], fits: tuple[StateFit, ...], taken: int = 0
) -> tuple[float | None, float | None, tuple[FloatArray, ...] | None, int, tuple[str, ...]]:
    """Noise of a slope by the rates and by the tilts, the variances to use, its degrees of freedom, notes.

    So many degrees of freedom of the tilts are `taken` by what was fitted before.
    """
    dof_rates = sum(s.dof for s in slopes.values())
    per_output = sum(s.squares for s in slopes.values()) / dof_rates if dof_rates else None
    by_rates = (
        per_output * float(np.mean([s.inverse_spread for s in slopes.values()])) if per_output else None
    )
    dof_tilts = max(sum(len(fit.residuals) - fit.design.shape[1] for fit in fits) - taken, 0)
    by_tilts = sum(float(fit.residuals @ fit.residuals) for fit in fits) / dof_tilts if dof_tilts else None
    told = tuple(np.sqrt(v) if v is not None else None for v in (by_rates, by_tilts))
    if by_tilts is not None and dof_tilts >= _LEAST_DOF:
        # These hold errors of the tilt settings too, which no line over the rates can see.
        notes: tuple[str, ...] = ()
        scale = max(float(np.abs(fit.slopes).max()) for fit in fits)
        real = by_tilts > (ROUND_OFF * scale) ** 2
        if real and by_rates and by_tilts > variances_isf(0.01, dof_tilts, dof_rates) * by_rates:
            notes = (
                "slopes scatter over the tilts more than noise explains: errors of the tilt settings, "
                "or drift between the tilts; the standard errors hold them",
            )
            return told[0], told[1], _with_tilt_errors(fits, by_rates), dof_tilts, notes
        return told[0], told[1], _uniform(fits, by_tilts), dof_tilts, notes
    dof = dof_tilts + dof_rates
    if dof == 0:
        return (
            told[0],
            told[1],
            None,
            0,
            ("no standard errors: nothing is left over; take more tilts or rates",),
        )
    variance = ((by_tilts or 0.0) * dof_tilts + (by_rates or 0.0) * dof_rates) / dof
    note = (
        "few tilts: standard errors rest on the scatter over the rates and miss errors of the tilt settings"
    )
    return told[0], told[1], _uniform(fits, variance), dof, (note,)


def _uniform(fits: tuple[StateFit, ...], variance: float) -> tuple[FloatArray, ...]:
    return tuple(np.full(len(fit.slopes), variance) for fit in fits)


def _with_tilt_errors(fits: tuple[StateFit, ...], by_rates: float) -> tuple[FloatArray, ...]:
    """Variances of slopes whose tilts err: noise, and one variance of tilts times the curve's slope squared.

    The tilts' variance is the one that makes the residuals as large as they are.
    """
    steep, seen, expected = [], 0.0, 0.0
    for fit in fits:
        # Columns are cos, sin (and 1): the derivative of the curve over the tilt.
        curve = -fit.coefficients[0] * fit.design[:, 1] + fit.coefficients[1] * fit.design[:, 0]
        left = np.eye(len(fit.slopes)) - fit.design @ np.linalg.pinv(fit.design)
        steep.append(curve**2)
        seen += float(fit.residuals @ fit.residuals) - by_rates * float(np.trace(left))
        expected += float(np.diag(left) @ curve**2)
    tilt_variance = max(seen / expected, 0.0)
    return tuple(by_rates + tilt_variance * squares for squares in steep)


def weights_of(fits: tuple[StateFit, ...], variances: tuple[FloatArray, ...] | None) -> FloatArray:
    """Square roots of the information on each state's c_c and c_s, shape (4, 2, 2).

    Without variances that of round-off.
    """
    roots = []
    largest = max(float(np.abs(fit.slopes).max()) for fit in fits)
    # An output that stands still has slopes of 0; any floor does then.
    floor = (ROUND_OFF * (largest or 1.0)) ** 2
    for i, fit in enumerate(fits):
        solver = np.linalg.pinv(fit.design)[:2]
        noise = floor if variances is None else np.maximum(variances[i], floor)
        roots.append(np.linalg.cholesky(np.linalg.inv((solver * noise) @ solver.T)).T)
    return np.array(roots)


def covariance_of(
    gradient: FloatArray,
    fits: tuple[StateFit, ...],
    variances: tuple[FloatArray, ...],
    drift: ScaleDrift | None = None,
) -> FloatArray:
    """Covariance of values with a gradient by the states' coefficients, shape (v, 4, 2): shape (v, v).

    A drift of the scale factor, told by the same slopes, was taken off them.
    """
    by_slopes = [gradient[:, i] @ np.linalg.pinv(fit.design)[:2] for i, fit in enumerate(fits)]
    if drift is not None:
        by_drift = sum(one @ moves for one, moves in zip(by_slopes, drift.moves, strict=True))
        by_slopes = [one - by_drift @ told for one, told in zip(by_slopes, drift.by_slopes, strict=True)]
    return np.asarray(sum((one * v) @ one.T for one, v in zip(by_slopes, variances, strict=True)))


def errors_of(
    values: FloatArray, covariance: FloatArray, dof: int
) -> tuple[dict[str, float | list[float]], dict[str, tuple[float, float]], Region]:
    sd = np.sqrt(np.diag(covariance))
    region = _region(values[1:3], covariance[1:3, 1:3], dof)
    factor = float(student_ppf(0.5 * (1.0 + LEVEL), dof))
    names = ("K", "delta_x_deg", "delta_y_deg")
    intervals = {
        n: (float(values[i] - factor * sd[i]), float(values[i] + factor * sd[i])) for i, n in enumerate(names)
    }
    # The angle can't be negative: its interval is what the joint region of dx and dy spans.
    sines = np.sin(np.radians(region.outline_deg))
    angles = np.degrees(np.arcsin(np.minimum(np.hypot(sines[:, 0], sines[:, 1]), 1.0)))
    inside = _holds_zero(values[1:3], covariance[1:3, 1:3], dof)
    low, high = 0.0 if inside else float(angles.min()), float(angles.max())
    # An axis that points down is as far from the reference axis turned round.
    intervals["delta_deg"] = (180.0 - high, 180.0 - low) if values[3] > 90.0 else (low, high)
    se: dict[str, float | list[float]] = {n: float(sd[i]) for i, n in enumerate(names)}
    gradient_free = inside or sd[3] == 0.0
    se["delta_deg"] = float(np.hypot(sd[1], sd[2]) / np.sqrt(2.0)) if gradient_free else float(sd[3])
    se["fixture_error_deg"] = [float(sd[4]), float(sd[5])]
    return se, intervals, region


def _holds_zero(centre: FloatArray, covariance: FloatArray, dof: int) -> bool:
    """Whether the region about an estimate holds zero misalignment."""
    if not np.linalg.det(covariance) > 0.0:
        return not centre.any()
    return bool(centre @ np.linalg.solve(covariance, centre) <= _region_factor(dof))


def _region_factor(dof: int) -> float:
    return 2.0 * variances_isf(1.0 - LEVEL, 2, dof)


def _region(centre: FloatArray, covariance: FloatArray, dof: int) -> Region:
    squares, axes = np.linalg.eigh(covariance)
    half = np.sqrt(np.maximum(squares, 0.0) * _region_factor(dof))
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    outline = centre + (np.column_stack([np.cos(turn), np.sin(turn)]) * half) @ axes.T
    long = axes[:, 1]
    angle = float(np.degrees(np.arctan2(long[1], long[0]))) % 180.0
    return Region(LEVEL, (float(half[1]), float(half[0])), angle, outline)


def cross_tilt_angle(
    fits: tuple[StateFit, ...], values: FloatArray, covariance: FloatArray | None, doubt: str = ""
) -> tuple[float | None, tuple[str, ...]]:
    """Size of the fixture's tilt across: the constants of opposite states differ by 2 K sin f a_x or a_y."""
    note = (
        f"a fixture tilted across by f shows{doubt}; K is low by the factor cos f, the misalignment is right"
    )
    constants = np.array([fit.coefficients[2] for fit in fits])
    size = np.hypot(constants[0] - constants[1], constants[2] - constants[3]) / 2.0
    lever = values[0] * np.sin(np.radians(values[3]))
    told = covariance is None or values[3] > 5.0 * np.sqrt(covariance[3, 3])
    if not told or size >= abs(lever):
        return None, (note,)
    return float(np.degrees(np.arcsin(size / lever))), (note,)


def reversed_words(values: FloatArray) -> tuple[str, ...]:
    """What is said of an input axis that points away from the reference axis."""
    if values[3] <= 90.0:
        return ()
    return (
        "the input axis points down, or the output's sign is reversed: the angle to the reference axis is "
        "above 90 deg",
    )
