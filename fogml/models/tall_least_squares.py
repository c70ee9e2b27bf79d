"""Least squares over a great many rows, brought down to a few rows that say the same.

Rows ``[1, x, y]`` come in parts whose columns are built piece by piece, so the whole matrix
never exists. `condense` returns, for each fold, a small factor F with FᵀF equal to the sum
of squares and products of the fold's rows: whatever least squares asks of the rows it can
ask of F. Columns are shifted and scaled first. Fixed streams of pieces run in threads with
one BLAS thread each, so the result does not depend on the number of threads.

Two ways, chosen by themselves:

- QR of each piece stacked under the factor so far (Golub & Van Loan, Matrix Computations,
  4th ed., 5.3; the sequential TSQR of Demmel et al., 2012). Always safe.
- For tall problems, the triangular factor of a sample of rows, taken from the right of every
  row, makes the columns nearly orthonormal; then their products can be summed without loss
  (preconditioned Cholesky QR: Yamamoto et al., ETNA 44, 2015; Fan et al., SIAM J. Sci.
  Comput. 43, 2021). Three times as fast. Left for the first way where the sample does not
  tell the columns apart, that is where rows are rank-deficient or nearly so.

Products of raw columns, the normal equations, are never formed: they square a condition
number that is 1e15 already for raw powers up to T**7.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.processes import available_cores, one_thread

PIECE_ROWS = 4096
_STREAMS = 8
_SAMPLE_ROWS = 8192
_TALL_ROWS = 50_000
# Largest condition of the sample's factor, and of the sums in its basis, for the quick way:
# together they leave at least as many digits as a QR of the columns in double precision.
_LARGEST_SAMPLE_CONDITION = 1e9
_LARGEST_BASIS_CONDITION = 1e4


@dataclass(frozen=True)
class Part:
    """Rows of one run, or of one array.

    Attributes
    ----------
    target
        Values y, shape (n,).
    columns
        Gives the columns x of a slice of the rows, shape (rows in the slice, k).
    folds
        Fold of each row from 0, constant over stretches of rows, shape (n,).
    """

    target: FloatArray
    columns: Callable[[slice], FloatArray]
    folds: IndexArray

    def pieces(self) -> Iterator[tuple[slice, int]]:
        """Slices of at most `PIECE_ROWS` rows of one fold, with the fold."""
        edges = [0, *(np.flatnonzero(np.diff(self.folds)) + 1).tolist(), len(self.target)]
        for start, stop in pairwise(edges):
            for first in range(start, stop, PIECE_ROWS):
                yield slice(first, min(first + PIECE_ROWS, stop)), int(self.folds[start])


@dataclass(frozen=True)
class Condensed:
    """Factors of the shifted and scaled rows ``[1, (x - shift)/scale, y - y_shift]`` by fold.

    ``factors[f]`` has shape (at most k + 2 rows, k + 2) and ``counts[f]`` rows stand behind it.
    """

    factors: tuple[FloatArray, ...]
    counts: IndexArray
    shift: FloatArray
    scale: FloatArray
    y_shift: float


def condense(parts: Sequence[Part], n_folds: int) -> Condensed:
    """Bring the rows of all parts down to one small factor for each fold."""
    # Threads within BLAS only slow matrices this narrow; rows are shared among threads instead.
    with one_thread("blas"):
        return _condense(parts, n_folds)


def _condense(parts: Sequence[Part], n_folds: int) -> Condensed:
    n_rows = sum(len(part.target) for part in parts)
    counts = np.sum([np.bincount(part.folds, minlength=n_folds) for part in parts], axis=0)
    sample_x, sample_y = _sample(parts, n_rows)
    shift, y_shift = sample_x.mean(axis=0), float(sample_y.mean())
    scale = sample_x.std(axis=0)
    flat = scale <= 1e-13 * np.abs(shift)
    scale[flat | (scale == 0.0)] = 1.0
    frame = _Frame(shift, scale, y_shift)
    factors = None
    if n_rows >= _TALL_ROWS:
        factors = _by_products(parts, n_folds, frame, sample_x, sample_y)
    if factors is None:
        factors = _by_stacked_qr(parts, n_folds, frame)
    return Condensed(tuple(factors), counts, shift, scale, y_shift)


@dataclass(frozen=True)
class _Frame:
    shift: FloatArray
    scale: FloatArray
    y_shift: float

    def rows(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Rows [1, scaled x, shifted y]."""
        rows = np.empty((len(y), x.shape[1] + 2))
        rows[:, 0] = 1.0
        np.subtract(x, self.shift, out=rows[:, 1:-1])
        rows[:, 1:-1] /= self.scale
        np.subtract(y, self.y_shift, out=rows[:, -1])
        return rows


