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

from fogml.errors import InputError

FloatArray = NDArray[np.float64]

HELD_VALUES = 1 << 20
"""Values up to which an array is kept in memory: 8 MiB of float64, of which a command holds some dozens."""
PIECE = 1 << 18
"""Values of a longer array that are worked on at once: 2 MiB of float64."""
_DIGIT = 16
"""Bits of a number that one pass of a selection tells."""
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
        raise _no_room(size, error) from None


def _no_room(size: int, error: OSError) -> InputError:
    return InputError(
        f"{tempfile.gettempdir()}: no room for {size / 1e9:.2g} GB of a long run "
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
        self._held.append(np.array(values, dtype=self._kind))
        if self._count > HELD_VALUES:
            self._write()

    def _write(self) -> None:
        if self._file is None:
            self._file = tempfile.TemporaryFile(prefix="fogml-")  # noqa: SIM115  closed when nobody holds it
            weakref.finalize(self, self._file.close)
        try:
            for values in self._held:
                self._file.write(values.data)
            self._file.flush()
        except OSError as error:
            raise _no_room(self._kind.itemsize * self._count, error) from None
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


def count_up(samples: int) -> NDArray[np.intp]:
    """``numpy.arange`` of places."""
    if samples <= HELD_VALUES:
        return np.arange(samples, dtype=np.intp)
    made = empty(samples, np.intp)
    for part in pieces(made):
        made[part] = np.arange(part.start, part.stop)
    return made


def chosen(values: NDArray[Any], mask: NDArray[np.bool_] | slice) -> NDArray[Any]:
    """The values that a mask marks, or a part of them."""
    if len(values) <= HELD_VALUES or isinstance(mask, slice):
        return np.asarray(values[mask])
    made, filled = empty(int(np.count_nonzero(mask)), values.dtype), 0
    for part in pieces(values):
        found = values[part][mask[part]]
        made[filled : filled + len(found)] = found
        filled += len(found)
    return made


def places(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
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
    held, count = _held(parts)
    if held is not None:
        return float(np.median(held)) if count else float("nan")
    return 0.5 * (_ranked(parts, count, (count - 1) // 2) + _ranked(parts, count, count // 2))


def quantiles(parts: Parts, shares: Iterable[float]) -> list[float]:
    """``numpy.quantile`` of values that are given part by part, exact, in memory of a part's size.

    Values are told apart 16 bits at a time; once few enough are left about a rank they are sorted.

    Parameters
    ----------
    parts
        Gives the values, as often as it is called; none of them may be NaN.
    shares
        Of the values that lie below each quantile.
    """
    held, count = _held(parts)
    if held is not None:
        return [float(value) for value in np.quantile(held, list(shares))]
    found = []
    for share in shares:
        place = share * (count - 1)
        low = int(np.floor(place))
        below, above = _ranked(parts, count, low), _ranked(parts, count, min(low + 1, count - 1))
        weight = place - low
        # As numpy interpolates: from the nearer end.
        step = above - below
        found.append(below + weight * step if weight < 0.5 else above - (1.0 - weight) * step)
    return found


def _held(parts: Parts) -> tuple[FloatArray | None, int]:
    """The values, where they are few, and how many there are."""
    held: list[FloatArray] = []
    count = 0
    for part in parts():
        count += len(part)
        if count > HELD_VALUES:
            held.clear()
        else:
            held.append(np.array(part))
    return (None if count > HELD_VALUES else np.concatenate(held) if held else np.empty(0)), count


def _ranked(parts: Parts, count: int, rank: int) -> float:
    """The value of a rank, counted from 0."""
    prefix, known = np.uint64(0), 0
    while known < 64 and count > PIECE:
        tally = np.zeros(1 << _DIGIT, dtype=np.int64)
        for values in parts():
            digits = _within(_ordered(values), prefix, known)
            shifted = digits >> np.uint64(64 - known - _DIGIT)
            tally += np.bincount(
                (shifted & np.uint64((1 << _DIGIT) - 1)).astype(np.intp), minlength=len(tally)
            )
        digit = int(np.searchsorted(np.cumsum(tally), rank, side="right"))
        rank -= int(tally[:digit].sum())
        count, known = int(tally[digit]), known + _DIGIT
        prefix = np.uint64((int(prefix) << _DIGIT) | digit)
    if known == 64:
        return float(_unordered(np.array([prefix]))[0])
    inside = np.concatenate([_within(_ordered(values), prefix, known) for values in parts()])
    return float(_unordered(np.sort(inside)[rank : rank + 1])[0])


def _within(ordered: NDArray[np.uint64], prefix: np.uint64, known: int) -> NDArray[np.uint64]:
    return ordered if known == 0 else ordered[ordered >> np.uint64(64 - known) == prefix]


def _ordered(values: FloatArray) -> NDArray[np.uint64]:
    """Whole numbers in the order of values."""
    bits = np.ascontiguousarray(values, dtype=np.float64).view(np.uint64)
    sign = np.uint64(1 << 63)
    return np.where(bits & sign, ~bits, bits | sign)


def _unordered(ordered: NDArray[np.uint64]) -> FloatArray:
    sign = np.uint64(1 << 63)
    return np.where(ordered & sign, ordered & ~sign, ~ordered).view(np.float64)
