"""Jointly outside: the trained range of every other input at each temperature, not over all of them.

The box of each atom by itself says nothing of a temperature that training passed one way only. So the range
of temperature is cut into slices, and in each the trained range of how temperature moves (its rate, or its
distance from its lag or play), of gradients and of other columns is held: two numbers a slice and input,
which a microcontroller looks up at every sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.features.atoms import Atom
from fogml.strict import Strict

SLICES = 32
"""Slices of the trained range of temperature: 3 degC of a range of 100 degC, some minutes of a ramp."""
SLACK = 0.25
"""How far beyond a slice's range counts as inside still, as a share of the input's whole trained span: half
the way from ramps of one direction to standing still, where both directions are trained. Corners of a
programme and the few rows of a slice change its range by less; the other direction is beyond it."""


@dataclass(frozen=True, eq=False)
class Slices:
    """Trained range of c inputs in each of s slices of temperature.

    Attributes
    ----------
    level
        Place among the atoms of the temperature that is sliced.
    first, width
        Its lowest trained value and the width of a slice [degC].
    of, less
        Each input is the atom of place ``of`` less that of place ``less``, or by itself where that is -1.
    low, high
        Lowest and highest value trained, shapes (c, s).
    """

    level: int
    first: float
    width: float
    of: tuple[int, ...]
    less: tuple[int, ...]
    low: FloatArray
    high: FloatArray

    @property
    def span(self) -> FloatArray:
        """Whole trained span of each input, shape (c,); of one that never moved, float noise about it."""
        low, high = self.low.min(axis=1), self.high.max(axis=1)
        return np.asarray(np.maximum(high - low, 1e-9 * np.maximum(1.0, np.maximum(abs(low), abs(high)))))

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Values beyond these, each of shape (c, s), are flagged: the trained range and `SLACK`."""
        slack = SLACK * self.span[:, None]
        return self.low - slack, self.high + slack

    def excess(self, atoms: FloatArray) -> FloatArray:
        """How far beyond the range of their slice atoms (n, a) lie, as a share of its span, shape (n, c)."""
        place, values = self._place(atoms), np.column_stack(list(self._inputs(atoms)))
        away = np.maximum(self.low[:, place].T - values, values - self.high[:, place].T) / self.span
        return np.maximum(away, 0.0)

    def outside(self, atoms: FloatArray) -> BoolArray:
        """Rows (n,) of atoms (n, a) with an input beyond the range of its slice; said of full windows."""
        place = self._place(atoms)
        lowest, highest = self.bounds
        found = np.zeros(len(atoms), dtype=np.bool_)
        for value, low, high in zip(self._inputs(atoms), lowest, highest, strict=True):
            found |= (value < low[place]) | (value > high[place])
        return found

    def _place(self, atoms: FloatArray) -> IndexArray:
        """Slice of each row (n,)."""
        share = (atoms[:, self.level] - self.first) / self.width
        return np.clip(share, 0.0, self.low.shape[1] - 1.0, out=share).astype(np.intp)

    def _inputs(self, atoms: FloatArray) -> Iterator[FloatArray]:
        """Values (n,) of each input."""
        for i, j in zip(self.of, self.less, strict=True):
            yield atoms[:, i] if j < 0 else atoms[:, i] - atoms[:, j]

    @classmethod
    def learn(cls, atoms: Sequence[Atom], parts: Sequence[tuple[FloatArray, BoolArray]]) -> Slices | None:
        """The slices of training rows: atom values (n, a) with the rows marked full (n,); None if none apply.

        A slice that no row fell in has the range of those beside it together.
        """
        level, pairs = _inputs_of(atoms)
        if level is None or not pairs:
            return None
        trained = [values if full.all() else values[full] for values, full in parts if full.any()]
        if not trained:
            return None
        first = min(float(values[:, level].min()) for values in trained)
        last = max(float(values[:, level].max()) for values in trained)
        width = (last - first) / SLICES
        if not width > 1e-9 * max(1.0, abs(first), abs(last)):
            return None
        of, less = zip(*pairs, strict=True)
        empty = np.full((len(of), SLICES), np.inf)
        slices = cls(level, first, width, of, less, empty, -empty)
        for values in trained:
            place = slices._place(values)
            # Temperature is slow: thousands of rows follow each other in a slice.
            starts = np.flatnonzero(np.diff(place, prepend=-1))
            for low, high, value in zip(slices.low, slices.high, slices._inputs(values), strict=True):
                np.minimum.at(low, place[starts], np.minimum.reduceat(value, starts))
                np.maximum.at(high, place[starts], np.maximum.reduceat(value, starts))
        filled = np.flatnonzero(np.isfinite(slices.low[0]))
        beside = np.searchsorted(filled, np.arange(SLICES))
        after, before = filled[beside], filled[np.maximum(beside - 1, 0)]
        hole = ~np.isin(np.arange(SLICES), filled)
        slices.low[:, hole] = np.minimum(slices.low[:, after], slices.low[:, before])[:, hole]
        slices.high[:, hole] = np.maximum(slices.high[:, after], slices.high[:, before])[:, hole]
        return slices

    def of_atoms(self, places: Sequence[int]) -> Slices | None:
        """The slices with the atoms at some places alone; None if no input is left of them."""
        where = {place: new for new, place in enumerate(places)} | {-1: -1}
        pairs = zip(self.of, self.less, strict=True)
        kept = [row for row, (i, j) in enumerate(pairs) if i in where and j in where]
        if self.level not in where or not kept:
            return None
        of, less = (tuple(where[held[row]] for row in kept) for held in (self.of, self.less))
        level = where[self.level]
        return replace(self, level=level, of=of, less=less, low=self.low[kept], high=self.high[kept])

    def saved(self, atoms: Sequence[Atom]) -> SavedSlices:
        """What files hold of them, atoms by their texts."""
        names = [atom.text for atom in atoms]
        inputs = [
            SavedInput(atom=names[i], less=None if j < 0 else names[j], low=low, high=high)
            for i, j, low, high in zip(self.of, self.less, self.low.tolist(), self.high.tolist())
        ]
        return SavedSlices(of=names[self.level], first=self.first, width=self.width, inputs=inputs)

    @classmethod
    def from_saved(cls, saved: SavedSlices, atoms: Sequence[Atom]) -> Slices:
        """The slices that `saved` gave.

        Raises
        ------
        InputError
            If they are none of these atoms.
        """
        names = [atom.text for atom in atoms]
        wanted = [saved.of, *(name for i in saved.inputs for name in (i.atom, i.less) if name is not None)]
        unknown = [name for name in wanted if name not in names]
        lengths = {len(ends) for i in saved.inputs for ends in (i.low, i.high)}
        if unknown or len(lengths) != 1:
            told = f"no atom '{unknown[0]}'" if unknown else f"ranges of {sorted(lengths)} slices"
            raise InputError(f"trained slices: {told}")
        return cls(
            names.index(saved.of),
            saved.first,
            saved.width,
            tuple(names.index(i.atom) for i in saved.inputs),
            tuple(-1 if i.less is None else names.index(i.less) for i in saved.inputs),
            np.array([i.low for i in saved.inputs]),
            np.array([i.high for i in saved.inputs]),
        )


