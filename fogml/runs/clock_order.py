"""A clock that goes back or repeats: rows swapped or repeated, a counter, an hour, a restart, coarse stamps.

Each is told from the others by what the times are like once it is undone, and each has its own cure: rows are
sorted, repeats dropped, a counter unwrapped, an hour added, a recording cut into legs, stamps spread.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import counted
from fogml.runs.arrival_times import spread_stamps
from fogml.runs.findings import Finding
from fogml.signals import large

COUNTER_BITS = (16, 24, 31, 32)
"""Lengths of counters that wrap [bits]."""
TICKS_S = (1e-9, 1e-6, 1e-4, 1e-3)
"""Ticks of counters [s] beside the unit that the column states."""
FEW_REPEATS = 0.02
"""Share of rows that may show the time of the row before and still be single faults."""
_PUT_BACK = (
    (3600.0, "repaired_hour", "the clock is put back by one hour, as local time is in autumn", "hour"),
    (86_400.0, "repaired_wrap", "the time of day begins anew", "day"),
    (604_800.0, "repaired_wrap", "the time of the week begins anew", "week"),
)
"""What a clock that tells the time is put back by [s], with the code and words of what is found."""
MOST_LEGS = 100
"""Restarts from which on a clock is no clock."""
SHORTEST_LEG = 10
"""Rows that run on after a step back, from which on it is a restart and no row out of place."""
_NEAR = 3.0
_CLOSE = 0.5
_MANY_BACK = 0.1
_REGULAR = 0.9
_EVEN_TIES = 0.25


@dataclass(frozen=True)
class OrderFault:
    """One thing that is wrong with a clock: what it is, what mends it, and what is said once it is mended."""

    told: str
    cure: str
    done: Finding


@dataclass(frozen=True)
class Ordered:
    """Rows of a recording in an order of time that can be trusted.

    Attributes
    ----------
    rows
        Rows that are kept, in order; shape (m,).
    time
        Their times [s], strictly increasing within a leg; shape (m,).
    legs
        Parts of `rows` between restarts of the clock.
    faults
        What its order suffers from, in the order in which it is mended.
    hopeless
        Why the clock can't be mended; empty where it can.
    """

    rows: IndexArray
    time: FloatArray
    legs: tuple[slice, ...]
    faults: tuple[OrderFault, ...] = ()
    hopeless: str = ""


@dataclass
class _Clock:
    """Times in the file's order, with the rows they belong to."""

    rows: IndexArray
    time: FloatArray
    row_name: Callable[[int], str]
    found: list[OrderFault] = field(default_factory=list)

    def note(self, code: str, told: str, cure: str, done: str, row: int, count: int) -> None:
        finding = Finding(code, f"{told}: {done}", column="time", row=row + 1, count=count)
        self.found.append(OrderFault(told, cure, finding))

    def take(self, kept: IndexArray) -> None:
        self.rows, self.time = self.rows[kept], self.time[kept]


def in_order(
    time: FloatArray,
    columns: Mapping[str, FloatArray],
    *,
    tick_s: float = 1.0,
    row_name: Callable[[int], str] = lambda row: f"row {row + 1}",
) -> Ordered:
    """Bring rows in order of time, telling what their order suffers from.

    Parameters
    ----------
    time
        Times [s] in the file's order, shape (n,).
    columns
        All columns, each of shape (n,): rows that repeat a time are the same only if all values are.
    tick_s
        Unit of the file's clock [s], of which its counter may count.
    row_name
        Names the row at an index in messages.
    """
    clock = _Clock(large.count_up(len(time)), time, row_name)
    if np.all(time[1:] > time[:-1]):
        return Ordered(clock.rows, time, (slice(0, len(time)),))
    if float(np.ptp(time)) == 0.0:
        return Ordered(clock.rows, time, (slice(0, len(time)),), hopeless="it stands still")
    if np.all(time[1:] <= time[:-1]):
        told = "the rows stand newest first", "turns them round", "turned round"
        clock.note("repaired_order", *told, int(np.argmax(time < time[0])), len(time))
        clock.take(clock.rows[::-1])
    _unwrap(clock, tick_s)
    _add_back(clock)
    _drop_repeats(clock, columns)
    legs = _legs(clock)
    if legs is None:
        why = "it goes back in so many places that no order of the rows can be told"
        return Ordered(clock.rows, clock.time, (slice(0, len(clock.rows)),), hopeless=why)
    _spread(clock, legs)
    return Ordered(clock.rows, clock.time, tuple(legs), tuple(clock.found))


