"""Changes of the table's rate: where they are, how long they last, which samples they spoil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.runs.settling import LEAST_ROWS, SHARE, unsettled_rows
from fogml.runs.turning import least_rate_deg_s, white_noise
from fogml.signals import large

MARGIN_BEYOND_S = 2.5
"""The margin is this much longer than the time to rate, which the source bounds by 5 s."""
LEAST_GYRO_STEP_DEG_S = 0.1
"""Steps of the gyro smaller than this are not taken for turns of a table [deg/s]."""
LONGEST_TRANSITION_S = 60.0
"""A rate that changes for longer is a profile of its own, not a transition [s]."""
_LATE_SHARE = 1e-3
"""Share of a step that another rate has made of a few rows, at least, where the recorded one is late: less is
the wander of a bias, as only a change within a two hundredth of a row makes as little of a lateness."""
_LAG_S = 1.0
_PLATEAU_S = 3.0
_RATE_NOISES, _GYRO_NOISES = 8.0, 20.0


@dataclass(frozen=True)
class _Changes:
    """Changes of a series of plateaus, k of them: rows [start, stop] over which it changes."""

    start: IndexArray
    stop: IndexArray


def find_transitions(run: Run) -> IndexArray:
    """Rows at which a change of the table's rate begins, shape (k,), ascending.

    Found from the column ``rate``, a measured one too, else from steps of the gyro itself of at
    least 0.1 deg/s and twenty times its noise. A rate that changes for over a minute without a
    pause is no transition.
    """
    return _changes(run).start


def usual_margin_s(run: Run) -> float:
    """What is cut before and after changes of the table's rate at least [s].

    By `MARGIN_BEYOND_S` more than the gyro takes to settle after what is recorded of a change.
    """
    changes = _changes(run)
    return _gyro_settling_s(run, changes) + MARGIN_BEYOND_S


def transition_mask(run: Run, margin_s: float | None = None, others: IndexArray | None = None) -> BoolArray:
    """True for the samples to be cut about each change of the table's rate, shape (n,).

    Parameters
    ----------
    run
        The run.
    margin_s
        Samples within this time of a change are cut [s]; by default m = t_z + 2.5 s with t_z the
        table's time to rate beyond what is recorded of the change, within the source's bounds
        t_z < m < t_z + 5 s; after a change as long as all changes together show that gyro or table have not
        settled, before one as long as they show that these have left, the recorded rate being late.
    others
        Rows at which something else changes, as a fixture's tilt: what is after one tells nothing of how the
        change of the rate before it settles.

    Raises
    ------
    InputError
        If the margin is negative.

    Notes
    -----
    Patent CN105333888A: +-m seconds about each change are deleted. The two samples between which
    the change begins are always cut, so that slow sampling cuts too.
    """
    if margin_s is not None and not margin_s >= 0.0:
        raise InputError(
            f"the margin about a change of the table's rate must not be negative, got {margin_s:g} s"
        )
    changes, time = _changes(run), run.time
    by_default = margin_s is None
    if margin_s is None:
        settled_s, left_s = _unsettled_s(run, changes, usual_margin_s(run), others)
    else:
        settled_s = left_s = margin_s
    starts = changes.start
    first = np.searchsorted(time, time[starts] - left_s)
    last = np.searchsorted(time, time[changes.stop if by_default else starts] + settled_s, side="right")
    mask = np.zeros(len(run), dtype=np.bool_)
    for begin, end in zip(np.minimum(first, np.maximum(starts - 1, 0)), last, strict=True):
        mask[begin:end] = True
    return mask


def _changes(run: Run) -> _Changes:
    """The changes of the table's rate, found once for a run."""
    known: _Changes | None = run.__dict__.get("_transitions")
    if known is None:
        known = _find(run)
        run.__dict__["_transitions"] = known
    return known


