"""Early stopping of plain variable projection, on blocks of time of the training runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fogml.models.folds import dealt_folds
from fogml.models.rbf.objective import Objective, Shape

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

PATIENCE = 15
"""Iterations without a smaller error on held-out rows after which a descent ends."""


def held_out_rows(count: int, everything: bool = False) -> tuple[IndexArray, IndexArray]:
    """Indices of rows fitted to and of rows held out: every fifth block of time, or none."""
    rows = np.arange(count, dtype=np.intp)
    if everything:
        return rows, rows[:0]
    held = dealt_folds(count) == 0
    return rows[~held], rows[held]


class Watch:
    """Keeps the shape with the least mean squared error on held-out rows, and ends what gains nothing.

    Parameters
    ----------
    objective
        The objective on the rows fitted to, for its output weights.
    inputs, linear, target
        Held-out rows: network inputs (n, d), linear columns (n, p), target (n,).

    Attributes
    ----------
    best, error
        The shape kept, None before the first, and its mean squared error.
    """

    def __init__(
        self, objective: Objective, inputs: FloatArray, linear: FloatArray, target: FloatArray
    ) -> None:
        self._objective = objective
        self._held = Objective(inputs, linear, target)
        self.best: Shape | None = None
        self.error = float("inf")
        self._since = 0

    def __call__(self, shape: Shape) -> None:
        """See a shape; raises StopIteration once `PATIENCE` of them in a row were no better."""
        error = self._held.mean_square(shape, self._objective.weights(shape))
        if error < self.error:
            self.best, self.error, self._since = shape, error, 0
            return
        self._since += 1
        if self._since >= PATIENCE:
            self._since = 0
            raise StopIteration
