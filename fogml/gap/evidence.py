"""Evidence of sets of effects, constants integrated out, from inner products alone.

With whitened data y and whitened columns F of independent coefficients with standard deviation s ::

    log p(y) = -1/2 (y'y - b'(1 + s^2 A)^-1 b s^2) - 1/2 log det(1 + s^2 A),    A = F'F, b = F'y

where inner products are those beside everything that is integrated out already.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import log_ndtr

from fogml.gap.basis import Basis, NodeColumns
from fogml.gap.felt_within import within_columns
from fogml.gap.group_gains import group_gains
from fogml.gap.priors import LENGTHS
from fogml.gap.slack import slack_columns
from fogml.runs.run import FloatArray

MOST_KEPT = 64
"""Conditioned fields that are kept: a search comes back to the same few."""


@dataclass(frozen=True)
class Term:
    """Columns with independent normal coefficients.

    Attributes
    ----------
    columns
        Indices into the basis.
    length
        Standard deviation of each coefficient.
    """

    columns: tuple[int, ...]
    length: float


class Field:
    """Inner products beside the constants.

    Parameters
    ----------
    basis
        What there is.
    """

    def __init__(self, basis: Basis) -> None:
        self.basis = basis
        fixed = basis.constants
        gram = basis.rows.T @ basis.rows
        inner = np.eye(len(fixed)) + gram[np.ix_(fixed, fixed)]
        self._factor = np.linalg.cholesky(inner)
        half = solve_triangular(self._factor, gram[fixed], lower=True)
        self.gram: FloatArray = gram - half.T @ half
        self._blocks_of_rows: list[tuple[FloatArray, FloatArray]] = [(basis.rows, half)]
        self._slacks: dict[int, tuple[int, ...]] = {}
        self._withins: dict[int, tuple[int, ...]] = {}
        self._conditioned: dict[tuple[Term, ...], Conditioned] = {}
        width = max((len(n.columns) for n in basis.nodes), default=1)
        self.rank = width
        # A column of zeros fills nodes of lower rank up.
        padded = len(self.gram)
        self._index = np.full((len(basis.nodes), self.rank), -1)
        for i, node in enumerate(basis.nodes):
            self._index[i, : len(node.columns)] = node.columns
        extended = np.zeros((padded + 1, padded + 1))
        extended[:padded, :padded] = self.gram
        self._blocks = extended[self._index[:, :, None], self._index[:, None, :]]
        self._fits = extended[self._index, 0]
        self.signs = np.array([n.sign for n in basis.nodes])
        self.log_weights = np.array([n.log_weights for n in basis.nodes])

    @property
    def log_evidence(self) -> float:
        """Of the whitened data with the constants alone."""
        return float(-0.5 * self.gram[0, 0] - np.log(np.diagonal(self._factor)).sum())

    def slack(self, node: int) -> tuple[int, ...]:
        """Columns of what the form of a node's effect may differ by, a length of 1 in all."""
        if node not in self._slacks:
            self._slacks[node] = self.append(slack_columns(self.basis, node))
        return self._slacks[node]

    def within(self, node: int) -> tuple[int, ...]:
        """The column of a node's effect felt deeper than it is measured, if any; see `within_columns`."""
        if node not in self._withins:
            self._withins[node] = self.append(within_columns(self.basis, node))
        return self._withins[node]

    def append(self, columns: FloatArray) -> tuple[int, ...]:
        """Add whitened columns, shape (n, k); gives the indices that terms name them by."""
        first, width = len(self.gram), columns.shape[1]
        if width == 0:
            return ()
        fixed = self.basis.rows[:, self.basis.constants]
        half = solve_triangular(self._factor, fixed.T @ columns, lower=True)
        self._blocks_of_rows.append((columns, half))
        total = first + width
        gram = np.empty((total, total))
        gram[:first, :first] = self.gram
        # Few columns from the left: the product goes through the many rows' memory once.
        across = [columns.T @ rows - half.T @ other for rows, other in self._blocks_of_rows]
        gram[first:] = np.concatenate(across, axis=1)
        gram[:first, first:] = gram[first:, :first].T
        self.gram = gram
        return tuple(range(first, total))

    def columns(self, places: Sequence[int]) -> FloatArray:
        """Whitened columns by their indices, shape (n, len(places))."""
        first = 0
        wanted = np.asarray(places, dtype=np.intp)
        out = np.empty((len(self.basis.rows), len(wanted)))
        for rows, _ in self._blocks_of_rows:
            inside = (wanted >= first) & (wanted < first + rows.shape[1])
            out[:, inside] = rows[:, wanted[inside] - first]
            first += rows.shape[1]
        return out

    def condition(self, terms: Sequence[Term]) -> Conditioned:
        """The field with terms integrated out as well; the latest ones are kept."""
        key = tuple(terms)
        held = self._conditioned.pop(key, None)
        if held is None:
            held = Conditioned(self, terms)
            if len(self._conditioned) >= MOST_KEPT:
                del self._conditioned[next(iter(self._conditioned))]
        self._conditioned[key] = held
        return held