def _unwrap(clock: _Clock, tick_s: float) -> None:
    """Add a counter's length at each step back that is the counter's, as the values on both sides show."""
    time = clock.time
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0.0)
    forward = steps[steps > 0.0]
    if not len(back) or not len(forward):
        return
    usual = float(np.median(forward))
    for bits in COUNTER_BITS:
        for tick in dict.fromkeys((tick_s, *TICKS_S)):
            length = 2.0**bits * tick
            if length < 4.0 * usual:
                continue
            over = steps[back] + length
            wraps = back[(over > 0.0) & (over <= _NEAR * usual)]
            at_ends = [
                abs(time[i] - top) <= _NEAR * usual and abs(time[i + 1] - (top - length)) <= _NEAR * usual
                for i in wraps.tolist()
                for top in (length, length / 2.0)
            ]
            if len(wraps) and (any(at_ends) or len(wraps) > 1):
                clock.time = time.copy()
                for i in wraps.tolist():
                    clock.time[i + 1 :] += length
                times = "once" if len(wraps) == 1 else f"{len(wraps)} times"
                told = f"a counter of {bits} bits of {tick:g} s wraps {times}"
                clock.note("repaired_wrap", told, "unwraps it", "unwrapped", int(wraps[0]) + 1, len(wraps))
                return


def _add_back(clock: _Clock) -> None:
    """Add an hour that autumn puts back, or a day or week that ended; none where a recording begins anew."""
    time = clock.time
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0.0)
    if not len(back) or not (steps > 0.0).any():
        return
    near = _NEAR * float(np.median(steps[steps > 0.0]))
    begins = time[back + 1]
    for length, code, told, what in _PUT_BACK:
        # A recording that begins anew begins where its clock did.
        over = steps[back] + length
        sound = (over > 0.0) & (over <= near) & (np.abs(begins - time[0]) > near)
        is_one = len(back) == 1 if what == "hour" else np.all(np.abs(begins) <= near)
        if is_one and near < length and sound.all():
            clock.time = time.copy()
            for i in back.tolist():
                clock.time[i + 1 :] += length
            words = f"adds the {what} from there on", "added from there on"
            clock.note(code, told, *words, int(back[0]) + 1, len(back))
            return


def _drop_repeats(clock: _Clock, columns: Mapping[str, FloatArray]) -> None:
    """Drop rows that are the same as another in every value."""
    order = np.argsort(clock.time, kind="stable")
    time = clock.time[order]
    same = time[1:] == time[:-1]
    if not same.any():
        return
    pairs = np.flatnonzero(same)
    a, b = clock.rows[order[pairs]], clock.rows[order[pairs + 1]]
    equal = np.ones(len(pairs), dtype=bool)
    for name, values in columns.items():
        if name != "time":
            equal &= (values[a] == values[b]) | (np.isnan(values[a]) & np.isnan(values[b]))
    # Rows that lie apart may be of two legs, of which some show the same counts by chance.
    apart = np.abs(a - b) > 1
    if apart.any() and equal[apart].mean() <= _CLOSE:
        equal &= ~apart
    # Samples of one coarse stamp differ by their noise, most of them at least.
    if equal.any() and (equal.mean() > _CLOSE or not _is_coarse(clock.time)):
        _forget(clock, order[pairs[equal] + 1], "another row in every value")


def _forget(clock: _Clock, places: IndexArray, what: str) -> None:
    first = int(clock.rows[places].min())
    verb = "repeats" if len(places) == 1 else "repeat"
    told = f"{counted(len(places), 'row')} {verb} {what}, the first: {clock.row_name(first)}"
    clock.note("repaired_repeats", told, "drops the repeats", "dropped", first, len(places))
    kept = np.ones(len(clock.rows), dtype=bool)
    kept[places] = False
    clock.take(np.flatnonzero(kept))


def _legs(clock: _Clock) -> list[slice] | None:
    """Sort what is out of place and cut at restarts; None where neither tells an order."""
    time = clock.time
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0.0) + 1
    if not len(back):
        return [slice(0, len(time))]
    if _sorting_mends(time):
        _sort(clock, slice(0, len(time)), len(back), int(clock.rows[back[0]]))
        return [slice(0, len(time))]
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    cuts, greatest, start = [0], -np.inf, 0
    for i in back.tolist():
        greatest = max(greatest, float(time[start:i].max(initial=-np.inf)))
        start = i
        runs_on = i + SHORTEST_LEG >= len(time) or float(time[i : i + SHORTEST_LEG].max()) < greatest
        if greatest - time[i] > _NEAR * usual and runs_on:
            cuts.append(i)
            greatest = -np.inf
        if len(cuts) > MOST_LEGS:
            return None
    legs = [slice(a, b) for a, b in zip(cuts, [*cuts[1:], len(time)], strict=True)]
    for leg in legs:
        within = np.flatnonzero(np.diff(time[leg]) < 0.0) + 1
        if len(within):
            if not _sorting_mends(time[leg]):
                return None
            _sort(clock, leg, len(within), int(clock.rows[leg][within[0]]))
    if len(legs) > 1:
        rows = ", ".join(f"{min(clock.rows[leg]) + 1} to {max(clock.rows[leg]) + 1}" for leg in legs)
        restarts = "restarts once" if len(legs) == 2 else f"restarts {len(legs) - 1} times"
        told = f"the clock {restarts} (legs of rows {rows})"
        cure = "makes each leg a run of its own where a command takes several"
        done = f"cut into {len(legs)} legs of their own"
        clock.note("repaired_restart", told, cure, done, int(clock.rows[legs[1].start]), len(legs) - 1)
    return legs


