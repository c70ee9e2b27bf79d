"""A small Kolmogorov-Arnold network: a spline and a SiLU on every edge, added up at every node."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray, IndexArray
from fogml.models.table import TrainingTable

INTERVALS, DEGREE = 5, 3
"""Of each edge's spline: pykan's defaults."""
_NOISE = 0.3
"""Size of the splines at the start, as pykan's."""
_EDGE, _SHARED = 10, 48
"""Operations of an edge (four splines are not zero), and of what the edges of a node share."""


class KANLearner:
    """Two layers of splines, fitted by L-BFGS to standardised rows.

    Knots of the first layer span the rows; those of the second what the first gives at the start.
    Beyond them the SiLU goes on.

    Parameters
    ----------
    hidden
        Nodes between.
    steps
        Of L-BFGS.
    seed
        Of the weights.
    """

    def __init__(self, hidden: int = 3, steps: int = 100, seed: int = 0) -> None:
        self.hidden, self.steps, self.seed = hidden, steps, seed

    def fit(self, table: TrainingTable, rows: IndexArray) -> None:
        """Fit to some rows of a table, inputs and drift standardised."""
        import torch

        X, y = table.X[rows], table.y[rows]
        self._shift, self._scale = X.mean(axis=0), np.maximum(X.std(axis=0), 1e-12)
        self._level, self._size = float(y.mean()), max(float(y.std()), 1e-12)
        inputs = torch.as_tensor((X - self._shift) / self._scale, dtype=torch.float32)
        target = torch.as_tensor((y - self._level) / self._size, dtype=torch.float32)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(self.seed)
            first = _layer(inputs, self.hidden)
            with torch.no_grad():
                between = first(inputs)
            self._network = torch.nn.Sequential(first, _layer(between, 1))
        optimiser = torch.optim.LBFGS(
            self._network.parameters(), max_iter=self.steps, line_search_fn="strong_wolfe"
        )

        def error() -> Any:
            optimiser.zero_grad()
            squares = torch.mean((self._network(inputs)[:, 0] - target) ** 2)
            squares.backward()
            return squares

        optimiser.step(error)

    def at_rows(self, table: TrainingTable, rows: IndexArray) -> FloatArray:
        """Drift at rows of a table [deg/h]."""
        return self._values(table.X[rows])

    def along(self, X: FloatArray, time_s: FloatArray) -> FloatArray:
        """Drift along a run [deg/h]."""
        return self._values(X)

    def _values(self, X: FloatArray) -> FloatArray:
        import torch

        scaled = torch.as_tensor((X - self._shift) / self._scale, dtype=torch.float32)
        with torch.no_grad():
            parts = [self._network(part)[:, 0] for part in torch.split(scaled, 65536)]
        return np.asarray(torch.cat(parts).double()) * self._size + self._level

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The network's numbers, ends of its knots among them."""
        return {name: array.numpy() for name, array in self._network.state_dict().items()}

    def operations(self) -> int:
        """Four basis splines and a SiLU for each node's value, products and sums for each edge."""
        inputs = len(self._shift)
        return (inputs + self.hidden) * _SHARED + (inputs * self.hidden + self.hidden) * _EDGE


def _layer(inputs: Any, outputs: int) -> Any:
    """A layer whose knots span these inputs, shape (n, k)."""
    import torch

    class Layer(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            width, bases = inputs.shape[1], INTERVALS + DEGREE
            self.register_buffer("ends", torch.stack([inputs.min(0).values, inputs.max(0).values]))
            self.base = torch.nn.Parameter(torch.randn(outputs, width) / width**0.5)
            self.spline = torch.nn.Parameter(_NOISE * torch.randn(outputs, width, bases) / bases)

        def forward(self, x: Any) -> Any:
            low, high = self.ends
            place = (x - low) / torch.clamp(high - low, min=1e-6) * INTERVALS
            splines = torch.einsum("nig,oig->no", _basis(place), self.spline)
            return torch.nn.functional.silu(x) @ self.base.T + splines

    return Layer()


def _basis(place: Any) -> Any:
    """Uniform B-splines at places in units of the knots' distance, shape (n, k, bases)."""
    import torch

    knots = torch.arange(-DEGREE, INTERVALS + DEGREE + 1, dtype=place.dtype)
    x = place[..., None]
    # The last knot of the span counts to it: the largest value lies on it.
    x = torch.where(x == INTERVALS, x - 1e-5, x)
    values = ((x >= knots[:-1]) & (x < knots[1:])).to(place.dtype)
    for order in range(1, DEGREE + 1):
        left = (x - knots[: -order - 1]) / order * values[..., :-1]
        right = (knots[order + 1 :] - x) / order * values[..., 1:]
        values = left + right
    return values
