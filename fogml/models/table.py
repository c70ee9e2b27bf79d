"""Training rows: features and error of the gyro, of windows that count, turntable transitions cut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.models.folds import dealt_blocks
from fogml.numerals import number_text, percent
from fogml.runs.run import Run
from fogml.runs.transitions import transition_mask
from fogml.runs.turning import turning
from fogml.signals.averages import block_averages, window_means
from fogml.signals.clock import gap_starts, longest_gap_s, needed_s

Compose = Callable[[FloatArray], FloatArray]
"""Gives the columns of a model, shape (m, k), from rows of atom values, shape (m, a)."""
_COMPOSED_VALUES = 1 << 19
# Values composed at once while averaging: 4 MiB, which stays in the cache.


@dataclass(frozen=True)
class TrainingTable:
    """Training rows in time order, run after run.

    Attributes
    ----------
    X
        Features, shape (n, k).
    y
        Error of the gyro [deg/h], shape (n,).
    run_index
        Which of the runs each row is of, shape (n,).
    time_s
        Time on that run's clock [s], shape (n,).
    block
        Number of the block of time that a row falls in, shape (n,). Each run is parted into 20
        blocks of neighbouring rows; numbers go on from run to run. Blocks, never single rows,
        are what cross-validation and early stopping hold out.
    averaging_s
        Time that a row stands for [s]: of an average, or between samples.
    notes
        What was left out, for the model's card.
    """

    X: FloatArray
    y: FloatArray
    run_index: IndexArray
    time_s: FloatArray
    block: IndexArray
    averaging_s: float = 0.0
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.y)

    def take(self, rows: IndexArray | BoolArray) -> TrainingTable:
        """The table's rows at indices, or where a mask is True."""
        return replace(
            self,
            X=self.X[rows],
            y=self.y[rows],
            run_index=self.run_index[rows],
            time_s=self.time_s[rows],
            block=self.block[rows],
        )


