"""Scale factor error from the turns of a rate table.

Between two neighbouring plateaus of the table's rate the output steps by ``K * step in rate``.
Steps are taken between equally long pieces beside the transition, so a bias that drifts slowly
cancels, and wholly so over a turn one way and back.

Scale factor nonlinearity and asymmetry from a ladder of table rates.

The steps between neighbouring plateaus give the output at each rate above that at rest, by least
squares over all of them, so a bias that drifts steadily cancels over a way up and back. A line
through these outputs gives the nonlinearity, slopes of either sense the asymmetry
(IEEE Std 952, IEEE Std 1431).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.runs.run import Run
from fogml.runs.transitions import find_transitions, transition_mask
from fogml.runs.turning import least_rate_deg_s
from fogml.signals.clock import gap_starts, longest_gap_s
from fogml.signals.distributions import student_ppf

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


LEAST_SHARE = 0.02
"""Turns smaller than this share of the run's greatest tell little of it but noise, each for itself."""
LONGEST_PIECE_S = 60.0
"""Longest piece beside a transition [s]: long enough to average, short enough for a moving bias."""


@dataclass(frozen=True)
class Steps:
    """Steps of the table's rate in a run: k steps, and the rows on both sides of each.

    Attributes
    ----------
    before, after
        Row ranges [start, stop) among the usable rows, shape (k, 2).
    levels
        Reference rate on both sides [deg/h], shape (k, 2).
    turn
        Which turn (from rest to rest) each step belongs to, shape (k,).
    usable
        Indices of the usable rows, shape (m,).
    rest
        Rates below this are rest [deg/h].
    """

    before: IndexArray
    after: IndexArray
    levels: FloatArray
    turn: IndexArray
    usable: IndexArray
    rest: float = 0.0

    def __len__(self) -> int:
        return len(self.levels)

    @property
    def height(self) -> FloatArray:
        """Step of the reference rate [deg/h], shape (k,)."""
        return np.asarray(self.levels[:, 1] - self.levels[:, 0])

    @property
    def large(self) -> BoolArray:
        """Which steps belong to turns of some size, `LEAST_SHARE` of the greatest step; shape (k,)."""
        size = np.abs(self.height)
        _, member = np.unique(self.turn, return_inverse=True)
        greatest = np.zeros(member.max() + 1)
        np.maximum.at(greatest, member, size)
        return np.asarray((greatest >= LEAST_SHARE * size.max())[member])

    def of(self, error_deg_h: FloatArray) -> FloatArray:
        """Steps of the whole run's error series [deg/h], shape (k,)."""
        values = error_deg_h[self.usable]
        sums = np.concatenate(([0.0], np.cumsum(values - values.mean())))

        def mean(rows: IndexArray) -> FloatArray:
            return np.asarray((sums[rows[:, 1]] - sums[rows[:, 0]]) / (rows[:, 1] - rows[:, 0]))

        return mean(self.after) - mean(self.before)


@dataclass(frozen=True)
class ScaleFactorError:
    """Scale factor error [ppm]: by least squares over all steps, and the greatest of single turns.

    The greatest is that of the turns of some size; `left_out` is how many others there are. `se` is the
    standard error of the first by what the turns scatter about it, and `half_width` that of its 90 % interval
    [ppm], by Student's t, as few turns tell little of their scatter; None for one turn.
    """

    overall: float
    largest: float
    left_out: int = 0
    se: float | None = None
    half_width: float | None = None


