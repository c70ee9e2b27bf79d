"""Whether a drift follows its thermometer late, as where that is not where the drift comes from.

With the thermometer's T and x its first-order lag of time constant tau, the drift of all runs is::

    y = b_r + f(x) + s f'(x) (T - x),        f a cubic, b_r a constant of each run

A drift of what follows the thermometer late goes with x alone: s is nothing. One of T itself has s near 1,
and one with a part that goes with the rate of temperature, as Shupe's, any s at all. So a lag is told only
where s is told, and nothing. One as short as the rate's windows, and a thermometer that reads late itself,
can't be told from a drift with the rate: of them nothing is said.

Rows are whitened by the noise that they speak for, of training and test runs apart, which have to agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.models.generalised_least_squares import RunsNoise, beside_constants, runs_noise
from fogml.models.table import (
    TrainingTable,
    averaged_table,
    averaging_of,
    longest_interval_s,
    recorded_s,
    run_rows,
)
from fogml.runs.run import Run
from fogml.signals.bases import lag
from fogml.signals.distributions import normal_ppf

_DEGREE = 3


@dataclass(frozen=True)
class Lag:
    """A lag of a drift behind its thermometer.

    Attributes
    ----------
    tau_s, se_s
        Time constant and its standard error [s].
    share, share_se
        What part of the drift goes with the thermometer itself, s above, and its standard error.
    """

    tau_s: float
    se_s: float
    share: float
    share_se: float


@dataclass(frozen=True)
class Asked:
    """What is asked before a lag is told.

    Attributes
    ----------
    shows
        Standard errors that the lag and, were it 1, the share are from nothing, on either set of runs: four,
        as forms that are wrong leave more than noise.
    agrees
        Standard errors within which the share is nothing, and both sets' lags are alike: normal numbers are
        further off once in 100.
    rows
        Rows that the runs are averaged to.
    """

    shows: float = 4.0
    agrees: float = 2.58
    rows: int = 720


def lag_note(train: Sequence[Run], test: Sequence[Run], asked: Asked | None = None) -> str | None:
    """The lag of the drift behind the thermometer in a sentence; None where none is told.

    Parameters
    ----------
    train, test
        Runs that were fitted to, and others.
    asked
        The defaults of `Asked` if None.
    """
    asked = asked or Asked()
    first = lag_of(train, asked.rows)
    if first is None or not _told(first, asked):
        return None
    second = lag_of(test, asked.rows)
    if second is None or not _told(second, asked):
        return None
    if abs(first.tau_s - second.tau_s) > asked.agrees * np.hypot(first.se_s, second.se_s):
        return None
    weights = np.array([first.se_s, second.se_s]) ** -2.0
    tau = float(weights @ [first.tau_s, second.tau_s] / weights.sum())
    half = normal_ppf(0.95) * float(weights.sum() ** -0.5)
    return (
        f"The drift follows T with a first-order lag of {tau:.0f} s ({tau - half:.0f} to {tau + half:.0f}, "
        "90 %), on training and test runs alike: the thermometer is warm before what drifts is. Mount one "
        f'nearer to that, or try --features "lag(T, {tau:.0f} s)^1..3".'
    )


def _told(found: Lag, asked: Asked) -> bool:
    return (
        found.tau_s > asked.shows * found.se_s
        and asked.shows * found.share_se < 1.0
        and abs(found.share) < asked.agrees * found.share_se
    )


def lag_of(runs: Sequence[Run], rows: int = Asked.rows, steps: int = 12) -> Lag | None:
    """The lag that runs speak for, by Gauss-Newton from the best of a grid; None where they tell none.

    Parameters
    ----------
    runs
        With a temperature.
    rows
        That they are averaged to.
    steps
        Greatest number of steps.
    """
    try:
        parts = [run_rows(run, parse_features("T")) for run in runs]
        averaging_s = averaging_of(parts, max(recorded_s(parts) / rows, longest_interval_s(parts)))
        table = averaged_table(parts, lambda atoms: atoms, averaging_s)
    except (InputError, ValueError):
        return None
    low, high = table.X.min(), table.X.max()
    if len(table) < 8 * (_DEGREE + len(runs)) or not high > low or not np.ptp(table.y) > 0.0:
        return None  # too short, or one of the two stands still
    table = replace(table, X=(table.X - (low + high) / 2.0) / ((high - low) / 2.0))
    longest_s = max(float(np.ptp(table.time_s[table.run_index == r])) for r in range(len(runs)))
    grid = np.geomspace(averaging_s, longest_s / 6.0, 24)
    left = [_left(table, tau) for tau in grid.tolist()]
    best = int(np.argmin(left))
    if best in (0, len(grid) - 1):
        return None
    tau, se, moved = float(grid[best]), np.inf, np.inf
    noise = _noise(table, tau)
    for step in range(steps):
        if step in (2, steps // 2):
            noise = _noise(table, tau)
        powers, bend, _ = _columns(table, tau, noise)
        found, errors = beside_constants(noise, table, np.column_stack((powers, bend)))
        se = float(errors[-1])
        moved = float(np.clip(found[-1], -tau / 2.0, tau))
        tau += moved
        if not grid[0] < tau < grid[-1]:
            return None
        if step > 2 and abs(moved) < 0.05 * se:
            break
    powers, bend, own = _columns(table, tau, noise)
    found, errors = beside_constants(noise, table, np.column_stack((powers, bend, own)))
    return Lag(tau, se, float(found[-1]), float(errors[-1]))


def _lagged(table: TrainingTable, tau_s: float) -> FloatArray:
    """Lag of T, in half spans from the middle, run by run."""
    edges = [0, *(np.flatnonzero(np.diff(table.run_index)) + 1).tolist(), len(table)]
    return np.concatenate(
        [lag(table.time_s[a:b], np.ascontiguousarray(table.X[a:b, 0]), tau_s) for a, b in pairwise(edges)]
    )


def _powers(x: FloatArray) -> FloatArray:
    return np.column_stack([x**power for power in range(1, _DEGREE + 1)])


def _columns(
    table: TrainingTable, tau_s: float, noise: RunsNoise
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Powers of x, f'(x) dx/dtau and f'(x) (T - x)."""
    x, part = _lagged(table, tau_s), 0.01
    moves = (_lagged(table, (1.0 + part) * tau_s) - _lagged(table, (1.0 - part) * tau_s)) / (
        2.0 * part * tau_s
    )
    powers = _powers(x)
    found, _ = beside_constants(noise, table, powers)
    slope = found[0] + sum(k * found[k - 1] * x ** (k - 1) for k in range(2, _DEGREE + 1))
    return powers, slope * moves, slope * (table.X[:, 0] - x)


def _noise(table: TrainingTable, tau_s: float) -> RunsNoise:
    """Noise beside powers of x and of T."""
    columns = np.column_stack((_powers(_lagged(table, tau_s)), _powers(table.X[:, 0])))
    return runs_noise(replace(table, X=columns), float(np.std(table.y)))


def _left(table: TrainingTable, tau_s: float) -> float:
    """Squares that a cubic of the lagged temperature and a constant of each run leave."""
    runs = np.equal.outer(table.run_index, np.unique(table.run_index)).astype(np.float64)
    columns = np.column_stack((runs, _powers(_lagged(table, tau_s))))
    off = table.y - columns @ np.linalg.lstsq(columns, table.y, rcond=None)[0]
    return float(off @ off)
