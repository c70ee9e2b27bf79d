"""Series longer than memory: arrays kept in files of no name, and passes over them piece by piece.

Up to `HELD_VALUES` values everything is a plain array and one piece, so that short series cost nothing.
Longer ones lie where the system keeps temporary files (``TMPDIR``), and go with the last array that shows
them.
"""

from __future__ import annotations

import mmap
import os
import tempfile
import weakref
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.numerals import short

HELD_VALUES = 1 << 20
"""Values up to which an array is kept in memory: 8 MiB of float64, of which a command holds some dozens."""
PIECE = 1 << 18
"""Values of a longer array that are worked on at once: 2 MiB of float64."""
_SAMPLE = 1 << 16
"""Values that are sorted for a quantile, of more a sample: one look at all then keeps some 2 % of them."""
_shown: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


def empty(samples: int, kind: Any = np.float64, held: int | None = None) -> NDArray[Any]:
    """An array to fill; of more than `held` samples, or `HELD_VALUES`, one in a file of no name.

    Raises
    ------
    InputError
        If that file does not fit where temporary files lie.
    """
    size = samples * np.dtype(kind).itemsize
    if samples <= (HELD_VALUES if held is None else held):
        return np.empty(samples, kind)
    with tempfile.TemporaryFile(prefix="fogml-") as file:
        _reserve(file, size)
        return _array(file, size, kind)


def _array(file: Any, size: int, kind: Any) -> NDArray[Any]:
    """The array that a file shows, whose pages go when they are let go of."""
    shown = mmap.mmap(file.fileno(), size)
    _shown.add(shown)
    return np.frombuffer(shown, kind)


def _reserve(file: Any, size: int) -> None:
    """Make a file as long as it gets; where its place is short this is told now and not by a crash."""
    try:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
        else:
            file.truncate(size)
    except OSError as error:
        raise no_room(size, error) from None


def no_room(size: int, error: OSError) -> InputError:
    """What to say where temporary files find no room for so many bytes."""
    return InputError(
        f"{tempfile.gettempdir()}: no room for {short(size / 1e9, 2)} GB of a long run "
        f"({error.strerror or error}); free some, or let the environment variable TMPDIR name a folder of a "
        "larger drive"
    )


class Growing:
    """A long array that is written from its first value to its last; `array` shows it."""

    def __init__(self, kind: Any = np.float64) -> None:
        self._kind = np.dtype(kind)
        self._held: list[NDArray[Any]] = []
        self._count = 0
        self._file: Any = None

    def append(self, values: NDArray[Any]) -> None:
        """Put values behind those that are there."""
        self._count += len(values)
        if self._count <= HELD_VALUES:
            self._held.append(np.array(values, dtype=self._kind))
            return
        if self._file is None:
            self._file = tempfile.TemporaryFile(prefix="fogml-")  # noqa: SIM115  closed when nobody holds it
            weakref.finalize(self, self._file.close)
        try:
            for part in (*self._held, values):
                self._file.write(np.ascontiguousarray(part, dtype=self._kind).data)
            self._file.flush()
        except OSError as error:
            raise no_room(self._kind.itemsize * self._count, error) from None
        self._held.clear()

    def array(self) -> NDArray[Any]:
        """All of them; nothing can be appended any more."""
        if self._file is None:
            return np.concatenate(self._held) if self._held else np.empty(0, self._kind)
        return _array(self._file, self._kind.itemsize * self._count, self._kind)


def release() -> None:
    """Let go of the memory in which arrays out of files are shown; they stay as they are.

    Files are shown page by page as they are read, and the system takes these pages back only when it is
    short of memory: until then they would count as the process's own.
    """
    if hasattr(mmap, "MADV_DONTNEED"):
        for shown in list(_shown):
            shown.madvise(mmap.MADV_DONTNEED)


