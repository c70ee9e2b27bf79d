"""Averages of a run's rows, at the averaging time that figures are told at."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from fogml.runs.run import FloatArray

AVERAGING_S = 100.0


class InRows(Protocol):
    """A run as rows of equal averaging time."""

    def __len__(self) -> int: ...

    @property
    def row_s(self) -> float:
        """Averaging time of a row [s]."""

    @property
    def time(self) -> FloatArray:
        """Mean time of each row [s], shape (m,)."""


@dataclass(frozen=True, eq=False)
class Averages:
    """Rows of a run averaged over windows of `window_s` [s]; windows don't reach over gaps."""

    starts: np.ndarray
    window_s: float
    time: FloatArray

    def of(self, rows: FloatArray) -> FloatArray:
        """Averages of a series of rows, shape (m,) to (k,)."""
        counts = np.diff(self.starts, append=len(rows))
        return np.asarray((np.add.reduceat(rows, self.starts) / counts)[self.full])

    full: np.ndarray


def averages(o: InRows, averaging_s: float = AVERAGING_S) -> Averages:
    """Windows of about `averaging_s` over a run's rows; one row each where rows are longer."""
    width = max(1, round(averaging_s / o.row_s))
    breaks = np.flatnonzero(np.diff(o.time) > 2.5 * o.row_s) + 1
    edges = [0, *breaks.tolist(), len(o)]
    starts = np.concatenate([np.arange(a, b, width) for a, b in pairwise(edges)])
    counts = np.diff(starts, append=len(o))
    full = counts == width
    if not full.any():
        full = counts > 0
    time = np.add.reduceat(o.time, starts) / counts
    return Averages(starts, width * o.row_s, time[full], full)