class Conditioned:
    """A field with terms integrated out.

    Attributes
    ----------
    log_evidence
        Of the data, up to what does not depend on the terms.
    sign_gains
        What a sign that is known adds to the gains of the nodes that were asked for, shape (nodes, lengths).
    """

    def __init__(self, field: Field, terms: Sequence[Term]) -> None:
        self.field, self.terms = field, tuple(terms)
        self._node_gains: dict[bytes, FloatArray] = {}
        self._every_gain: FloatArray | None = None
        self.sign_gains = np.zeros((len(field.basis.nodes), len(LENGTHS)))
        self._columns = np.array([c for t in terms for c in t.columns], dtype=np.intp)
        self._scale = np.array([t.length for t in terms for _ in t.columns])
        gram = field.gram
        k = len(self._columns)
        if k:
            rows = self._scale[:, None] * gram[self._columns]
            inner = np.eye(k) + rows[:, self._columns] * self._scale
            rows = rows[:, : field.basis.rows.shape[1]]
            self._factor = np.linalg.cholesky(0.5 * (inner + inner.T))
            # Its few rows are inverted once: the product with thousands of columns is the faster then.
            self.half = solve_triangular(self._factor, np.eye(k), lower=True, check_finite=False) @ rows
            log_det = float(np.log(np.diag(self._factor)).sum())
        else:
            self.half = np.zeros((0, field.basis.rows.shape[1]))
            log_det = 0.0
        fit = self.half[:, 0]
        self.square = float(gram[0, 0] - fit @ fit)
        self.log_evidence = -0.5 * self.square - log_det

    def coefficients(self) -> tuple[FloatArray, FloatArray]:
        """Posterior mean and covariance of the terms' coefficients, in their own units."""
        factor = (self._factor, True)
        mean = self._scale * cho_solve(factor, self._scale * self.field.gram[self._columns, 0])
        covariance = self._scale[:, None] * cho_solve(factor, np.diag(self._scale))
        return mean, covariance

    def node_gains(self, nodes: NDArray[np.intp] | None = None) -> FloatArray:
        """Gain in log evidence of each node at each length, weights included, shape (nodes, lengths).

        Of the nodes stated, or of all; minus infinity for the others.
        """
        field = self.field
        places = np.arange(len(field.basis.nodes)) if nodes is None else nodes
        key = places.tobytes()
        if key not in self._node_gains:
            out = np.full((len(field.basis.nodes), len(LENGTHS)), -np.inf)
            out[places] = self._gains_of(places) if self._every_gain is None else self._every_gain[places]
            self._node_gains[key] = out
            if nodes is None:
                self._every_gain = out
        return self._node_gains[key]

    def response_size(self, node: int, length: float) -> float:
        """Whitened length beside the constants of a node's most probable response at a length."""
        field = self.field
        places = list(field.basis.nodes[node].columns)
        own, across = field.gram[np.ix_(places, places)], self.half[:, places]
        inner = np.eye(len(places)) / length**2 + own - across.T @ across
        mean = np.linalg.solve(inner, field.gram[places, 0] - across.T @ self.half[:, 0])
        return math.sqrt(max(float(mean @ own @ mean), 0.0))

    @cached_property
    def group_gains(self) -> FloatArray:
        """Gain in log evidence of each group of the unknown at each length, shape (groups, lengths)."""
        return group_gains(self, list(self.field.basis.groups))

    def _gains_of(self, places: NDArray[np.intp]) -> FloatArray:
        field = self.field
        index = field._index[places]
        half = np.concatenate([self.half, np.zeros((len(self.half), 1))], axis=1)
        across = half[:, index]
        blocks = field._blocks[places] - np.einsum("kni,knj->nij", across, across)
        fits = field._fits[places] - np.einsum("kni,k->ni", across, self.half[:, 0])
        sizes, axes = np.linalg.eigh(0.5 * (blocks + blocks.transpose(0, 2, 1)))
        sizes = np.maximum(sizes, 0.0)
        along = np.einsum("nij,ni->nj", axes, fits)
        squares = LENGTHS[None, :, None] ** 2
        wider = 1.0 + squares * sizes[:, None, :]
        gains = 0.5 * (squares * along[:, None, :] ** 2 / wider - np.log(wider)).sum(axis=2)
        # The half of the prior of the wrong sign is cut away.
        sign_gains = np.zeros_like(gains)
        one = field.signs[places] > 0
        if one.any():
            fit, size = fits[one, 0][:, None], np.maximum(blocks[one, 0, 0], 0.0)[:, None]
            z = LENGTHS * fit / np.sqrt(1.0 + LENGTHS**2 * size)
            sign_gains[one] = log_ndtr(z) + np.log(2.0)
        self.sign_gains[places] = sign_gains
        return np.asarray(gains + sign_gains + field.log_weights[places])


def log_sum_exp(values: FloatArray) -> float:
    """Logarithm of the sum of exponentials; SciPy's takes longer to be called than to sum up."""
    top = float(values.max())
    return top + float(np.log(np.exp(values - top).sum())) if np.isfinite(top) else top


def by_candidate(nodes: Sequence[NodeColumns]) -> dict[str, NDArray[np.intp]]:
    """Indices of each candidate's nodes."""
    places: dict[str, list[int]] = {}
    for i, node in enumerate(nodes):
        places.setdefault(node.candidate, []).append(i)
    return {id: np.array(found) for id, found in places.items()}