def _sample(parts: Sequence[Part], n_rows: int) -> tuple[FloatArray, FloatArray]:
    stride = max(1, n_rows // _SAMPLE_ROWS)
    slices = [(part, slice(0, len(part.target), stride)) for part in parts if len(part.target)]
    return (
        np.concatenate([part.columns(rows) for part, rows in slices]),
        np.concatenate([part.target[rows] for part, rows in slices]),
    )


def _by_stacked_qr(parts: Sequence[Part], n_folds: int, frame: _Frame) -> list[FloatArray]:
    width = len(frame.shift) + 2

    def stream(pieces: list[tuple[Part, slice, int]]) -> list[FloatArray]:
        stacks = [np.empty((0, width)) for _ in range(n_folds)]
        for part, rows, fold in pieces:
            new = frame.rows(part.columns(rows), part.target[rows])
            stacks[fold] = _triangle(np.concatenate((stacks[fold], new)))
        return stacks

    streams = _run_streams(parts, stream)
    return [_triangle(np.concatenate([stacks[fold] for stacks in streams])) for fold in range(n_folds)]


def _by_products(
    parts: Sequence[Part], n_folds: int, frame: _Frame, sample_x: FloatArray, sample_y: FloatArray
) -> list[FloatArray] | None:
    """Factors from products in the sample's basis, or None where that would lose digits."""
    sample = frame.rows(sample_x, sample_y)
    whole = _triangle(sample)
    triangle, image = whole[:-1, :-1], whole[:-1, -1]
    if triangle.shape[0] < triangle.shape[1] or np.linalg.cond(triangle) > _LARGEST_SAMPLE_CONDITION:
        return None
    root = np.sqrt(len(sample))
    triangle = triangle / root
    # y enters as what the sample's solution leaves of it, so that a close fit cancels nothing.
    inverse = np.linalg.inv(triangle)
    guess = inverse @ image / root
    n_x = len(frame.shift)
    # One product takes raw columns to the basis and to the residual: x @ to_basis + offset.
    to_basis = np.column_stack((inverse[1:], -guess[1:])) / frame.scale[:, None]
    offset = np.append(inverse[0], -guess[0] - frame.y_shift) - frame.shift @ to_basis

    def stream(pieces: list[tuple[Part, slice, int]]) -> FloatArray:
        sums = np.zeros((n_folds, n_x + 2, n_x + 2))
        for part, rows, fold in pieces:
            basis = part.columns(rows) @ to_basis
            basis += offset
            basis[:, -1] += part.target[rows]
            sums[fold] += basis.T @ basis
        return sums

    sums = np.sum(_run_streams(parts, stream), axis=0)
    spread = np.linalg.eigvalsh(sums.sum(axis=0)[:-1, :-1])
    if not spread[0] > spread[-1] / _LARGEST_BASIS_CONDITION:
        return None
    back = np.zeros((n_x + 2, n_x + 2))
    back[:-1, :-1] = triangle
    back[-1, -1] = 1.0
    back[:-1, -1] = triangle @ guess
    return [_root(total) @ back for total in sums]


def _root(products: FloatArray) -> FloatArray:
    """A factor F with FᵀF equal to a positive semidefinite matrix."""
    # The last column, what is left of y, may be far smaller than the rest: scaled apart.
    size = np.sqrt(np.maximum(np.diag(products), 0.0))
    size[size == 0.0] = 1.0
    values, vectors = np.linalg.eigh(products / np.outer(size, size))
    return np.asarray((np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T) * size)


def _triangle(rows: FloatArray) -> FloatArray:
    if len(rows) <= 1:
        return rows
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _run_streams(parts: Sequence[Part], stream: Callable[[list[tuple[Part, slice, int]]], Any]) -> list[Any]:
    pieces = [(part, rows, fold) for part in parts for rows, fold in part.pieces()]
    if len(pieces) < 2 * _STREAMS:
        return [stream(pieces)]
    edges = np.linspace(0, len(pieces), _STREAMS + 1).astype(int).tolist()
    shares = [pieces[start:stop] for start, stop in pairwise(edges)]
    with ThreadPoolExecutor(max_workers=min(_STREAMS, available_cores())) as pool:
        return list(pool.map(stream, shares))
