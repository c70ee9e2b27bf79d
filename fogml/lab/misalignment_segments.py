"""Rests and turns of a rate table: from marked averages, from averages in order, from samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError, counted
from fogml.lab.misalignment import TableMeasurements, determines
from fogml.lab.misalignment_states import DOCUMENT_ANGLES_DEG
from fogml.numerals import listed, short
from fogml.runs.outliers import OUTLIER_SIGMA, find_outliers
from fogml.runs.raw_table import numbered_row
from fogml.runs.run import Run
from fogml.runs.transitions import transition_mask, usual_margin_s
from fogml.runs.turning import LEAST_RATE_DEG_S, turning


@dataclass(frozen=True)
class Rows:
    """Rows of a file, each array of shape (n,): averages or samples, in the order recorded.

    ``state_angles_deg`` is the turn of states 1 to 4, clockwise as seen from +z.
    """

    source: str
    unit: str
    state: FloatArray
    tilt_deg: FloatArray
    rate_deg_s: FloatArray
    output: FloatArray
    state_angles_deg: Sequence[float] = DOCUMENT_ANGLES_DEG
    row_name: Callable[[int], str] = numbered_row


@dataclass(frozen=True)
class _Chunks:
    """Consecutive rows of one setting, each array of shape (c,).

    ``rest`` says which are rests; ``first_half`` and ``second_half`` are the means of the rows that go
    with the turn before and with the turn after, for rests.
    """

    place: IndexArray
    state: FloatArray
    tilt_deg: FloatArray
    rate_deg_s: FloatArray
    rest: BoolArray
    mean: FloatArray
    after_mean: FloatArray
    before_mean: FloatArray
    count: FloatArray


def from_marks(rows: Rows, segment: NDArray[np.str_]) -> TableMeasurements:
    """Measurements of averages that say what they are: before, turn or after.

    Where the rests carry the rate of their turn they are matched by it, elsewhere by their place.

    Raises
    ------
    InputError
        If a turn has no rest before or after it, or no rate.
    """
    turn = segment == "turn"
    if not turn.any():
        raise InputError(f"{rows.source}, column 'segment': no turn; averages while turning were expected")
    still = turn & (np.abs(rows.rate_deg_s) < LEAST_RATE_DEG_S)
    if still.any():
        row = int(np.argmax(still))
        raise InputError(
            f"{rows.source}, column 'rate', {rows.row_name(row)}: a turn at {rows.rate_deg_s[row]:g} deg/s; "
            "the table rate with its sign was expected"
        )
    keys = np.column_stack([rows.state, np.round(rows.tilt_deg, 9), np.round(rows.rate_deg_s, 12)])
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    counts = np.array(
        [np.bincount(group[segment == s], minlength=len(unique)) for s in ("before", "turn", "after")]
    )
    turned = counts[1] > 0
    if (counts[:, turned] > 0).all():
        sums = [
            np.bincount(group[segment == s], weights=rows.output[segment == s], minlength=len(unique))
            for s in ("before", "turn", "after")
        ]
        before, during, after = (
            np.asarray(total[turned] / count[turned]) for total, count in zip(sums, counts)
        )
        state, tilt, rate = unique[turned].T
        output = during - (before + after) / 2.0
        place = np.bincount(group[turn], np.flatnonzero(turn), len(unique))[turned] / counts[1][turned]
        return TableMeasurements(
            state, tilt, rate, output, rows.unit, rows.source, rows.state_angles_deg, place=place
        )
    changes = turn[1:] != turn[:-1]
    # A rest's rate, where it states one, is its turn's and no setting of its own.
    changes |= turn[1:] & turn[:-1] & (np.diff(rows.rate_deg_s) != 0.0)
    return _measured(rows, _chunks(rows, _edges(rows, changes), ~turn, segment))


def from_rates(rows: Rows) -> TableMeasurements:
    """Measurements of averages in the order recorded, rests told by a rate of zero."""
    rest = np.abs(rows.rate_deg_s) < LEAST_RATE_DEG_S
    changes = np.abs(np.diff(rows.rate_deg_s)) >= LEAST_RATE_DEG_S
    return _measured(rows, _chunks(rows, _edges(rows, changes), rest))


def from_samples(rows: Rows, time: FloatArray) -> TableMeasurements:
    """Measurements of samples: rests and turns found, changes of the rate cut, turns cut to whole ones.

    The horizontal part of the Earth rate, which goes once about in a turn, is taken off: over whole turns it
    averages to nothing only where no row is lost.

    Raises
    ------
    InputError
        If time does not increase, nothing turns, or no turn lasts until table and gyro have settled.
    """
    back = np.diff(time) <= 0.0
    if back.any():
        row = int(np.argmax(back)) + 1
        raise InputError(
            f"{rows.source}, column 'time', {rows.row_name(row)}: time goes back or repeats; it must increase"
        )
    run = Run(rows.source, {"time": time, "gyro": rows.output, "rate": rows.rate_deg_s})
    rest = ~turning(run)
    if rest.all():
        raise InputError(
            f"{rows.source}, column 'rate': the table never turns; turns both ways were expected"
        )
    setting = (np.diff(rows.state) != 0.0) | (np.diff(rows.tilt_deg) != 0.0)
    kept = ~transition_mask(run, others=np.flatnonzero(setting) + 1)
    if not (kept & ~rest).any():
        raise InputError(
            f"{rows.source}, column 'time': every turn is over before table and gyro have settled (what is "
            "about a change of rate is cut); turn for longer, or give averages with a column 'segment'"
        )
    changes = setting | (rest[1:] != rest[:-1]) | (kept[1:] != kept[:-1])
    changes |= ~rest[1:] & ~rest[:-1] & (np.sign(rows.rate_deg_s[1:]) != np.sign(rows.rate_deg_s[:-1]))
    edges = np.concatenate([[0], np.flatnonzero(changes) + 1, [len(time)]])
    first, last = edges[:-1][kept[edges[:-1]]], edges[1:][kept[edges[:-1]]]
    sample_s = run.sample_s
    level, ends = rows.output.copy(), last.copy()
    for place, start in enumerate(first.tolist()):
        ends[place], turning_part = _whole_turns(run, start, int(last[place]), sample_s)
        level[start : ends[place]] -= turning_part
    try:
        found = _measured(rows, _chunks(replace(rows, output=level), (first, ends), rest))
    except InputError:
        _check_left(rows, run, kept, rest)
        raise
    return replace(found, notes=(*found.notes, *_standing_out(rows, run, kept)))


def _standing_out(rows: Rows, run: Run, kept: BoolArray) -> Iterator[str]:
    """What is said of samples that stand out from their neighbours, of those that count."""
    outliers, sigma = find_outliers(run.gyro, run.rate)
    told = kept[outliers]
    if told.any():
        row = int(outliers[told][0])
        yield (
            f"{counted(int(told.sum()), 'sample')} of the output over {OUTLIER_SIGMA:g} robust sigma "
            f"({short(sigma[told][0], 4)} {rows.unit}) off their neighbours, the first {run.gyro[row]:.6g} "
            f"in {rows.row_name(row)}; they count in every figure: correct or remove the rows"
        )


def _check_left(rows: Rows, run: Run, kept: BoolArray, rest: BoolArray) -> None:
    """Hold that of each rest something is left beside what is cut about changes of the rate."""
    starts = np.concatenate([[0], np.flatnonzero(rest[1:] != rest[:-1]) + 1])
    gone = rest[starts] & (np.add.reduceat(kept.astype(np.intp), starts) == 0)
    if gone.any():
        first = int(starts[np.argmax(gone)])
        last = int(np.append(starts, len(kept))[np.argmax(gone) + 1]) - 1
        recorded, around = last - first + 1, run.time[max(first - 1, 0) : last + 2]
        there = round((around[-1] - around[0]) / run.sample_s) - 1
        lost = recorded < 0.8 * there
        told = f", of which {recorded} samples of about {there} are recorded" if lost else ""
        raise InputError(
            f"{rows.source}, {rows.row_name(first)}: nothing is left of the rest of "
            f"{short(run.time[last] - run.time[first], 4)} s{told}, as "
            f"{short(usual_margin_s(run))} s and more are cut before and after each change of the rate, by "
            f"the longest time that table and gyro take to settle; {'lose fewer samples, ' if lost else ''}"
            "let rests last longer, or the table accelerate faster"
        )


def _whole_turns(run: Run, first: int, last: int, sample_s: float) -> tuple[int, FloatArray | float]:
    """End of the rows that make up whole turns of the table, and what in them goes once about in a turn.

    Of a rest, and of less than one turn, all rows and nothing.
    """
    rate, time = float(np.mean(run.rate[first:last])), run.time[first:last] - run.time[first]
    if abs(rate) < LEAST_RATE_DEG_S or sample_s <= 0.0:
        return last, 0.0
    turns = np.floor((time[-1] + sample_s) * abs(rate) / 360.0 + 1e-6)
    if turns < 1.0:
        return last, 0.0
    end = first + int(np.searchsorted(time, turns * 360.0 / abs(rate) - 0.5 * sample_s))
    angle = np.radians(rate * time[: end - first])
    columns = np.column_stack([np.cos(angle), np.sin(angle)])
    output = run.gyro[first:end] - run.gyro[first:end].mean()
    sizes = np.linalg.lstsq(columns - columns.mean(axis=0), output, rcond=1e-6)[0]
    return end, np.asarray(columns @ sizes)


def _edges(rows: Rows, changes: BoolArray) -> tuple[IndexArray, IndexArray]:
    """First and end row of each stretch of one setting, with changes of state and tilt added."""
    changes = changes | (np.diff(rows.state) != 0.0) | (np.diff(rows.tilt_deg) != 0.0)
    edges = np.concatenate([[0], np.flatnonzero(changes) + 1, [len(rows.output)]])
    return edges[:-1], edges[1:]


def _chunks(
    rows: Rows,
    edges: tuple[IndexArray, IndexArray],
    rest: BoolArray,
    segment: NDArray[np.str_] | None = None,
) -> _Chunks:
    first, last = edges

    def means(values: FloatArray, weight: FloatArray) -> FloatArray:
        weighted, total = (np.concatenate([[0.0], np.cumsum(v)]) for v in (values * weight, weight))
        share = total[last] - total[first]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray((weighted[last] - weighted[first]) / share)

    level = rows.output[0]
    flat = np.ones(len(rows.output))
    mean = level + means(rows.output - level, flat)
    after = before = mean
    if segment is not None:
        # A rest between two turns may hold rows of both: 'after' the one and 'before' the other.
        told = [
            level + means(rows.output - level, (segment == s).astype(np.float64)) for s in ("after", "before")
        ]
        after, before = (np.where(np.isnan(values), mean, values) for values in told)
    return _Chunks(
        first,
        rows.state[first],
        rows.tilt_deg[first],
        means(rows.rate_deg_s, flat),
        rest[first],
        mean,
        after,
        before,
        (last - first).astype(np.float64),
    )


def _measured(rows: Rows, chunks: _Chunks) -> TableMeasurements:
    """Each turn less the mean of the rests next to it.

    A turn that lost a rest is left out where the others determine all that is asked for; with it those of its
    state and tilt that turn one way only without it, of which the part even in the rate would not cancel.
    """
    turns = np.flatnonzero(~chunks.rest)
    if len(turns) == 0:
        raise InputError(
            f"{rows.source}, column 'rate': the table never turns; turns both ways were expected"
        )
    padded = np.concatenate([[False], chunks.rest, [False]])

    def same(other: IndexArray) -> BoolArray:
        inside = np.clip(other, 0, len(chunks.rest) - 1)
        alike = (chunks.state[inside] == chunks.state[turns]) & (
            chunks.tilt_deg[inside] == chunks.tilt_deg[turns]
        )
        return np.asarray(padded[other + 1] & alike)

    has_before, has_after = same(turns - 1), same(turns + 1)
    lonely = ~(has_before & has_after)
    missing = []
    for i in np.flatnonzero(lonely):
        side = "after" if has_before[i] else "before"
        missing.append(f"no rest {side} the turn at {_turn_words(rows, chunks, int(turns[i]))}")
    kept = turns[~(lonely | _one_way(chunks, turns, lonely))]
    level = (chunks.before_mean[kept - 1] + chunks.after_mean[kept + 1]) / 2.0
    found = TableMeasurements(
        chunks.state[kept],
        chunks.tilt_deg[kept],
        chunks.rate_deg_s[kept],
        chunks.mean[kept] - level,
        rows.unit,
        rows.source,
        rows.state_angles_deg,
        place=chunks.place[kept] + 0.5 * chunks.count[kept],
    )
    if not missing:
        return found
    if not determines(found):
        raise InputError(
            f"{rows.source}: {missing[0]}; each turn needs a rest at the same state and tilt before and after"
            " it, and the other turns do not tell scale factor and misalignment"
        )
    others = len(turns) - len(kept) - len(missing)
    told = f"{len(turns) - len(kept)} of {counted(len(turns), 'turn')}"
    more = f"; with it {counted(others, 'turn')} of that state and tilt the other way" if others else ""
    return replace(found, notes=(f"{told} left out: {listed(missing)}{more}",))


def _turn_words(rows: Rows, chunks: _Chunks, turn: int) -> str:
    return (
        f"{chunks.rate_deg_s[turn]:.6g} deg/s in {rows.row_name(int(chunks.place[turn]))} (state "
        f"{chunks.state[turn]:g}, tilt {chunks.tilt_deg[turn]:g} deg)"
    )


def _one_way(chunks: _Chunks, turns: IndexArray, lost: BoolArray) -> BoolArray:
    """Turns of a state and tilt that go both ways with the lost ones and one way only without, shape (t,)."""
    setting = np.column_stack([chunks.state[turns], chunks.tilt_deg[turns]])
    _, group = np.unique(setting, axis=0, return_inverse=True)
    group, ways = group.ravel(), np.sign(chunks.rate_deg_s[turns])

    def both(chosen: BoolArray) -> BoolArray:
        there = [np.bincount(group[chosen & (ways == way)], minlength=len(turns)) > 0 for way in (-1.0, 1.0)]
        return np.asarray((there[0] & there[1])[group])

    return np.asarray(both(np.ones(len(turns), dtype=bool)) & ~both(~lost) & ~lost)
