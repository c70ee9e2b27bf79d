"""A curve as a table of few temperatures, straight lines between them: the breakpoints that lose least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.export.static_curve import StaticCurve
from fogml.numerals import against, short

MOST_BREAKPOINTS = 64
"""A table of more is larger than the model that it stands for."""


@dataclass(frozen=True)
class Segments:
    """A table of bias and scale factor; held at its ends.

    Attributes
    ----------
    thermometer, gyro_unit
        As of the curve.
    temperature
        Breakpoints [degC], shape (k,), rising.
    bias, scale
        Values there, shape (k,); compensated is ``scale gyro - bias``.
    rms, largest
        What it is off from the curve, over the trained box: root mean square and largest, of bias and
        of scale factor at `rate_deg_s` together [deg/h].
    rate_deg_s
        Rate at which an error of scale factor counts [deg/s].
    """

    thermometer: str
    gyro_unit: str
    temperature: FloatArray
    bias: FloatArray
    scale: FloatArray
    rms: float
    largest: float
    rate_deg_s: float

    def at(self, temperature: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bias and scale at temperatures, shapes (n,)."""
        bias, scale = (np.interp(temperature, self.temperature, held) for held in (self.bias, self.scale))
        return np.asarray(bias), np.asarray(scale)


def segments(
    curve: StaticCurve, *, breakpoints: int | None = None, tolerance: float, rate_deg_s: float = 10.0
) -> Segments:
    """The table of a curve.

    Breakpoints among the curve's own temperatures come from dynamic programming over the squared errors of
    chords; their values, then the breakpoints themselves, from least squares (variable projection).

    Parameters
    ----------
    curve
        What is to be held.
    breakpoints
        How many; None: the fewest whose largest error is within `tolerance`.
    tolerance
        Largest error allowed [deg/h] where no number is asked for.
    rate_deg_s
        Rate at which an error of scale factor is weighed against one of bias [deg/s]; 10 deg/s is what
        exported scale factors are compared at.

    Raises
    ------
    InputError
        If no table of `MOST_BREAKPOINTS` is within the tolerance, or another number than
        from 2 to those is asked for.
    """
    if breakpoints is not None:
        if not 2 <= breakpoints <= MOST_BREAKPOINTS:
            raise InputError(f"{breakpoints} breakpoints; from 2 to {MOST_BREAKPOINTS} are possible")
        return _table(curve, breakpoints, rate_deg_s)
    for count in range(2, MOST_BREAKPOINTS + 1):
        found = _table(curve, count, rate_deg_s)
        if found.largest <= tolerance:
            return found
    raise InputError(
        f"export: {MOST_BREAKPOINTS} breakpoints are still off by {against(found.largest, tolerance)} deg/h, "
        f"more than {short(tolerance)} deg/h; state --tolerance or --breakpoints if that is good enough"
    )


def _table(curve: StaticCurve, count: int, rate_deg_s: float) -> Segments:
    grid = curve.temperature
    weight = 3600.0 * rate_deg_s / float(np.mean(np.abs(curve.scale)))
    wanted = np.column_stack([curve.bias, weight * curve.scale])
    knots = grid[_chords(grid, wanted, count)]
    values = _fitted(grid, wanted, knots)
    if count > 2:
        low, high = grid[0] + 0.1 * (grid[1] - grid[0]), grid[-1] - 0.1 * (grid[1] - grid[0])
        inner = least_squares(
            lambda x: _projected(grid, wanted, x)[0],
            knots[1:-1],
            lambda x: _projected(grid, wanted, x)[1],
            bounds=(low, high),
            x_scale=(grid[-1] - grid[0]) / count,
            max_nfev=20,
        ).x
        moved = _ends(inner, grid)
        again = _fitted(grid, wanted, moved)
        if _square(grid, wanted, moved, again) < _square(grid, wanted, knots, values):
            knots, values = moved, again
    off = _hats(grid, knots) @ values - wanted
    total = np.abs(off).sum(axis=1)
    return Segments(
        curve.thermometer,
        curve.gyro_unit,
        knots,
        values[:, 0],
        values[:, 1] / weight if np.ptp(curve.scale) > 0.0 else np.full(len(knots), curve.scale[0]),
        float(np.sqrt(np.mean(total**2))),
        float(total.max()),
        rate_deg_s,
    )