def pieces(walked: NDArray[Any], *, overlap: int = 0, least: int = 1) -> Iterator[slice]:
    """Parts of arrays of one length, one after the other; what is shown of files is let go of between them.

    Parameters
    ----------
    walked
        One of the arrays; all of a short one is one part.
    overlap
        Values of the next part that end the one before.
    least
        A part is so many values or a multiple of it, but for the last.
    """
    samples = len(walked)
    size = max(samples, 1) if samples <= HELD_VALUES else max(PIECE // least, 1) * least
    for start in range(0, max(samples - overlap, 0), size):
        part = slice(start, min(start + size + overlap, samples))
        yield part
        if samples > HELD_VALUES:
            release()


def each(function: Callable[..., ArrayLike], *arrays: NDArray[Any], kind: Any = np.float64) -> NDArray[Any]:
    """What a function of values makes of arrays of one length, value by value."""
    samples = len(arrays[0])
    if samples <= HELD_VALUES:
        return np.asarray(function(*arrays), dtype=kind)
    made = empty(samples, kind)
    for part in pieces(made):
        made[part] = function(*(array[part] for array in arrays))
    return made


def count_up(samples: int) -> IndexArray:
    """``numpy.arange`` of places."""
    if samples <= HELD_VALUES:
        return np.arange(samples, dtype=np.intp)
    made = empty(samples, np.intp)
    for part in pieces(made):
        made[part] = np.arange(part.start, part.stop)
    return made


def chosen(values: NDArray[Any], mask: BoolArray | slice) -> NDArray[Any]:
    """The values that a mask marks, or a part of them."""
    if len(values) <= HELD_VALUES or isinstance(mask, slice):
        return np.asarray(values[mask])
    made, filled = empty(int(np.count_nonzero(mask)), values.dtype), 0
    for part in pieces(values):
        found = values[part][mask[part]]
        made[filled : filled + len(found)] = found
        filled += len(found)
    return made


def places(mask: BoolArray) -> IndexArray:
    """``numpy.flatnonzero`` of a mask."""
    if len(mask) <= HELD_VALUES:
        return np.flatnonzero(mask)
    made, filled = empty(int(np.count_nonzero(mask)), np.intp), 0
    for part in pieces(mask):
        found = part.start + np.flatnonzero(mask[part])
        made[filled : filled + len(found)] = found
        filled += len(found)
    return made


def differences(values: NDArray[Any], order: int = 1) -> Iterator[tuple[int, NDArray[Any]]]:
    """``numpy.diff`` in parts: the place of the first difference of each, and the differences."""
    for part in pieces(values, overlap=order):
        yield part.start, np.diff(values[part], order)


def extremes(values: FloatArray) -> tuple[float, float]:
    """The least and the greatest of values, NaN where one of them is; infinite where there are none."""
    found = np.array([(np.inf, -np.inf), *((x.min(), x.max()) for x in parts_of(values)())])
    return float(found[:, 0].min()), float(found[:, 1].max())


def standard_deviation(values: FloatArray) -> float:
    """``numpy.std`` of values."""
    if len(values) <= HELD_VALUES:
        return float(values.std())
    mean = float(values.mean())
    square = sum(float(np.sum((values[part] - mean) ** 2)) for part in pieces(values))
    return float(np.sqrt(square / len(values)))


Parts = Callable[[], Iterable[FloatArray]]


def parts_of(
    values: FloatArray, function: Callable[..., FloatArray] = np.asarray, *others: FloatArray
) -> Parts:
    """What a function makes of values and of others beside them, part by part, as often as asked."""
    return lambda: (function(*(x[part] for x in (values, *others))) for part in pieces(values))


def median(parts: Parts) -> float:
    """``numpy.median`` of values that are given part by part, as often as they are asked for."""
    kept = _Thinned(most := min(_SAMPLE, HELD_VALUES)).all_of(parts)
    if kept.count <= most:
        return float(np.median(kept.values())) if kept.count else float("nan")
    below, above = _neighbours(parts, (kept.count - 1) // 2, kept)
    return below if kept.count % 2 else 0.5 * (below + above)


def quantiles(parts: Parts, shares: Iterable[float]) -> list[float]:
    """``numpy.quantile`` of values that are given part by part, exact, in memory of a part's size.

    A sample of the values tells between which two a quantile lies; a look at all of them counts those below
    and keeps those between (R. W. Floyd and R. L. Rivest, Communications of the ACM 18, 165, 1975).

    Parameters
    ----------
    parts
        Gives the values, as often as it is called; none of them may be NaN.
    shares
        Of the values that lie below each quantile.
    """
    kept = _Thinned(most := min(_SAMPLE, HELD_VALUES)).all_of(parts)
    if kept.count <= most:
        return [float(value) for value in np.quantile(kept.values(), list(shares))]
    found = []
    for share in shares:
        place = share * (kept.count - 1)
        low = int(np.floor(place))
        below, above = _neighbours(parts, low, kept)
        weight = place - low
        # As numpy interpolates: from the nearer end.
        step = above - below
        found.append(below + weight * step if weight < 0.5 else above - (1.0 - weight) * step)
    return found


class _Thinned:
    """Every k-th of the values that are added, no more than so many, and how many there were."""

    def __init__(self, most: int) -> None:
        self.count = 0
        self._most, self._stride, self._held = most, 1, 0
        self._kept: list[FloatArray] = []

    def add(self, values: FloatArray) -> None:
        while self._held + len(fresh := values[-self.count % self._stride :: self._stride]) > self._most:
            self._stride *= 2
            self._kept = [self.values()[::2]]
            self._held = len(self._kept[0])
        self._kept.append(np.array(fresh))
        self._held += len(fresh)
        self.count += len(values)

    def all_of(self, parts: Parts, above: float | None = None, below: float | None = None) -> _Thinned:
        """With those of some parts added that lie beyond one value and under another."""
        for part in parts():
            inside = part if above is None else part[part > above]
            self.add(inside if below is None else inside[inside < below])
        return self

    def values(self) -> FloatArray:
        return np.concatenate(self._kept) if self._kept else np.empty(0)


def _neighbours(parts: Parts, rank: int, kept: _Thinned) -> tuple[float, float]:
    """The value of a rank, counted from 0, and the next one in order; the last is followed by itself."""
    low: float | None = None
    high: float | None = None
    before, inside = 0, kept.count
    sample = kept.values()
    while True:
        sample = np.sort(sample)
        # A rank in a random sample is off by half a root of its size; by four times that rarely.
        middle = (rank - before) / inside * len(sample)
        margin = 2.0 * np.sqrt(len(sample)) + 1.0
        first = sample[max(int(middle - margin), 0)]
        last = sample[min(int(middle + margin), len(sample) - 1)]
        under = up_to_first = up_to_last = 0
        between = _Thinned(HELD_VALUES)
        for part in parts():
            above = part > first
            under += int(np.count_nonzero(part < first))
            up_to_first += len(part) - int(np.count_nonzero(above))
            between.add(part[above & (part < last)])
            up_to_last += int(np.count_nonzero(part <= last))
        under_last = up_to_first + between.count
        if under <= rank < up_to_first:
            return float(first), float(first) if rank + 1 < up_to_first else _next(parts, first)
        if under_last <= rank < up_to_last:
            return float(last), float(last) if rank + 1 < up_to_last else _next(parts, last)
        if up_to_first <= rank < under_last and between.count <= HELD_VALUES:
            ordered = np.sort(between.values())
            at = rank - up_to_first
            return float(ordered[at]), float(
                ordered[at + 1] if at + 1 < len(ordered) else _next(parts, ordered[at])
            )
        if rank < under:
            high = first
        elif rank >= up_to_last:
            low, before = last, up_to_last
        else:
            low, high, before = first, last, up_to_first
        fresh = _Thinned(_SAMPLE).all_of(parts, low, high)
        sample, inside = fresh.values(), fresh.count


def _next(parts: Parts, value: float) -> float:
    """The least value beyond one; that one where there is none."""
    beyond = [float(above.min()) for part in parts() if len(above := part[part > value])]
    return min(beyond, default=float(value))