def _sort(clock: _Clock, part: slice, count: int, row: int) -> None:
    order = part.start + np.argsort(clock.time[part], kind="stable")
    clock.rows[part] = clock.rows[order]
    clock.time = np.concatenate([clock.time[: part.start], clock.time[order], clock.time[part.stop :]])
    told = f"rows are out of place, {counted(count, 'time')}, first at {clock.row_name(row)}"
    clock.note("repaired_order", told, "sorts the rows", "sorted", row, count)


def _sorting_mends(time: FloatArray) -> bool:
    """Whether sorting fills the holes that rows out of place left, instead of mixing two clocks.

    Two clocks mixed leave intervals far shorter than those of either, about one for every row of the
    time that both cover; rows out of place leave none.
    """
    steps = np.diff(time)
    ordered = np.diff(np.sort(time))
    forward = steps[steps > 0.0]
    if not len(forward):
        return bool(np.all(ordered > 0.0))
    usual = float(np.median(forward))
    if np.count_nonzero(steps < 0.0) > _MANY_BACK * len(steps):
        # So many rows are out of place that their steps tell no interval.
        usual = float(np.median(ordered))
        return float(np.mean(np.abs(ordered - usual) <= _CLOSE * usual)) >= _REGULAR
    short = np.count_nonzero(ordered < _CLOSE * usual) - np.count_nonzero(forward < _CLOSE * usual)
    short -= np.count_nonzero(steps == 0.0)
    displaced = np.count_nonzero(time[1:] < np.maximum.accumulate(time)[:-1])
    # A leg that lies by itself leaves a gap between the legs that was none.
    gaps = np.count_nonzero(ordered > _NEAR * usual) - np.count_nonzero(forward > _NEAR * usual)
    return bool(gaps <= 0 and short <= max(_CLOSE * displaced, 2 * np.count_nonzero(steps < 0.0)))


def most_repeats(rows: int) -> float:
    """Rows that may repeat a time and still be single faults."""
    return max(2.0, FEW_REPEATS * rows)


def _is_coarse(time: FloatArray) -> bool:
    """Whether times repeat as those of a clock with too long a step do: often, or as evenly as a beat."""
    ties = np.flatnonzero(time[1:] == time[:-1])
    if len(ties) > most_repeats(len(time)):
        return bool(np.all(time[1:] >= time[:-1]))
    apart = np.diff(ties)
    return len(apart) >= 4 and float(np.ptp(apart)) <= _EVEN_TIES * float(np.mean(apart))


def _spread(clock: _Clock, legs: list[slice]) -> None:
    """Spread the samples of coarse stamps; drop the few that repeat a time of a clock that isn't coarse."""
    ties = [_ties(clock.time[leg]) + leg.start for leg in legs]
    found = np.concatenate(ties)
    if not len(found):
        return
    if not any(_is_coarse(clock.time[leg]) for leg in legs) and len(found) <= most_repeats(len(clock.time)):
        _forget(clock, found, "a time")
        lost = [len(t) for t in ties]
        edges = np.cumsum([0, *(leg.stop - leg.start - n for leg, n in zip(legs, lost, strict=True))])
        legs[:] = [slice(int(a), int(b)) for a, b in pairwise(edges.tolist())]
        return
    words = ""
    time = clock.time.copy()
    for leg in legs:
        time[leg], words = spread_stamps(time[leg])
    clock.time = time
    show = "row shows" if len(found) == 1 else "rows show"
    told = f"{len(found)} {show} the time of the row before, as the clock's step is longer than a sample"
    row = int(clock.rows[found[0]])
    clock.note("repaired_stamps", told, "spreads the samples evenly", words, row, len(found))


def _ties(time: FloatArray) -> IndexArray:
    return np.flatnonzero(time[1:] == time[:-1]) + 1
