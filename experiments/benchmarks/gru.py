"""Networks over sequences, recurrent or of convolutions, as a user would write them in torch."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray, IndexArray
from fogml.models.table import TrainingTable
from fogml.signals.averages import block_averages

_WARM_UP = 32
"""Steps before each piece whose outputs do not count: the state settles on them."""
_PIECES = 8
_CURVE = 20
"""Operations of a tanh, as the product counts an exponential."""


class GRULearner:
    """One GRU layer and a linear one, trained on pieces of the runs in batches, by Adam.

    Rows that are not fitted to stay in the sequence; only their errors do not count. A run of
    another sample interval is averaged to that of training first.

    Parameters
    ----------
    hidden
        Units of the layer.
    rate, decay
        Greatest learning rate, and Adam's weight decay.
    epochs
        Passes over the rows.
    seed
        Of the weights.
    """

    def __init__(
        self, hidden: int = 32, rate: float = 0.01, decay: float = 1e-4, epochs: int = 100, seed: int = 0
    ) -> None:
        self.hidden, self.rate, self.decay, self.epochs, self.seed = hidden, rate, decay, epochs, seed

    def fit(self, table: TrainingTable, rows: IndexArray) -> None:
        """Fit to some rows of a table, inputs and drift standardised."""
        import torch

        X, y = table.X[rows], table.y[rows]
        self._shift, self._scale = X.mean(axis=0), np.maximum(X.std(axis=0), 1e-12)
        self._level, self._size = float(y.mean()), max(float(y.std()), 1e-12)
        self._step_s = float(np.median(np.diff(table.time_s)))
        counted = np.zeros(len(table), dtype=bool)
        counted[rows] = True
        pieces = [piece for run in _runs(table) for piece in self._pieces(table, run, counted)]
        longest = max(len(inputs) for inputs, _, _ in pieces)
        inputs, target, weight = (
            torch.as_tensor(np.stack([_padded(piece[i], longest) for piece in pieces]), dtype=torch.float32)
            for i in range(3)
        )
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(self.seed)
            self._network = self._made(X.shape[1])
            parameters = list(self._network.parameters())
            optimiser = torch.optim.Adam(parameters, self.rate, weight_decay=self.decay)
            schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, self.rate, total_steps=self.epochs)
            for _ in range(self.epochs):
                optimiser.zero_grad()
                error = (self._network(inputs) - target) ** 2
                ((error * weight).sum() / weight.sum()).backward()
                torch.nn.utils.clip_grad_norm_(parameters, 1.0)
                optimiser.step()
                schedule.step()

    def _made(self, width: int) -> Any:
        return _network(width, self.hidden)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The network's numbers."""
        return {name: array.numpy() for name, array in self._network.state_dict().items()}

    def operations(self) -> int:
        """Products and sums of a step, and `_CURVE` for each tanh or logistic of the state."""
        width, h = len(self._shift), self.hidden
        return 6 * h * (width + h) + h * (3 * _CURVE + 10) + 2 * h

    def _pieces(
        self, table: TrainingTable, run: slice, counted: NDArray[np.bool_]
    ) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        inputs = self._scaled(table.X[run])
        target = (table.y[run] - self._level) / self._size
        weight = counted[run].astype(np.float64)
        before = np.repeat(inputs[:1], _WARM_UP, axis=0)
        inputs = np.concatenate([before, inputs])
        target, weight = (np.concatenate([np.zeros(_WARM_UP), values]) for values in (target, weight))
        found = []
        for part in np.array_split(np.arange(_WARM_UP, len(inputs)), _PIECES):
            if len(part):
                piece = slice(part[0] - _WARM_UP, part[-1] + 1)
                heeded = weight[piece].copy()
                heeded[:_WARM_UP] = 0.0
                found.append((inputs[piece], target[piece], heeded))
        return found

    def at_rows(self, table: TrainingTable, rows: IndexArray) -> FloatArray:
        """Drift at rows of a table [deg/h], the state running over all of its run."""
        whole = np.concatenate([self._sequence(table.X[run]) for run in _runs(table)])
        return whole[rows]

    def along(self, X: FloatArray, time_s: FloatArray) -> FloatArray:
        """Drift along a run [deg/h], at the steps of training, straight lines between them."""
        means = block_averages(time_s, X, window_s=self._step_s)
        return np.interp(time_s, means.time_s, self._sequence(means.values[0]))

    def _scaled(self, X: FloatArray) -> FloatArray:
        return np.asarray((X - self._shift) / self._scale)

    def _sequence(self, X: FloatArray) -> FloatArray:
        import torch

        scaled = self._scaled(np.concatenate([np.repeat(X[:1], _WARM_UP, axis=0), X]))
        with torch.no_grad():
            values = self._network(torch.as_tensor(scaled[None], dtype=torch.float32))
        return np.asarray(values[0, _WARM_UP:].double()) * self._size + self._level


class TCNLearner(GRULearner):
    """As `GRULearner`, of causal convolutions over three steps that lie 1, 3 and 9 apart: 27 steps back."""

    def _made(self, width: int) -> Any:
        return _convolutions(width, self.hidden)

    def operations(self) -> int:
        """Of a step, what earlier steps gave being kept."""
        width, h = len(self._shift), self.hidden
        return 6 * h * (width + 2 * h) + 3 * h * _CURVE + 2 * h


def _convolutions(width: int, hidden: int) -> Any:
    import torch

    class Network(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.layers = torch.nn.ModuleList(
                torch.nn.Conv1d(inputs, hidden, 3, dilation=apart)
                for inputs, apart in ((width, 1), (hidden, 3), (hidden, 9))
            )
            self.linear = torch.nn.Linear(hidden, 1)

        def forward(self, x: Any) -> Any:
            x = x.transpose(1, 2)
            for layer in self.layers:
                x = torch.tanh(layer(torch.nn.functional.pad(x, (2 * layer.dilation[0], 0))))
            return self.linear(x.transpose(1, 2))[..., 0]

    return Network()


def _network(width: int, hidden: int) -> Any:
    import torch

    class Network(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.recurrent = torch.nn.GRU(width, hidden, batch_first=True)
            self.linear = torch.nn.Linear(hidden, 1)

        def forward(self, x: Any) -> Any:
            return self.linear(self.recurrent(x)[0])[..., 0]

    return Network()


def _runs(table: TrainingTable) -> list[slice]:
    edges = np.flatnonzero(np.diff(table.run_index)) + 1
    bounds = [0, *edges.tolist(), len(table)]
    return [slice(a, b) for a, b in pairwise(bounds)]


def _padded(values: FloatArray, length: int) -> FloatArray:
    missing = length - len(values)
    return np.concatenate([values, np.zeros((missing, *values.shape[1:]))])