def find_steps(run: Run, full: BoolArray) -> Steps | None:
    """The steps of the table's rate with usable rows on both sides, None if the table never turned.

    Usable are rows outside the transitions.

    Parameters
    ----------
    full
        Rows whose windows are full, shape (n,).
    """
    if "rate" not in run.columns:
        return None
    transitions = find_transitions(run)
    if len(transitions) == 0:
        return None
    usable = np.flatnonzero(full & ~transition_mask(run))
    # Ramps of the table give several transitions with no usable row between: those plateaus are
    # empty and fall out here.
    # Rows that are lost at random part no piece, as they part no window of averages.
    gaps = gap_starts(run.time, run.sample_s, longest_gap_s(LONGEST_PIECE_S, run.sample_s))
    cuts = np.union1d(transitions, gaps)
    edges = np.unique(np.searchsorted(usable, cuts))
    edges = np.concatenate(([0], edges[(edges > 0) & (edges < len(usable))], [len(usable)]))
    if len(edges) < 3:
        return None
    time = run.time[usable]
    reference = 3600.0 * run.rate[usable]
    gap_before = np.isin(edges[1:-1], np.searchsorted(usable, gaps))
    means = np.add.reduceat(reference, edges[:-1]) / np.diff(edges)
    before, after, levels, at_rest = [], [], [], []
    # The table is at rest, or turns: every level that differs from the one before counts, however slow.
    least = 3600.0 * least_rate_deg_s(run)
    resting = np.abs(means) < least
    for i in np.flatnonzero((np.abs(np.diff(means)) > least) & ~gap_before):
        start, middle, stop = edges[i], edges[i + 1], edges[i + 2]
        length = min(LONGEST_PIECE_S, time[middle - 1] - time[start], time[stop - 1] - time[middle])
        first = int(np.searchsorted(time, time[middle - 1] - length))
        last = int(np.searchsorted(time, time[middle] + length, side="right"))
        before.append((first, middle))
        after.append((middle, last))
        levels.append((reference[first:middle].mean(), reference[middle:last].mean()))
        at_rest.append(bool(resting[i]))
    if not levels:
        return None
    turn = np.cumsum(np.array(at_rest, dtype=np.intp))
    pairs = [np.array(rows, dtype=np.intp).reshape(-1, 2) for rows in (before, after)]
    return Steps(pairs[0], pairs[1], np.array(levels), turn, usable, least)


def scale_factor_error(steps: Steps, error_deg_h: FloatArray) -> ScaleFactorError:
    """Scale factor error ``K - 1`` [ppm] from the steps of an error series.

    Parameters
    ----------
    error_deg_h
        Output less reference rate [deg/h], shape (n,): the whole run's.
    """
    products = steps.of(error_deg_h) * steps.height
    squares = steps.height**2
    turns, member = np.unique(steps.turn, return_inverse=True)
    weight = np.asarray(np.bincount(member, squares, len(turns)), dtype=np.float64)
    each = np.bincount(member, products, len(turns)) / weight
    large = np.bincount(member, steps.large, len(turns)) > 0
    overall = float(products.sum() / squares.sum())
    se, half_width = _spread(each - overall, weight)
    return ScaleFactorError(
        overall=1e6 * overall,
        largest=float(1e6 * np.abs(each[large]).max()),
        left_out=int((~large).sum()),
        se=se,
        half_width=half_width,
    )


def _spread(off: FloatArray, weight: FloatArray) -> tuple[float, float] | tuple[None, None]:
    """Standard error of a weighted mean of turns that are `off` it, and its 90 % half-width [ppm].

    A turn is one, as its steps share pieces. It pulls at the mean that it is off, by its weight (HC2:
    MacKinnon & White, Journal of Econometrics 29, 1985): of a ladder by decades the greatest is hardly off at
    all. So the interval holds where steps scatter by their noise; where one turn weighs most, nothing tells
    by how much its own scale factor moves from turn to turn.
    """
    if len(off) < 2:
        return None, None
    scattered = off**2 / (1.0 - weight / weight.sum())
    se = float(1e6 * np.sqrt(weight**2 @ scattered) / weight.sum())
    # Turns that weigh little add little to what is known of the scatter.
    squares = weight**2
    freedom = max(float(squares.sum() ** 2 / (squares @ squares)) - 1.0, 1.0)
    return se, se * float(student_ppf(0.95, freedom))
