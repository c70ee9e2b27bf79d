"""Temperature sensitivity of the scale factor, from turns at several temperatures (eps_T of IEEE Std 952)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray
from fogml.lab.rate_errors import spread_of
from fogml.lab.rate_pieces import Plateaus
from fogml.runs.run import Run
from fogml.validation.scale_factor import SAME_SHARE, find_steps

LEAST_SPAN_DEGC = 5.0
"""Temperatures closer together tell no sensitivity."""
LEAST_FOR_CURVE = 4
"""Temperatures that a curvature needs: three would leave nothing to judge it by."""
SAME_DEGC = 2.0
"""Turns this close in temperature are one point: a soak."""
LEAST_PIECE_S = 5.0
"""Shortest piece beside a step [s]: loop, slew and logger have settled long before."""


def by_temperature(run: Run, plateaus: Plateaus) -> list[Plateaus]:
    """The plateaus of each temperature, those that lie within `SAME_DEGC` of a neighbour's as one."""
    if not run.temperature_columns or len(plateaus) == 0:
        return [plateaus]
    temperature = run.temperature("T")
    at = np.array([temperature[a:b].mean() for a, b in zip(plateaus.start, plateaus.stop)])
    order = np.argsort(at, kind="stable")
    group = np.empty(len(at), dtype=np.intp)
    group[order] = np.concatenate([[0], np.cumsum(np.diff(at[order]) > SAME_DEGC)])
    return [plateaus[group == number] for number in range(int(group.max()) + 1)]


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The scale factor over temperature.

    Attributes
    ----------
    ppm_per_degC, se, ci90
        eps_T, the slope at the mean of the temperatures, its standard error, and the interval that holds it
        with 90 %, by what steps in a soak differ and by what soaks miss the curve; None where nothing is left
        over.
    curvature_ppm_per_degC2
        Of a parabola; None for fewer than `LEAST_FOR_CURVE` temperatures.
    temperature, scale_factor
        One point a soak: temperature [degC] and output over input; shape (s,).
    runs
        Names of the runs that tell it.
    """

    ppm_per_degC: float
    se: float | None
    ci90: tuple[float, float] | None
    curvature_ppm_per_degC2: float | None
    temperature: FloatArray
    scale_factor: FloatArray
    runs: tuple[str, ...]


def temperature_sensitivity(runs: Sequence[Run], least_deg_h: float, most_deg_h: float) -> Sensitivity | None:
    """From the steps of the table's rate; None where the temperatures span too little.

    A step is taken between pieces just beside it, so that a drifting bias drops out, and the two senses of a
    rate may differ in their scale factors. Of runs that hold temperatures apart by themselves, where there
    are such: one at a single temperature turns at rates of its own, of which nonlinearity makes another
    scale factor. Of all together where there are none.

    Parameters
    ----------
    runs
        The runs.
    least_deg_h
        Steps smaller than that tell little [deg/h].
    most_deg_h
        The greatest rate that the output follows [deg/h].
    """
    parts = [(run.name, _steps(run, least_deg_h, most_deg_h)) for run in runs if run.temperature_columns]
    for place, (_, part) in enumerate(parts):
        # Rows of other runs are others.
        part[:, 4:] += place * max(map(len, runs))
    parts = [(name, part) for name, part in parts if len(part)]
    parts = [(name, part) for name, part in parts if _apart(part)] or parts
    steps = np.concatenate([np.empty((0, 8)), *(part for _, part in parts)])
    if not _apart(steps):
        return None
    soaks = _soaks(steps)
    x, y = soaks.temperature, soaks.scale
    columns = 3 if len(x) >= LEAST_FOR_CURVE else 2
    off = x - x.mean()
    matrix = np.column_stack([np.ones(len(x)), off, off**2 - np.mean(off**2)])[:, :columns]
    inverse = np.linalg.pinv(matrix)
    solved = inverse @ y
    both = (soaks.variance, np.full(len(x), soaks.variance.mean()))
    found = spread_of(inverse[1], matrix, y, both, squares=soaks.squares, freedom=soaks.freedom)
    slope, se, ends = 1e6 * float(solved[1] / solved[0]), None, None
    if found is not None:
        se, half = (1e6 * part / abs(float(solved[0])) for part in (found.se, found.half_width))
        ends = (slope - half, slope + half)
    curve = 1e6 * float(solved[2] / solved[0]) if columns == 3 else None
    return Sensitivity(slope, se, ends, curve, x, y, tuple(name for name, _ in parts))


def _apart(steps: FloatArray) -> bool:
    return len(steps) > 0 and bool(np.ptp(steps[:, 0]) >= LEAST_SPAN_DEGC)


def _steps(run: Run, least: float, most: float) -> FloatArray:
    """Temperature [degC], steps of rate, its size and output [deg/h], and rows, as columns, shape (k, 8).

    The rows are [first, stop) of the pieces before and after a step.
    """
    steps = find_steps(run, np.ones(len(run), dtype=np.bool_))
    if steps is None:
        return np.empty((0, 8))
    time = run.time[steps.usable]
    lasting = [time[rows[:, 1] - 1] - time[rows[:, 0]] for rows in (steps.before, steps.after)]
    told = (np.abs(steps.levels).max(axis=1) <= most * (1.0 + 1e-9)) & (np.abs(steps.height) >= least)
    told &= np.minimum(*lasting) >= LEAST_PIECE_S
    temperature = run.temperature("T")[steps.usable[steps.after[:, 0]]]
    sizes = np.diff(np.abs(steps.levels), axis=1)[:, 0]
    values = (temperature, steps.height, sizes, steps.of(run.gyro_deg_h), steps.before, steps.after)
    return np.column_stack(values)[told]


def _covariance(before: FloatArray, after: FloatArray) -> FloatArray:
    """Of steps between means over rows of white noise of one [1], shape (k, k).

    Neighbouring steps share the plateau between them: what it is off raises one and lowers the other.
    """
    rows = np.concatenate((after, before))
    sign = np.repeat((1.0, -1.0), len(after)) / np.diff(rows, axis=1)[:, 0]
    first, stop = rows.T
    shared = np.minimum.outer(stop, stop) - np.maximum.outer(first, first)
    pieces = np.outer(sign, sign) * np.maximum(shared, 0.0)
    half = len(after)
    return np.asarray(
        pieces[:half, :half] + pieces[half:, half:] + pieces[:half, half:] + pieces[half:, :half]
    )


@dataclass(frozen=True, eq=False)
class _Soaks:
    """Temperature [degC], scale factor, and its variance in that of a row [1/(deg/h)^2], shape (s,).

    ``squares`` [(deg/h)^2] and ``freedom`` are what steps differ by within soaks, as of independent rows.
    """

    temperature: FloatArray
    scale: FloatArray
    variance: FloatArray
    squares: float
    freedom: float


def _soaks(steps: FloatArray) -> _Soaks:
    """Scale factor of the steps of each temperature.

    Soaks that turned both ways tell it apart from an asymmetry, and where they are apart in temperature they
    alone count; otherwise it is that of the sense turned.
    """
    steps = steps[np.argsort(steps[:, 0])]
    groups = np.split(steps, np.flatnonzero(np.diff(steps[:, 0]) > SAME_DEGC) + 1)
    # Of a rate that was measured, the two columns are alike but for what it is off.
    both = [g for g in groups if np.linalg.matrix_rank(g[:, 1:3], SAME_SHARE * np.linalg.norm(g[:, 1:3])) > 1]
    columns = slice(1, 3) if both and _apart(np.concatenate(both)) else slice(1, 2)
    told, over, squares, expected, scatter = [], 0, 0.0, 0.0, 0.0
    for group in both if columns.stop == 3 else groups:
        inverse = np.linalg.pinv(group[:, columns])
        solved = inverse @ group[:, 3]
        left = group[:, 3] - group[:, columns] @ solved
        covariance = _covariance(group[:, 4:6], group[:, 6:8])
        # What is left is no simple chi-square: one of the same mean and variance (F. E. Satterthwaite,
        # Biometrics Bulletin 2 (1946) 110).
        spread = covariance - group[:, columns] @ (inverse @ covariance)
        over += len(group) - len(solved)
        squares += float(left @ left)
        expected += float(np.trace(spread))
        scatter += float(np.sum(spread * spread.T))
        told.append(
            (float(group[:, 0].mean()), float(solved[0]), float(inverse[0] @ covariance @ inverse[0]))
        )
    temperature, scale, variances = np.array(told).T
    if not over:
        return _Soaks(temperature, scale, variances, 0.0, 0.0)
    return _Soaks(temperature, scale, variances, squares * expected / scatter, expected**2 / scatter)
