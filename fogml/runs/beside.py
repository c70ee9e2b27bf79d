"""A column of another rate beside a run, brought to the run's times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fogml.runs.columns import conversion, parse_header
from fogml.runs.reader_process import StoredArray, StoredFile
from fogml.signals import large

FloatArray = NDArray[np.float64]


def interpolated(seconds: FloatArray, at: FloatArray, values: FloatArray) -> FloatArray:
    """Values of one rate at the times of another; the first and last are held beyond."""
    sound = np.isfinite(at) & np.isfinite(values)
    if not sound.any():
        return np.full(len(seconds), np.nan)
    order = np.argsort(at[sound], kind="stable")
    known_s, known = at[sound][order], values[sound][order]
    return large.each(lambda part: np.interp(part, known_s, known), seconds)


def clock_s(cell: str, file: str) -> float:
    """Seconds in one unit of a clock, by its header cell."""
    return conversion("time", parse_header(cell)[1], file)[0]


class Beside:
    """A column of another group, read forward as the blocks of the run want it.

    Held of it are the values about the block's times; all of it where its own clock or the run's goes back.

    Parameters
    ----------
    cell
        Its header cell.
    clock
        Header cell and array of its times.
    array
        Where it is stored.
    step
        Values read at once.
    """

    def __init__(
        self, cell: str, clock: tuple[str, StoredArray], array: StoredArray, step: int = 1 << 16
    ) -> None:
        self.cell, self.array, self.step = cell, array, step
        self.clock, self.times = clock
        self.count = min(max(self.times.shape), max(array.shape))
        self.read, self.is_whole = 0, False
        self.at_s, self.values = np.empty(0), np.empty(0)

    def at(self, stored: StoredFile, seconds: FloatArray) -> FloatArray:
        """The column at the times of a block, which comes after the block before."""
        sound = seconds[np.isfinite(seconds)]
        if not len(sound):
            return np.full(len(seconds), np.nan)
        if self.read > len(self.at_s) > 0 and sound.min() < self.at_s[0]:
            self._all(stored)
        while self.read < self.count and not (len(self.at_s) and self.at_s[-1] >= sound.max()):
            self._next(stored)
        found = interpolated(seconds, self.at_s, self.values)
        if not self.is_whole:
            kept = max(int(np.searchsorted(self.at_s, sound.max(), side="right")) - 1, 0)
            self.at_s, self.values = self.at_s[kept:], self.values[kept:]
        return found

    def _next(self, stored: StoredFile) -> None:
        stop = min(self.read + self.step, self.count)
        at = stored.read(self.times, self.read, stop) * clock_s(self.clock, stored.path.name)
        values = stored.read(self.array, self.read, stop)
        sound = np.isfinite(at) & np.isfinite(values)
        before = self.at_s[-1:]
        self.at_s = np.concatenate([self.at_s, at[sound]])
        self.values = np.concatenate([self.values, values[sound]])
        self.read = stop
        if not self.is_whole and np.any(np.diff(np.concatenate([before, at[sound]])) < 0.0):
            self._all(stored)

    def _all(self, stored: StoredFile) -> None:
        stored.limits.check_size(stored.path, 2.0 * self.count)
        self.is_whole, self.read, self.step = True, 0, self.count
        self.at_s, self.values = np.empty(0), np.empty(0)
        self._next(stored)