def _find(run: Run) -> _Changes:
    if len(run) < 3:
        return _Changes(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
    if "rate" in run.columns:
        least = least_rate_deg_s(run, _RATE_NOISES)
        return _level_changes(run, run.rate, least)
    gyro = _gyro_deg_s(run)
    if gyro is None:
        return _Changes(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
    least = max(LEAST_GYRO_STEP_DEG_S, _GYRO_NOISES * _spread(gyro))
    return _lasting(run, gyro, _level_changes(run, gyro, least), least)


def _gyro_deg_s(run: Run) -> FloatArray | None:
    """The gyro as a rate [deg/s]; None for counts without a scale factor."""
    if run.gyro_unit == "count" and run.facts.scale_factor is None:
        return None
    return run.gyro_deg_h / 3600.0


def _spread(values: FloatArray) -> float:
    """Noise of one sample, that of a coarsely quantised output too, whatever its few great steps."""
    # 80 % of the differences of white noise are smaller than 1.28 sqrt(2) standard deviations.
    return float(np.quantile(np.abs(np.diff(values)), 0.8)) / 1.8124


def _level_changes(run: Run, values: FloatArray, least: float) -> _Changes:
    """Where a series moves by more than `least` within a second, single outliers left out."""
    lag = min(max(1, round(_LAG_S / run.sample_s)), len(values))
    clean = _median_of_three(values)
    moved = np.zeros(len(values) + 2, dtype=np.bool_)
    moved[1 : lag + 1] = np.abs(clean[:lag] - clean[0]) > least
    for part in large.pieces(clean, overlap=lag):
        now = slice(part.start + lag, part.stop)
        moved[now.start + 1 : now.stop + 1] = np.abs(clean[now] - clean[part.start : part.stop - lag]) > least
    edges = np.flatnonzero(moved[1:] != moved[:-1])
    # The first row that differs from the one a lag before begins the change; a lag before the
    # last such row it has ended.
    start, stop = edges[::2], edges[1::2]
    stop = np.where(stop < len(values), np.maximum(stop - lag, start), len(values) - 1)
    brief = run.time[stop] - run.time[start] <= max(LONGEST_TRANSITION_S, 3.0 * run.sample_s)
    return _Changes(start[brief], stop[brief])


def _lasting(run: Run, values: FloatArray, changes: _Changes, least: float) -> _Changes:
    """The changes that leave the series at another level, as no knock and no burst of noise does."""
    reach = max(3, round(_PLATEAU_S / run.sample_s))
    sums = np.concatenate([[0.0], np.cumsum(values - values[0])])

    def mean(first: IndexArray, end: IndexArray) -> FloatArray:
        return np.asarray((sums[end] - sums[first]) / np.maximum(end - first, 1))

    before = mean(np.maximum(changes.start - reach, 0), changes.start)
    after = mean(changes.stop, np.minimum(changes.stop + reach, len(values)))
    lasting = np.abs(after - before) > least
    return _Changes(changes.start[lasting], changes.stop[lasting])


def _median_of_three(values: FloatArray) -> FloatArray:
    made = large.empty(len(values))
    made[0], made[-1] = values[0], values[-1]
    for part in large.pieces(values, overlap=2):
        left, middle, right = (values[part.start + i : part.stop - 2 + i] for i in range(3))
        inner = np.minimum(np.maximum(left, middle), right)
        made[part.start + 1 : part.stop - 1] = np.maximum(np.minimum(left, middle), inner)
    return made


def _gyro_settling_s(run: Run, changes: _Changes, settled_share: float = 0.02, noises: float = 6.0) -> float:
    """The longest time the gyro takes to settle on its new plateau after what is recorded of a change [s].

    Until it stays within `settled_share` of the step, or so many standard deviations of its noise, about the
    new plateau. A step of less than twice that noise tells nothing. Of a table that hardly turns about the
    input axis, the share is that of the step as it is where the run's others do: what Earth rate does in a
    turn is no settling.
    """
    if len(changes.stop) == 0:
        return 0.0
    clean = _median_of_three(run.gyro)
    noise = white_noise(clean)
    edges = np.concatenate([[0], changes.start, [len(run)]])
    plateaus, steps, turns = [], [], []
    for before, start, begin, stop in zip(edges[:-2], edges[1:-1], changes.stop, edges[2:], strict=True):
        # The longest transition ends in the first half.
        limit = np.searchsorted(run.time, run.time[begin] + 2.0 * LONGEST_TRANSITION_S)
        plateau = slice(int(begin), min(int(stop), int(limit)))
        length = plateau.stop - plateau.start
        if length < LEAST_ROWS:
            continue
        earlier, later = slice(max(before, start - length), start), slice(begin + length // 2, plateau.stop)
        old, new = (float(np.median(clean[rows])) for rows in (earlier, later))
        plateaus.append((plateau, new))
        steps.append(abs(new - old))
        turns.append(abs(float(np.median(run.rate[later]) - np.median(run.rate[earlier]))))
    step, turn = np.array(steps), np.array(turns)
    if (turn > 0.0).any():
        step = np.maximum(step, turn * float(step @ turn) / float(turn @ turn))
    longest = 0.0
    for (plateau, new), own, whole in zip(plateaus, steps, step.tolist(), strict=True):
        least = max(settled_share * whole, noises * noise)
        away = np.abs(clean[plateau] - new) > least
        # A plateau that does not hold still in its second half tells no settling time.
        if own > 2.0 * least and away.any() and not away[len(away) // 2 :].any():
            last = plateau.start + int(np.flatnonzero(away)[-1])
            longest = max(longest, float(run.time[last] - run.time[plateau.start]))
    return longest


def _unsettled_s(
    run: Run, changes: _Changes, least_s: float, others: IndexArray | None = None
) -> tuple[float, float]:
    """Time after changes in which all of them together show that gyro or table have not settled, and time
    before them in which they show that these have left, as where the recorded rate comes late [s].

    `least_s` or longer; not settled, half of the shortest plateau at most that tells it.
    """
    if len(changes.start) == 0:
        return least_s, least_s
    ends = changes.start if others is None else np.union1d(changes.start, others)
    turns = np.isin(ends, changes.start)
    begins = ends.copy()
    begins[turns] = changes.stop
    edges = np.append(0, begins), np.append(ends, len(run))
    first = max(1, round(least_s / run.sample_s))
    reach = max(round(LONGEST_TRANSITION_S / run.sample_s), LEAST_ROWS, 4 * first)
    levels = _middles(run.gyro, *edges, reach)
    heights = np.where(turns, levels[1:, 0] - levels[:-1, 1], 0.0)
    share = (SHARE, _LATE_SHARE)
    settled, left = unsettled_rows(run.gyro, *edges, heights, (first, first), (reach, reach), share)
    plateaus = np.minimum(np.append(changes.start[1:], len(run)) - changes.stop, reach)
    # Where none is so long, that which tells it best.
    longest = 0.5 * float(min(plateaus[plateaus >= 4 * first], default=plateaus.max())) * run.sample_s
    settled_s = least_s if settled <= first else max(least_s, min(settled * run.sample_s, longest))
    # What another rate has made is told by no part of a plateau, however short: it may be lost altogether.
    return settled_s, max(least_s, left * run.sample_s)


def _middles(series: FloatArray, begins: IndexArray, ends: IndexArray, reach: int) -> FloatArray:
    """Means in the middle of plateaus, of their first rows and of their last, `reach` at most; (k, 2).

    A clock that is early or late by a quarter of that leaves them as they are.
    """

    def mean(first: int, last: int) -> float:
        quarter = (last - first) // 4
        return float(series[first + quarter : last - quarter].mean())

    pairs = zip(begins.tolist(), ends.tolist(), strict=True)
    return np.array([(mean(a, min(b, a + reach)), mean(max(a, b - reach), b)) for a, b in pairs])