def _ends(inner: FloatArray, grid: FloatArray) -> FloatArray:
    """All breakpoints from the inner ones, kept apart by a hundredth of the grid's step."""
    apart = 0.01 * (grid[1] - grid[0]) * np.arange(len(inner)) / len(inner)
    return np.concatenate([[grid[0]], np.sort(inner) + apart, [grid[-1]]])


def _projected(grid: FloatArray, wanted: FloatArray, inner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What the best values leave (2 m,), and how that moves with the inner breakpoints (2 m, k - 2).

    Variable projection, with the derivative of Kaufman (BIT 15, 1975): a breakpoint that moves takes its
    hat along, on either side at the slope of the line there.
    """
    knots = _ends(inner, grid)
    basis, triangle = np.linalg.qr(_hats(grid, knots))
    seen = basis.T @ wanted
    values = np.linalg.lstsq(triangle, seen, rcond=None)[0]
    place = _places(grid, knots)
    slopes = (np.diff(values, axis=0) / np.diff(knots)[:, None])[place]
    hats = _hats(grid, knots)[:, 1:-1]
    moves = [slope[:, None] * hats for slope in slopes.T]
    moves = [basis @ (basis.T @ move) - move for move in moves]
    jacobian = np.empty((2 * len(grid), len(inner)))
    jacobian[:, np.argsort(inner, kind="stable")] = np.stack(moves, axis=1).reshape(2 * len(grid), -1)
    return (basis @ seen - wanted).ravel(), jacobian


def _places(grid: FloatArray, knots: FloatArray) -> IndexArray:
    """The line between breakpoints that each temperature is on."""
    return np.clip(np.searchsorted(knots, grid, side="right") - 1, 0, len(knots) - 2)


def _hats(grid: FloatArray, knots: FloatArray) -> FloatArray:
    """Weights of the breakpoints' values at each temperature, shape (m, k)."""
    place = _places(grid, knots)
    share = (grid - knots[place]) / (knots[place + 1] - knots[place])
    hats = np.zeros((len(grid), len(knots)))
    rows = np.arange(len(grid))
    hats[rows, place], hats[rows, place + 1] = 1.0 - share, share
    return hats


def _fitted(grid: FloatArray, wanted: FloatArray, knots: FloatArray) -> FloatArray:
    """The breakpoints' values by least squares, shape (k, 2)."""
    return np.asarray(np.linalg.lstsq(_hats(grid, knots), wanted, rcond=None)[0])


def _square(grid: FloatArray, wanted: FloatArray, knots: FloatArray, values: FloatArray) -> float:
    return float(np.sum((_hats(grid, knots) @ values - wanted) ** 2))


def _chords(grid: FloatArray, wanted: FloatArray, count: int) -> IndexArray:
    """Places of the breakpoints whose chords have the least sum of squared errors (Bellman)."""
    cost = np.sum([_chord_errors(grid, column) for column in wanted.T], axis=0)
    best, taken = cost[0], []
    for _ in range(count - 2):
        total = best[:, None] + cost
        taken.append(np.argmin(total, axis=0))
        best = np.min(total, axis=0)
    place = len(grid) - 1
    places = [place]
    for came in reversed(taken):
        place = int(came[place])
        places.append(place)
    return np.unique([0, *places])


def _chord_errors(x: FloatArray, y: FloatArray) -> FloatArray:
    """Squared error of the chord from each point to each later one, summed, (m, m); infinite backwards."""
    x, y = x - x.mean(), y - y.mean()
    sums = [np.concatenate([[0.0], np.cumsum(part)]) for part in (np.ones_like(x), x, y, x * x, x * y, y * y)]
    n, sx, sy, sxx, sxy, syy = (part[None, 1:] - part[:-1, None] for part in sums)
    run = x[None, :] - x[:, None]
    slope = np.divide(y[None, :] - y[:, None], run, out=np.zeros_like(run), where=run != 0.0)
    level = (y - slope.T * x).T  # of the chord's line at x = 0
    error = (
        syy - 2.0 * level * sy - 2.0 * slope * sxy + level**2 * n + 2.0 * level * slope * sx + slope**2 * sxx
    )
    return np.where(run > 0.0, np.maximum(error, 0.0), np.inf)
