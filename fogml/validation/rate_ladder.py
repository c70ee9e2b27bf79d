"""Scale factor nonlinearity and asymmetry from a ladder of table rates.

The steps between neighbouring plateaus give the output at each rate above that at rest, by least
squares over all of them, so a bias that drifts steadily cancels over a way up and back. A line
through these outputs gives the nonlinearity, slopes of either sense the asymmetry
(IEEE Std 952, IEEE Std 1431).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.validation.scale_factor import Steps

SAME_SHARE = 1e-3
"""Share of a rate by which a table misses it from one time to the next, at most."""
LEAST_LEVELS = 4
"""A line through fewer outputs leaves nothing that could be called nonlinearity."""


@dataclass(frozen=True)
class RateLadder:
    """Levels of the table's rate in a run.

    Attributes
    ----------
    rates
        Reference rate of each level [deg/h], ascending, shape (l,).
    sides
        Level on both sides of each step, shape (k, 2).
    rest
        Which level is rest; None where the table never rests.
    """

    rates: FloatArray
    sides: IndexArray
    rest: int | None


@dataclass(frozen=True)
class LadderFigures:
    """Nonlinearity and asymmetry of the scale factor [ppm]; None where the ladder does not tell."""

    nonlinearity: float | None
    asymmetry: float | None


def find_ladder(steps: Steps) -> RateLadder | None:
    """The levels that steps go between; None where they don't hang together, as after a gap.

    Rates that a table's own error may set apart, `SAME_SHARE` of them, are one level, as are those within
    half of what counts as rest. Rest is the table at rest.
    """
    values = steps.levels.ravel()
    order = np.argsort(values, kind="stable")
    sorted_values = values[order]
    sizes = np.maximum(np.abs(sorted_values[1:]), np.abs(sorted_values[:-1]))
    apart = np.diff(sorted_values) > np.maximum(0.5 * steps.rest, SAME_SHARE * sizes)
    labels = np.empty(len(values), dtype=np.intp)
    labels[order] = np.concatenate(([0], np.cumsum(apart)))
    rates = np.bincount(labels, values) / np.bincount(labels)
    sides = labels.reshape(-1, 2)
    if np.linalg.matrix_rank(_incidence(sides, len(rates))) < len(rates) - 1:
        return None
    rest = int(np.argmin(np.abs(rates)))
    return RateLadder(rates, sides, rest if abs(rates[rest]) < steps.rest else None)


def ladder_figures(ladder: RateLadder, steps_of_error: FloatArray) -> LadderFigures:
    """Nonlinearity and asymmetry of an output.

    Nonlinearity is the greatest deviation of the outputs from the least-squares line through
    them, as a share of the largest; asymmetry is ``|K+ - K-| / K``, each slope from rest.

    Parameters
    ----------
    steps_of_error
        Steps of the output less the reference rate [deg/h], shape (k,), as `Steps.of` gives them.
    """
    base = 0 if ladder.rest is None else ladder.rest
    others = np.delete(np.arange(len(ladder.rates)), base)
    error = np.zeros(len(ladder.rates))
    matrix = _incidence(ladder.sides, len(ladder.rates))[:, others]
    error[others] = np.linalg.lstsq(matrix, steps_of_error, rcond=None)[0]
    output = ladder.rates + error
    return LadderFigures(nonlinearity_ppm(ladder.rates, output), _asymmetry(ladder, output))


def nonlinearity_ppm(rates: FloatArray, output: FloatArray) -> float | None:
    """Greatest deviation of outputs from the line through them, over the largest [ppm]; None below 4.

    Parameters
    ----------
    rates, output
        Of each level [deg/h], shape (l,); outputs above that at rest.
    """
    if len(rates) < LEAST_LEVELS:
        return None
    line = np.column_stack((np.ones(len(rates)), rates / np.abs(rates).max()))
    deviation = output - line @ np.linalg.lstsq(line, output, rcond=None)[0]
    return float(1e6 * np.abs(deviation).max() / np.abs(output).max())


def _asymmetry(ladder: RateLadder, output: FloatArray) -> float | None:
    if ladder.rest is None or ladder.rest in (0, len(ladder.rates) - 1):
        return None
    # Both from the level at rest, whose own rate may be a little off 0.
    rates, above = ladder.rates - ladder.rates[ladder.rest], output - output[ladder.rest]
    slopes = [
        float(rates[part] @ above[part] / (rates[part] @ rates[part]))
        for part in (slice(None, ladder.rest), slice(ladder.rest + 1, None))
    ]
    return abs(slopes[1] - slopes[0]) / (0.5 * abs(slopes[0] + slopes[1])) * 1e6


def _incidence(sides: IndexArray, levels: int) -> FloatArray:
    """One row per step, -1 at the level it leaves and 1 at the one it reaches, shape (k, l)."""
    matrix = np.zeros((len(sides), levels))
    rows = np.arange(len(sides))
    np.add.at(matrix, (rows, sides[:, 0]), -1.0)
    np.add.at(matrix, (rows, sides[:, 1]), 1.0)
    return matrix
