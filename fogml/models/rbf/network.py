"""A fitted network: its arrays, its value, and the exact solution for its output weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.models.parameters import expect_arrays
from fogml.models.rbf.evaluate import basis_functions, evaluate_network
from fogml.models.rbf.objective import LINEAR_PRECISION
from fogml.models.rbf.rates import Edge
from fogml.models.tall_least_squares import Part, condense

_PIECE = 1 << 13
_NO_REACH = 1e-9
_FIXED = 1e150  # on the diagonal of the triangle: as good as infinite, and products stay finite


@dataclass(frozen=True)
class Network:
    """``constant + linear . x + sum_j weights_j exp(-|(x - centres_j) / widths_j|^2)``.

    Beyond `edge` it goes on linearly, along its slope at the edge.

    Attributes
    ----------
    columns
        Which of the k inputs the network sees, shape (d,).
    centres, widths
        Shape (j, d), in the inputs' units.
    weights, linear, constant
        Output weights, shapes (j,) and (k,), and the constant, in the target's unit.
    edge
        Range of the inputs that hold a rate.
    """

    columns: IndexArray
    centres: FloatArray
    widths: FloatArray
    weights: FloatArray
    linear: FloatArray
    constant: float
    edge: Edge = field(default_factory=Edge.none)

    def __call__(self, inputs: FloatArray, threads: int | None = None, single: bool = False) -> FloatArray:
        """Value at rows, shape (n,)."""
        values = self._inside(inputs, threads, single)
        beyond = self.edge.crossed(inputs)
        for start in range(0, len(beyond), _PIECE):
            rows = beyond[start : start + _PIECE]
            drawn = self.edge.drawn_in(inputs[rows])
            slope = self._slope(drawn, inputs[rows] - drawn, threads)
            values[rows] = self._inside(drawn, threads, single) + slope
        return values

    def _slope(self, inputs: FloatArray, steps: FloatArray, threads: int | None) -> FloatArray:
        """Derivative at rows along steps, both of shape (n, k); shape (n,)."""
        seen, moved = inputs[:, self.columns], steps[:, self.columns]
        inverse = 1.0 / self.widths**2
        basis = basis_functions(inputs, self.columns, self.centres, self.widths, threads).T
        along = (moved * seen) @ inverse.T - moved @ (self.centres * inverse).T
        return np.asarray(steps @ self.linear - 2.0 * (basis * along) @ self.weights)

    def _inside(self, inputs: FloatArray, threads: int | None, single: bool) -> FloatArray:
        if not len(self.weights):
            return np.asarray(inputs @ self.linear + self.constant)
        return evaluate_network(
            inputs,
            self.columns,
            self.centres,
            self.widths,
            self.weights,
            self.linear,
            self.constant,
            threads=threads,
            single=single,
        )

    @property
    def parameter_count(self) -> int:
        """Centres, widths, output weights, linear part and constant."""
        return self.centres.size + self.widths.size + len(self.weights) + len(self.linear) + 1

    def rounded(self) -> Network:
        """The network with every number rounded to float32."""
        return Network(
            self.columns,
            _single(self.centres),
            _single(self.widths),
            _single(self.weights),
            _single(self.linear),
            float(np.float32(self.constant)),
            self.edge,
        )

    def arrays(self, dtype: str) -> dict[str, NDArray[Any]]:
        """Arrays for saving, in ``float32`` or ``float64``."""
        kind = np.dtype(dtype)
        return {
            "centres": self.centres.astype(kind),
            "widths": self.widths.astype(kind),
            "weights": self.weights.astype(kind),
            "linear": np.append(self.linear, self.constant).astype(kind),
            **self.edge.arrays(),
        }

    @classmethod
    def from_arrays(
        cls,
        inputs: int,
        columns: Sequence[int],
        edge_columns: Sequence[int],
        arrays: dict[str, NDArray[Any]],
        dtype: str,
    ) -> Network:
        """The network that `arrays` gave in a dtype, of so many inputs.

        Raises
        ------
        InputError
            If the arrays are not those of such a network: kernels index by them without looking.
        """
        for stated in (columns, edge_columns):
            if sorted(set(stated)) != list(stated) or any(not 0 <= column < inputs for column in stated):
                raise InputError(f"columns {list(stated)} of the network: there are inputs 0 to {inputs - 1}")
        count, dimensions = np.size(arrays.get("weights", ())), len(columns)
        shapes = {"centres": (count, dimensions), "widths": (count, dimensions), "weights": (count,)}
        expected = {name: (dtype, shape) for name, shape in {**shapes, "linear": (inputs + 1,)}.items()}
        if edge_columns:
            expected["edge"] = ("float32", (2, len(edge_columns)))
        expect_arrays(arrays, expected)
        values = {name: np.asarray(array, dtype=np.float64) for name, array in arrays.items()}
        if not np.all(values["widths"] > 0.0):
            raise InputError("array 'widths' holds a width that is not positive")
        edge = Edge.none()
        if edge_columns:
            low, high = values["edge"]
            if not (np.all(low <= 0.0) and np.all(high >= 0.0)):
                raise InputError("array 'edge' is not a range about 0")
            edge = Edge(np.array(edge_columns, dtype=np.intp), low, high)
        shape = np.array(columns, dtype=np.intp), values["centres"], values["widths"]
        linear = values["linear"]
        return cls(*shape, values["weights"], linear[:-1], float(linear[-1]), edge)


@dataclass(frozen=True)
class Solution:
    """Output weights solved exactly, and what their spread follows from.

    Attributes
    ----------
    network
        The network, in float64.
    noise_std
        Standard deviation of what the network leaves, in the target's unit.
    triangle, shift, scale
        Factor R of the penalised normal matrix R'R of the columns ``[1, (c - shift) / scale]``,
        c being the basis functions and, with a linear part, the inputs.
    """

    network: Network
    noise_std: float
    triangle: FloatArray
    shift: FloatArray
    scale: FloatArray
    linear_part: bool = True

    def standard_deviation(self, inputs: FloatArray, threads: int | None = None) -> FloatArray:
        """Standard deviation of the network's value for a noise of variance one, shape (n,)."""
        from scipy.linalg import solve_triangular

        spread = np.empty(len(inputs))
        for start in range(0, len(inputs), _PIECE):
            rows = slice(start, start + _PIECE)
            columns = _columns(self.network, inputs[rows], threads, self.linear_part)
            scaled = np.vstack([np.ones(len(columns)), ((columns - self.shift) / self.scale).T])
            spread[rows] = np.sqrt(np.sum(solve_triangular(self.triangle, scaled, trans="T") ** 2, axis=0))
        return spread


