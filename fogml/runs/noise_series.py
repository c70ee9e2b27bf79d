"""The samples of a run that tell its noise: at rest, new, by stretches without gaps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.runs.run import Run
from fogml.runs.thermometers import thermal_columns
from fogml.runs.transitions import transition_mask
from fogml.runs.turning import turning
from fogml.signals.noise_spectrum import Rows, Spectrum, spectrum_of

REGULAR = 0.99
"""Share of changes that have to lie on the grid of a hold: the rest are lost samples."""
_FEWEST = 30
"""Changes needed to tell a hold."""
_SPREAD = 0.3
"""Greatest variance of the lengths of a hold that does not last whole samples; two lengths make 1/4."""
_TO_AND_FRO = 0.9
"""Share of changes by one step of the output from which on repeats tell no hold of no whole samples."""


@dataclass(frozen=True)
class ValueHold:
    """Samples that are new.

    Attributes
    ----------
    samples
        Mean number of samples that a value lasts; 1 where each is new.
    rows
        The first sample of each value, shape (m,); all of them where each is new.
    """

    samples: float
    rows: IndexArray


def hold_of(values: FloatArray) -> ValueHold:
    """How long each value of an evenly sampled stretch without gaps, shape (n,), is held.

    A coarse converter repeats values by chance, for a random number of samples; a hold lasts the same
    number each time, or two neighbouring numbers in turn where it is no whole number of samples.
    """
    every = ValueHold(1.0, np.arange(len(values)))
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    if len(changes) < _FEWEST or len(changes) > 0.9 * len(values):
        return every
    lengths = np.diff(changes)
    shortest = int(np.quantile(lengths, 1.0 - REGULAR, method="lower"))
    if shortest >= 2:
        # Lost samples shift the grid: lengths, not places, are asked.
        if np.mean(lengths % shortest == 0) >= REGULAR:
            return _whole(values, changes, lengths, shortest)
        if float(np.var(lengths)) > _SPREAD:
            return every
    elif float(np.var(lengths)) > _SPREAD or int(lengths.max()) > 2:
        return every
    else:
        # Counts of a quiet output go to and fro between neighbours for one sample and two, held or not.
        sizes = np.abs(values[changes] - values[changes - 1])
        if np.mean(sizes < 1.5 * sizes.min()) > _TO_AND_FRO:
            return every
    return ValueHold(float(np.mean(lengths)), changes.astype(np.intp))


def _whole(values: FloatArray, changes: IndexArray, lengths: IndexArray, samples: int) -> ValueHold:
    """New values every so many samples, those that happen to equal the one before included."""
    between = (
        [np.arange(a, b - samples // 2, samples) for a, b in zip(changes[:-1].tolist(), changes[1:].tolist())]
        if int(lengths.max(initial=0)) > samples
        else [changes[:-1]]
    )
    last = np.arange(int(changes[-1]), len(values) - samples + 1, samples)
    return ValueHold(float(samples), np.concatenate((*between, last)).astype(np.intp))


def _new_rows(values: FloatArray, samples: float) -> IndexArray:
    """The first sample of each value of a stretch, however short, of a series whose hold is known."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    if samples != round(samples):
        return changes
    if not len(changes):
        return np.arange(0, len(values) - round(samples) + 1, round(samples))
    return _whole(values, changes, np.diff(changes), round(samples)).rows


Follows = Callable[[FloatArray], FloatArray]

LOST = 1e-3
"""Share of lost samples from which the mean sample interval stands for the median."""
HOLD_ROWS = 100_000
"""Samples that are enough to tell whether a log repeats values."""


@dataclass(frozen=True)
class NoiseSeries:
    """A run's samples that count: those that are new, by stretches without gaps."""

    run: Run
    sample_s: float
    segments: list[slice]
    hold: float
    stretches: list[FloatArray]
    times: list[FloatArray]

    @property
    def new_s(self) -> float:
        """Interval between new values [s]."""
        return self.sample_s * self.hold