class SavedInput(Strict):
    """Trained range of an atom, or of one less another, in each slice."""

    atom: str
    less: str | None
    low: list[float] = Field(min_length=1)
    high: list[float] = Field(min_length=1)


class SavedSlices(Strict):
    """Slices as files hold them."""

    of: str
    first: float
    width: Annotated[float, Field(gt=0.0)]
    inputs: list[SavedInput] = Field(min_length=1)


def _inputs_of(atoms: Sequence[Atom]) -> tuple[int | None, list[tuple[int, int]]]:
    """Place of the temperature that is sliced, and the inputs whose range depends on it.

    What moves with a signal is told once: by its rates and differences, else its direction, else its distance
    from its shortest lag, else from its narrowest play.
    """
    values = {atom.signal: i for i, atom in enumerate(atoms) if atom.operator == "value"}
    levels = [i for signal, i in values.items() if signal.unit == "degC" and not signal.is_difference]
    if not levels:
        return None, []
    level = levels[0]
    pairs = []
    for signal, i in values.items():
        if i != level:
            alike = signal.unit == "degC" and not signal.is_difference
            pairs.append((i, level if alike else -1))
    for signal in dict.fromkeys(atom.signal for atom in atoms):
        own = [(atom.memory, i) for i, atom in enumerate(atoms) if atom.signal == signal]
        moving = {name: [(m, i) for m, i in own if atoms[i].operator == name] for name in _MOTION}
        if found := [i for name in ("d", "diff") for _, i in moving[name]] or [i for _, i in moving["sign"]]:
            pairs += [(i, -1) for i in found]
        elif (followed := moving["lag"] or moving["play"]) and signal in values:
            pairs.append((min(followed)[1], values[signal]))
    return level, pairs


_MOTION = ("d", "diff", "sign", "lag", "play")
