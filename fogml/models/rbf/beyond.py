"""How a network goes on beyond the rates that it was trained at: linearly, along its slope at the edge.

Basis functions die away beyond the training rows and would take with them what they hold of the
rate. A drift's dependence on the rate goes on, and what is linear in it (Shupe) goes on linearly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]


@dataclass(frozen=True)
class Edge:
    """The trained range of inputs that hold a rate.

    Attributes
    ----------
    columns
        Indices of those inputs, shape (r,).
    low, high
        Their range, zero included, shape (r,).
    """

    columns: IndexArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, inputs: FloatArray, columns: IndexArray) -> Edge:
        """The range of training rows, shape (n, k), rounded outwards to float32."""
        held = inputs[:, columns]
        low, high = np.minimum(held.min(axis=0), 0.0), np.maximum(held.max(axis=0), 0.0)
        return cls(columns, _outwards(low, -np.inf), _outwards(high, np.inf))

    @classmethod
    def none(cls) -> Edge:
        """No inputs that hold a rate."""
        return cls(np.empty(0, dtype=np.intp), np.empty(0), np.empty(0))

    def crossed(self, inputs: FloatArray) -> IndexArray:
        """Indices of the rows beyond the range."""
        beyond = np.zeros(len(inputs), dtype=np.bool_)
        for column, low, high in zip(self.columns, self.low, self.high, strict=True):
            values = inputs[:, column]
            beyond |= (values < low) | (values > high)
        return np.flatnonzero(beyond)

    def drawn_in(self, inputs: FloatArray) -> FloatArray:
        """Rows with all rates scaled down together until they are in range; shape as `inputs`.

        Together, since rates and their products with temperatures keep their proportions when
        a ramp gets faster.
        """
        rates = inputs[:, self.columns]
        edge = np.where(rates > 0.0, self.high, self.low)
        share = np.where((rates > self.high) | (rates < self.low), edge / np.where(rates, rates, 1.0), 1.0)
        drawn = inputs.copy()
        drawn[:, self.columns] = rates * share.min(axis=1, keepdims=True)
        return drawn

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The range as an array for saving, shape (2, r); nothing where there are no such inputs."""
        return {"edge": np.stack([self.low, self.high]).astype(np.float32)} if len(self.columns) else {}


def _outwards(values: FloatArray, towards: float) -> FloatArray:
    """Values rounded to float32 no nearer to zero than they are."""
    single = values.astype(np.float32)
    short = np.abs(single.astype(np.float64)) < np.abs(values)
    return np.where(short, np.nextafter(single, np.float32(towards)), single).astype(np.float64)