def solve_network(
    inputs: FloatArray,
    target: FloatArray,
    columns: IndexArray,
    centres: FloatArray,
    widths: FloatArray,
    ridge: float,
    linear_part: bool = True,
    edge: Edge | None = None,
) -> Solution:
    """Output weights by least squares with a ridge, over all rows, by QR in float64.

    Parameters
    ----------
    inputs, target
        Rows, shapes (n, k) and (n,).
    columns, centres, widths
        As in `Network`; centres and widths are rounded to float32 first, so that a saved network
        is the one that was solved for.
    ridge
        Penalty on the square of each output weight, in squared units of the rows' target.
    linear_part
        Whether there is a linear part beside the constant.
    edge
        As in `Network`; by default none.
    """
    blank = np.zeros(len(centres)), np.zeros(inputs.shape[1]), 0.0
    empty = Network(columns, _single(centres), _single(widths), *blank, edge or Edge.none())

    def built(rows: slice) -> FloatArray:
        return _columns(empty, inputs[rows], 1, linear_part)

    condensed = condense([Part(target, built, np.zeros(len(target), dtype=np.intp))], 1)
    factor = condensed.factors[0]
    penalty = np.full(factor.shape[1] - 1, LINEAR_PRECISION)
    penalty[0] = 0.0
    # Where no row lies near a centre its column is next to nothing: the centre gets no weight.
    reach = condensed.scale[: len(centres)]
    dead = reach < _NO_REACH
    penalty[1 : 1 + len(centres)] = ridge / np.maximum(reach, _NO_REACH) ** 2
    matrix = np.vstack([factor[:, :-1], np.diag(np.sqrt(penalty))])
    image = np.append(factor[:, -1], np.zeros(len(penalty)))
    solution, *_ = np.linalg.lstsq(matrix, image, rcond=None)
    rest = float(np.sum((factor[:, :-1] @ solution - factor[:, -1]) ** 2))
    triangle = np.asarray(np.linalg.qr(matrix, mode="r"))
    # A column that others tell, or that is zero, has no spread of its own.
    diagonal = np.abs(np.diag(triangle))
    weak = np.flatnonzero(diagonal <= 1e-12 * diagonal.max(initial=1.0))
    triangle[weak, weak] = _FIXED
    share = np.linalg.lstsq(matrix.T @ matrix, factor[:, :-1].T @ factor[:, :-1], rcond=None)[0]
    freedom = max(1.0, len(target) - float(np.trace(share)))
    slopes = solution[1:] / condensed.scale
    slopes[: len(centres)][dead] = 0.0
    constant = float(condensed.y_shift + solution[0] - slopes @ condensed.shift)
    linear = slopes[len(centres) :] if linear_part else empty.linear
    network = replace(empty, weights=slopes[: len(centres)], linear=linear, constant=constant)
    noise_std = float(np.sqrt(rest / freedom))
    return Solution(network, noise_std, triangle, condensed.shift, condensed.scale, linear_part)


def _columns(network: Network, inputs: FloatArray, threads: int | None, linear_part: bool) -> FloatArray:
    """Basis functions, and the inputs where there is a linear part, of rows; shape (n, j + k)."""
    basis = basis_functions(inputs, network.columns, network.centres, network.widths, threads)
    return np.vstack([basis, inputs.T]).T if linear_part else basis.T


def _single(values: FloatArray) -> FloatArray:
    return values.astype(np.float32).astype(np.float64)
