"""Scale factor and input-axis misalignment of a gyro, decoupled over four mounting states.

The input axis is a = (sin dx, sin dy, cos d) in gyro coordinates, the table's axis u = (sin t, 0, cos t) at
tilt t. For each state and tilt the output slope s over the table rate is a least-squares line; over the tilts
s = c_c cos t + c_s sin t. With a zero error e of the fixture c_c = K (a_z cos e + a_x sin e) and
c_s = K (a_x cos e - a_z sin e), so that hypot(c_c, c_s) is free of e and atan2(c_s, c_c) = psi_x - e. The
states are turns of the gyro in its mounting plane: in state 2, by 180 deg, a_x becomes -a_x, in states 3 and
4 it becomes -a_y and a_y (:mod:`fogml.lab.misalignment_states`). All eight coefficients give K, a and e by
least squares.

Source: the patent on decoupled testing of scale factor and input-axis misalignment (Fang et al., Beihang
University), with a constant column over the tilts for a fixture that is tilted across, and covariances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.lab.misalignment_drift import drift_words, scale_drift
from fogml.lab.misalignment_errors import (
    ROUND_OFF,
    Region,
    Slopes,
    StateFit,
    covariance_of,
    cross_tilt_angle,
    errors_of,
    reversed_words,
    slope_noise,
    weights_of,
)
from fogml.lab.misalignment_states import DOCUMENT_ANGLES_DEG, STATES, check_order, sense_of, solve
from fogml.signals.distributions import variances_sf

_CROSS_TILT_TEST = _DRIFT_TEST = 0.01


@dataclass(frozen=True)
class TableMeasurements:
    """Outputs of turns less the rests about them, one element per turn, each array of shape (n,).

    Attributes
    ----------
    state
        Mounting state, 1 to 4.
    tilt_deg
        Tilt of the fixture [deg].
    rate_deg_s
        Table rate with its sign [deg/s].
    output
        Mean while turning less the mean of the rests before and after [`unit`].
    unit
        Of the output.
    source
        File or run, for messages.
    state_angles_deg
        Turn of the gyro in its mounting plane in states 1 to 4, clockwise as seen from +z, that is against
        the reference axis [deg].
    synthetic
        Whether they come from a simulation.
    place
        When they were measured, in any unit that increases evenly; None where no one says.
    notes
        Sentences on what was recorded: turns that are not among them, samples that stand out.
    """

    state: FloatArray
    tilt_deg: FloatArray
    rate_deg_s: FloatArray
    output: FloatArray
    unit: str
    source: str = "measurements"
    state_angles_deg: Sequence[float] = DOCUMENT_ANGLES_DEG
    synthetic: bool = False
    place: FloatArray | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Misalignment:
    """Scale factor and misalignment with standard errors.

    Attributes
    ----------
    K
        Scale factor [output per deg/s].
    delta_x_deg, delta_y_deg, delta_deg
        Components of the input axis out of the reference axis, and the angle between the two [deg].
    fixture_error_deg
        Zero error of the fixture from states 1 and 2, and from 3 and 4 [deg].
    cross_tilt
        Whether a constant over the tilts was fitted for a fixture tilted across.
    cross_tilt_deg
        Size of that tilt, where the misalignment is large enough to tell it [deg].
    se
        Standard errors by the names above (``fixture_error_deg`` two of them); None where nothing is
        left over to tell them from.
    dof
        Degrees of freedom behind them.
    intervals
        Confidence intervals at `LEVEL`, by the same names.
    region
        Joint region of (dx, dy), None without standard errors.
    states
        The fits.
    rate_noise, tilt_noise
        Standard deviation of one slope [output per deg/s] as the lines over the rates tell it, and as
        the fits over the tilts do; None where nothing is left over.
    order_p
        Probability that the states disagree as much as they do under the stated order of their turns by
        chance; None where no noise is known.
    scale_drift_ppm, scale_drift_se_ppm
        Change of the scale factor over the test and its standard error, where the data show one; then K is
        the mean over the test.
    notes
        What to mind.
    """

    K: float
    delta_x_deg: float
    delta_y_deg: float
    delta_deg: float
    fixture_error_deg: tuple[float, float]
    cross_tilt: bool
    cross_tilt_deg: float | None
    se: Mapping[str, float | list[float]] | None
    dof: int
    intervals: Mapping[str, tuple[float, float]]
    region: Region | None
    states: tuple[StateFit, ...]
    rate_noise: float | None
    tilt_noise: float | None
    order_p: float | None
    scale_drift_ppm: float | None = None
    scale_drift_se_ppm: float | None = None
    notes: tuple[str, ...] = ()


def decouple(measured: TableMeasurements, cross_tilt: bool | None = None) -> Misalignment:
    """Scale factor and misalignment from all four states.

    Parameters
    ----------
    measured
        What the turns gave.
    cross_tilt
        Whether to fit a constant over the tilts; if None, where the data show one.

    Raises
    ------
    InputError
        If a state is missing, a state's tilts do not tell sine from cosine, the output does not follow the
        table rate, or the data contradict the order of the states' turns.
    """
    check_states(measured)
    angles_deg = tuple(float(angle) for angle in measured.state_angles_deg)
    slopes = {state: _slopes(measured, state) for state in STATES}
    for state in STATES:
        _check_tilts(measured.source, state, slopes[state].tilts, bool(cross_tilt))
    many = all(len(np.unique(one.tilts)) > 3 for one in slopes.values())
    drift = scale_drift(slopes, angles_deg, many and cross_tilt is not False, _DRIFT_TEST)
    if drift is not None:
        slopes = {
            state: replace(one, values=one.values / grown)
            for (state, one), grown in zip(slopes.items(), drift.grown, strict=True)
        }
    if cross_tilt is None:
        cross_tilt = _shows_cross_tilt(slopes)
    fits = tuple(_fit(state, slopes[state], cross_tilt) for state in STATES)
    c = np.array([fit.coefficients[:2] for fit in fits])
    rate_noise, tilt_noise, variances, dof, notes = slope_noise(slopes, fits, 0 if drift is None else 2)
    order_p, doubts = check_order(c, weights_of(fits, variances), angles_deg, dof, measured.source)
    alike = weights_of(fits, None)
    values, gradient = solve(c, alike, angles_deg)
    se, region = None, None
    intervals: dict[str, tuple[float, float]] = {}
    covariance = None
    if variances is not None:
        covariance = covariance_of(gradient, fits, variances, drift)
        se, intervals, region = errors_of(values, covariance, dof)
    doubt = "" if drift is None else ", or the scale factor drifts unevenly"
    across, more = cross_tilt_angle(fits, values, covariance, doubt) if cross_tilt else (None, ())
    return Misalignment(
        K=float(values[0]),
        delta_x_deg=float(values[1]),
        delta_y_deg=float(values[2]),
        delta_deg=float(values[3]),
        fixture_error_deg=(float(values[4]), float(values[5])),
        cross_tilt=cross_tilt,
        cross_tilt_deg=across,
        se=se,
        dof=dof,
        intervals=intervals,
        region=region,
        states=fits,
        rate_noise=rate_noise,
        tilt_noise=tilt_noise,
        order_p=order_p,
        scale_drift_ppm=None if drift is None else 1e6 * drift.share,
        scale_drift_se_ppm=None if drift is None else 1e6 * drift.se,
        notes=(
            *measured.notes,
            *doubts,
            *notes,
            *more,
            *drift_words(drift),
            *reversed_words(values),
            sense_of(angles_deg),
        ),
    )


def check_states(measured: TableMeasurements) -> None:
    """Hold that all four states are there."""
    missing = [str(state) for state in STATES if not np.any(measured.state == state)]
    if missing:
        raise InputError(
            f"{measured.source}: no turns in state {', '.join(missing)}; the four-state procedure needs "
            "states 1, 2, 3 and 4, the second and fourth turned by 180 deg in the mounting plane"
        )


def determines(measured: TableMeasurements) -> bool:
    """Whether all states are there, each with tilts that tell sine from cosine."""
    try:
        check_states(measured)
        for state in STATES:
            fit_state(measured, state)
    except InputError:
        return False
    return True


def fit_state(measured: TableMeasurements, state: int, cross_tilt: bool = False) -> StateFit:
    """The fit of one state alone over its tilts.

    Raises
    ------
    InputError
        If its tilts do not tell sine from cosine.
    """
    slopes = _slopes(measured, state)
    _check_tilts(measured.source, state, slopes.tilts, cross_tilt)
    return _fit(state, slopes, cross_tilt)


def _slopes(measured: TableMeasurements, state: int) -> Slopes:
    """Slopes over the table rate per tilt, by least squares with an intercept where rates differ.

    The intercept takes what is even in the rate: the horizontal part of the Earth rate.
    """
    chosen = measured.state == state
    tilts, group = np.unique(np.round(measured.tilt_deg[chosen], 9), return_inverse=True)
    rate, output = measured.rate_deg_s[chosen], measured.output[chosen]
    count = np.bincount(group).astype(np.float64)

    def sums(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(group, weights=values), dtype=np.float64)

    mean_rate, mean_output = sums(rate) / count, sums(output) / count
    centred = rate - mean_rate[group]
    spread = sums(centred**2)
    # A tilt with one rate only has a line through the origin.
    single = spread <= 1e-18 * sums(rate**2)
    centre = np.where(single, 0.0, mean_rate)
    centred = rate - centre[group]
    spread = sums(centred**2)
    values = sums(centred * output) / spread
    level = np.where(single, 0.0, mean_output)
    residuals = output - level[group] - values[group] * centred
    dof = int((count - np.where(single, 1.0, 2.0)).sum())
    if measured.place is None:
        places = np.full(len(tilts), np.nan)
    else:
        first, last = float(measured.place.min()), float(measured.place.max())
        # Of a slope each turn tells as much as its rate is off the mean.
        middle = sums(centred * rate * measured.place[chosen]) / sums(centred * rate)
        places = (middle - 0.5 * (first + last)) / ((last - first) or 1.0)
    return Slopes(tilts, values, places, float(residuals @ residuals), dof, float(np.mean(1.0 / spread)))


def _check_tilts(source: str, state: int, tilts: FloatArray, cross_tilt: bool) -> None:
    design = _design(tilts, cross_tilt)
    needed = design.shape[1]
    if np.linalg.matrix_rank(design, tol=1e-6 * np.sqrt(len(tilts))) < needed:
        what = f"{needed} tilts that differ (say 0, 30, 60 and 90 deg)"
        held = ", ".join(f"{tilt:g}" for tilt in tilts[:12])
        raise InputError(
            f"{source}, column 'tilt', state {state}: only tilt {held} deg; at least {what} are "
            "needed to tell scale factor and misalignment apart"
        )


def _design(tilts_deg: FloatArray, cross_tilt: bool) -> FloatArray:
    tilts = np.radians(tilts_deg)
    columns = [np.cos(tilts), np.sin(tilts)]
    if cross_tilt:
        columns.append(np.ones_like(tilts))
    return np.column_stack(columns)


def _fit(state: int, slopes: Slopes, cross_tilt: bool) -> StateFit:
    design = _design(slopes.tilts, cross_tilt)
    coefficients = np.asarray(np.linalg.lstsq(design, slopes.values, rcond=None)[0], dtype=np.float64)
    residuals = slopes.values - design @ coefficients
    return StateFit(state, slopes.tilts, slopes.values, residuals, coefficients, design)


def _shows_cross_tilt(slopes: Mapping[int, Slopes]) -> bool:
    """Whether constants over the tilts of the four states lower the residuals beyond chance (F test)."""
    if any(len(np.unique(s.tilts)) < 4 for s in slopes.values()):
        return False
    plain = [_fit(state, s, False) for state, s in slopes.items()]
    wide = [_fit(state, s, True) for state, s in slopes.items()]
    scale = max(float(np.abs(s.values).max()) for s in slopes.values())
    if max(abs(float(fit.coefficients[2])) for fit in wide) < ROUND_OFF * scale:
        return False
    before = sum(float(fit.residuals @ fit.residuals) for fit in plain)
    after = sum(float(fit.residuals @ fit.residuals) for fit in wide)
    dof = sum(len(fit.residuals) - 3 for fit in wide)
    if after <= (ROUND_OFF * scale) ** 2 * dof:
        return before > (ROUND_OFF * scale) ** 2 * dof
    ratio = (before - after) / len(wide) / (after / dof)
    return variances_sf(ratio, len(wide), dof) < _CROSS_TILT_TEST