def series_of(run: Run) -> NoiseSeries:
    segments = stretches_at_rest(run)
    if max((part.stop - part.start for part in segments), default=0) < 3:
        turns = int(np.count_nonzero(turning(run)))
        why = f", and the table turns at {turns} of {len(run)}" if turns else ""
        raise InputError(
            f"{run.name}: too short for an Allan deviation: at least 3 samples without a gap are "
            f"needed{why}; give a longer run{' at rest' if turns else ''}"
        )
    sample_s = sample_interval(run, segments)
    error = run.error_deg_h
    longest = max(segments, key=lambda part: part.stop - part.start)
    hold = hold_of(error[longest][:HOLD_ROWS]).samples
    if hold == 1.0:
        return NoiseSeries(
            run, sample_s, segments, 1.0, [error[s] for s in segments], [run.time[s] for s in segments]
        )
    # Of the longest stretch: others may be too short to tell it.
    rows = [s.start + _new_rows(error[s], hold) for s in segments]
    return NoiseSeries(run, sample_s, segments, hold, [error[r] for r in rows], [run.time[r] for r in rows])


def joined(series: Sequence[NoiseSeries]) -> tuple[FloatArray, list[slice]]:
    """Errors of all runs one after the other, and their stretches."""
    if len(series) == 1:
        return series[0].run.error_deg_h, series[0].segments
    starts = np.cumsum([0, *(len(one.run) for one in series[:-1])]).tolist()
    segments = [
        slice(at + part.start, at + part.stop) for at, one in zip(starts, series) for part in one.segments
    ]
    return np.concatenate([one.run.error_deg_h for one in series]), segments


def spectrum_of_runs(series: Sequence[NoiseSeries], moving: Sequence[bool]) -> Spectrum:
    """Spectrum of all stretches, each run with a ramp of its own; those are the first columns.

    Behind them is what a drift may follow in runs whose temperature is moving.
    """
    follows = [thermal_columns(one.run) if moves else None for one, moves in zip(series, moving, strict=True)]
    columns = []
    for place, one in enumerate(series):
        columns += [_rows_at(time, place, follows) for time in one.times]
    stretches = [part for one in series for part in one.stretches]
    return spectrum_of(stretches, series[0].new_s, columns)


def _rows_at(time: FloatArray, place: int, follows: Sequence[Follows | None]) -> Rows:
    """Columns of a stretch of one of several runs: a ramp of each run, and what its drift may follow."""

    def rows(part: slice) -> FloatArray:
        at = time[part]
        ramp = np.zeros((len(at), len(follows)))
        ramp[:, place] = at
        drifts = [
            (one_of(at) if other == place else np.zeros((len(at), one_of(at[:1]).shape[1])))
            for other, one_of in enumerate(follows)
            if one_of is not None
        ]
        return np.column_stack([ramp, *drifts])

    return rows


def stretches_at_rest(run: Run) -> list[slice]:
    """Stretches, cut down to rows at rest where the table both turns and stands."""
    moving, at_rest = turning(run), rows_at_rest(run)
    if np.all(moving) or np.all(at_rest):
        return list(run.stretches)
    edges = np.flatnonzero(at_rest[1:] != at_rest[:-1]) + 1
    bounds = np.union1d(np.concatenate(([0], edges, run.gap_starts)), [len(run)])
    return [slice(int(a), int(b)) for a, b in pairwise(bounds) if at_rest[a]]


def rows_at_rest(run: Run) -> BoolArray:
    """Where the table stands, without what is about changes of its rate, shape (n,)."""
    moving = turning(run)
    return ~(moving | transition_mask(run)) if moving.any() else ~moving


def sample_interval(run: Run, segments: Sequence[slice]) -> float:
    """Median sample interval [s], or the mean within stretches where lost samples make that longer."""
    steps = sum(part.stop - 1 - part.start for part in segments)
    spent = sum(float(run.time[part.stop - 1] - run.time[part.start]) for part in segments)
    even = abs(spent / steps / run.sample_s - 1.0) < LOST
    # Times are rounded numbers, and so is their difference.
    return float(f"{run.sample_s if even else spent / steps:.9g}")