@dataclass(frozen=True)
class RunRows:
    """The training rows of one run, features not yet composed from their atoms.

    ``atoms`` has shape (m, a), ``y`` [deg/h] and ``time_s`` [s] shape (m,); ``notes`` say what was left out.
    """

    atoms: FloatArray
    y: FloatArray
    time_s: FloatArray
    notes: tuple[str, ...] = ()

    @cached_property
    def interval_s(self) -> float:
        """Median time from row to row [s]; a second of a single one."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 1.0


def training_table(runs: Sequence[Run], features: Features, max_rows: int | None = None) -> TrainingTable:
    """Training rows of runs, averaged over blocks of time down to `max_rows` where that is stated.

    Raises
    ------
    InputError
        If no row has a full window.
    """
    rows = [run_rows(run, features) for run in runs]
    return table_of_rows(rows, features.compose, max_rows)


def run_rows(run: Run, features: Features) -> RunRows:
    """The rows of a run that models are fitted to.

    Left out are rows whose windows don't count yet or fill anew after a gap, rows about changes of the
    table's rate, and, where a run both stands and turns, rows at which the table turns: the error there is
    mostly the scale factor's, 10 ppm of 10 deg/s being 0.36 deg/h, and a drift model does not know the rate.
    """
    atoms, full, _ = features.atom_values(run)
    whole, filling = without_refilling(run, features, full)
    used, notes = usable_rows(run, whole)
    first, stop = _ends(used)
    if used[first:stop].all():
        # All rows but some at the ends: views will do.
        rows: slice | BoolArray = slice(first, stop)
    else:
        rows = used
    return RunRows(atoms[rows], run.error_deg_h[rows], run.time[rows], (*filling, *notes))


def without_refilling(
    run: Run, features: Features, full: BoolArray, *, most: float = 0.5
) -> tuple[BoolArray, tuple[str, ...]]:
    """Rows that count, those apart whose windows fill anew after a gap, and what was left out and why.

    A rate that a window tells in part is an error in the columns, which pulls at the rate's coefficient and
    is in no standard error. What fills at the begin of a run is little beside it, and stays.

    Parameters
    ----------
    run
        The run.
    features
        Whose windows.
    full
        Where windows hold enough to count, shape (n,).
    most
        Share of the rows that count from on which those that fill are kept all the same: there are no others.
    """
    edges = np.zeros(len(run) + 1, dtype=np.int64)
    for window in {atom.window for atom in features.atoms if atom.window is not None}:
        starts = gap_starts(run.time, run.sample_s, longest_gap_s(window.length_s, run.sample_s))
        told_s = run.time[starts] + max(needed_s(window.span_s, run.sample_s), 0.0)
        np.add.at(edges, starts, 1)
        np.add.at(edges, np.searchsorted(run.time, told_s), -1)
    filling = full & (np.cumsum(edges[:-1]) > 0)
    count = int(np.count_nonzero(filling))
    if count == 0:
        return full, ()
    share = count / int(np.count_nonzero(full))
    told = f"{run.name}: {count} rows in which windows fill anew after gaps"
    if share > most:
        return full, (
            f"{told}, {percent(share, 0)} of all, are in the fit: they pull at coefficients of rates, "
            f"which no standard error holds; lose fewer samples, or take wider windows than "
            f"{number_text(max(a.window.length_s for a in features.atoms if a.window is not None))} s",
        )
    return full & ~filling, (f"{told} left out",)


def _ends(used: BoolArray) -> tuple[int, int]:
    """First used row, and one past the last; (0, 0) if there is none."""
    if not used.any():
        return 0, 0
    return int(np.argmax(used)), len(used) - int(np.argmax(used[::-1]))


def usable_rows(run: Run, full: BoolArray) -> tuple[BoolArray, tuple[str, ...]]:
    """Mask of the rows that drift models are fitted to, and what was left out and why."""
    if "rate" not in run.columns or not run.rate.any():
        return full, ()
    moving = turning(run)
    cut = transition_mask(run)
    used = full & ~cut
    notes = []
    if cut.any():
        notes.append(f"{run.name}: {int(cut.sum())} rows about changes of the table's rate left out")
    if (used & ~moving).any() and (used & moving).any():
        notes.append(
            f"{run.name}: {int((used & moving).sum())} rows at which the table turns left out; "
            "the joint model uses them"
        )
        used &= ~moving
    return used, tuple(notes)


def table_of_rows(rows: Sequence[RunRows], compose: Compose, max_rows: int | None = None) -> TrainingTable:
    """The table of rows that `run_rows` gave."""
    if max_rows is not None and not (isinstance(max_rows, int | np.integer) and max_rows >= 2):
        raise InputError(f"max_rows is {max_rows}; a whole number of 2 or above, or None, is needed")
    count = row_count(rows)
    averaging_s = 0.0
    if max_rows is not None and count > max_rows:
        averaging_s = averaging_of(rows, recorded_s(rows) / max_rows)
    return averaged_table(rows, compose, averaging_s)


def averaged_table(rows: Sequence[RunRows], compose: Compose, averaging_s: float) -> TrainingTable:
    """The table of rows averaged over `averaging_s` seconds; 0 leaves them as they are."""
    X, y, time_s, index, block = [], [], [], [], []
    first_block = 0
    for number, part in enumerate(rows):
        if averaging_s > 0.0:
            columns, target, time = _averages(part, compose, averaging_s)
        else:
            columns, target, time = compose(part.atoms), part.y, part.time_s
        X.append(columns)
        y.append(target)
        time_s.append(time)
        index.append(np.full(len(target), number, dtype=np.intp))
        block.append(dealt_blocks(len(target)) + first_block)
        if len(target):
            first_block = int(block[-1][-1]) + 1
    return TrainingTable(
        np.concatenate(X),
        np.concatenate(y),
        np.concatenate(index),
        np.concatenate(time_s),
        np.concatenate(block),
        averaging_s if averaging_s > 0.0 else longest_interval_s(rows),
        tuple(note for part in rows for note in part.notes),
    )


def row_count(rows: Sequence[RunRows]) -> int:
    """Number of training rows."""
    count = sum(len(part.y) for part in rows)
    if count == 0:
        raise InputError(
            "no training row holds an eighth of a feature window; give longer runs, or state shorter windows "
            "in the features, e.g. dT[block, 16 s]"
        )
    return count


def recorded_s(rows: Sequence[RunRows]) -> float:
    """Time that the rows stand for [s]: their number times the median interval, run by run."""
    return float(sum(len(part.y) * part.interval_s for part in rows))


def averaging_of(rows: Sequence[RunRows], least_s: float) -> float:
    """An averaging time of at least `least_s` whose averages hold most rows [s]; longer for bursts of rows.

    An average is dropped where its window is less than half full, as between the length of a burst and that
    of the gaps between bursts.
    """
    count, averaging_s = sum(len(part.y) for part in rows), least_s
    longest_s = max((float(np.ptp(part.time_s)) for part in rows if len(part.y)), default=0.0)
    while averaging_s < longest_s:
        means = [block_averages(part.time_s, window_s=averaging_s) for part in rows]
        if 2 * sum(int(each.counts.sum()) for each in means) >= count:
            return averaging_s
        averaging_s *= 2.0
    return least_s


def longest_interval_s(rows: Sequence[RunRows]) -> float:
    """Longest of the runs' median intervals between rows [s]."""
    return max(part.interval_s for part in rows)


def _averages(
    part: RunRows, compose: Compose, averaging_s: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Averages of the composed features, of y and of time, over windows at least half full.

    The features are averaged, not their atoms: the mean of T**2 is not the square of the mean.
    """
    means = block_averages(part.time_s, part.y, window_s=averaging_s)
    width = compose(part.atoms[:1]).shape[1]
    if len(means) == 0:
        return np.empty((0, width)), np.empty(0), np.empty(0)
    per_piece = max(1, _COMPOSED_VALUES // (max(1, width) * int(means.counts.max())))
    pieces = []
    for start in range(0, len(means), per_piece):
        starts, stops = means.starts[start : start + per_piece], means.stops[start : start + per_piece]
        composed = compose(part.atoms[starts[0] : stops[-1]])
        pieces.append(window_means(composed, starts - starts[0], stops - starts[0]))
    return np.concatenate(pieces), means.values[0], means.time_s
