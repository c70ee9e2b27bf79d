"""The trained box: the range of each atom in the training rows, the smooth limit beyond it, and the reach.

Beyond the box a model must fall back smoothly, so atoms level off just outside it; a quintic left
to itself runs away within a few degrees. One kind of atom is let go on: rates and differences
between sensors that enter a linear model to the first power only. The drift that they stand for
(Shupe, Mohr) is linear in them, and a ramp twice as fast as in training needs twice the term.
They level off one whole span outside the box. The sample is flagged all the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom
from fogml.features.terms import Term

OVERSHOOT = 0.05
"""How far beyond the box limited values can go, as a share of its span."""
TOLERANCE = 0.01
"""How far beyond the box counts as inside still, as a share of its span."""


@dataclass(frozen=True, eq=False)
class Box:
    """Lowest and highest value of each atom over the training rows.

    Attributes
    ----------
    low, high
        Bounds in the atoms' units, shape (a,) each.
    """

    low: FloatArray
    high: FloatArray

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=np.float64))
        if self.low.shape != self.high.shape or self.low.ndim != 1 or not np.all(self.low <= self.high):
            raise InputError("trained box: each atom needs a low and a high bound, low not above high")

    @classmethod
    def around(cls, parts: Iterable[tuple[FloatArray, BoolArray]]) -> Box:
        """The box around atom values (n, a), of the rows marked full (n,)."""
        lows, highs = [], []
        for values, full in parts:
            if full.all() and len(values):
                lows.append(values.min(axis=0))
                highs.append(values.max(axis=0))
            elif full.any():
                lows.append([column[full].min() for column in values.T])
                highs.append([column[full].max() for column in values.T])
        if not lows:
            raise InputError(
                "features: no training run is as long as an eighth of a feature window; give longer runs, or "
                "state shorter windows, e.g. dT[block, 16 s]"
            )
        return cls(np.min(lows, axis=0), np.max(highs, axis=0))

    @property
    def span(self) -> FloatArray:
        """Widths of the box, shape (a,); for an atom that never moved, float noise about its value."""
        noise = 1e-9 * np.maximum(1.0, np.maximum(np.abs(self.low), np.abs(self.high)))
        return np.maximum(self.high - self.low, noise)

    def limit(self, values: ArrayLike, heeded: Sequence[BoolArray | None]) -> tuple[FloatArray, BoolArray]:
        r"""Limit atom values smoothly to the box, and tell which rows are outside.

        Inside the box values stay as they are. A value e beyond a bound becomes

        .. math:: m e/(m + e) \quad\text{beyond it},\ m = 5\,\%\ \text{of the span},

        which goes on with slope 1 and never reaches m beyond: continuous with its first derivative.

        Parameters
        ----------
        values
            Atom values, shape (n, a).
        heeded
            For each atom the rows (n,) in which its value means something, or None for all of them:
            values of windows that are not full stay as they are.

        Returns
        -------
        limited : (n, a) array
            `values` itself where nothing exceeds the box.
        outside : (n,) bool array
            Rows with an atom more than 1 % of its span beyond the box.
        """
        values = np.asarray(values, dtype=np.float64)
        limited = values
        outside = np.zeros(len(values), dtype=np.bool_)
        for column, (low, high, span, rows_heeded) in enumerate(zip(self.low, self.high, self.span, heeded)):
            atom = values[:, column]
            if not len(atom) or (atom.min() >= low and atom.max() <= high):
                continue
            beyond_bounds = (atom < low) | (atom > high)
            rows = np.flatnonzero(beyond_bounds if rows_heeded is None else beyond_bounds & rows_heeded)
            if not len(rows):
                continue
            if limited is values:
                limited = values.copy(order="K")
            beyond = np.where(atom[rows] > high, atom[rows] - high, low - atom[rows])
            outside[rows[beyond > TOLERANCE * span]] = True
            margin = OVERSHOOT * span
            soft = margin * beyond / (margin + beyond)
            limited[rows, column] = np.where(atom[rows] > high, high + soft, low - soft)
        return limited, outside


REACH = 1.0
"""How far a linear model follows rates and gradients beyond the box, as a share of its span."""


def reaching_box(box: Box, terms: Sequence[Term], atoms: Sequence[Atom]) -> Box:
    """The box widened for the atoms that a linear model follows beyond it.

    Parameters
    ----------
    box
        The trained box of the atoms.
    terms
        Terms of the model.
    atoms
        The atoms they are made of, in the order of the box.
    """
    highest = dict.fromkeys(atoms, 0)
    for term in terms:
        for atom, power in term.factors:
            highest[atom] = max(highest[atom], power)
    followed = np.array([highest[atom] == 1 and is_rate_or_gradient(atom) for atom in atoms])
    further = np.where(followed, REACH * box.span, 0.0)
    return Box(box.low - further, box.high + further)


def is_rate_or_gradient(atom: Atom) -> bool:
    """Whether an atom is a temperature's change in time, or its difference between sensors."""
    return atom.operator in ("d", "diff") or (
        atom.operator in ("value", "lag", "play") and atom.signal.is_difference
    )
