"""Which nodes of a long grid are worth keeping: those that fit best by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular

from fogml.gap.frame import Frame
from fogml.gap.shapes import Node
from fogml.runs.run import FloatArray

MOST_LINES_TRIED = 28
_FINER = 4
# Of a Gram matrix's trace: beside what is held; and before, of which round-off alone may be left.
_RIDGE = 1e-6
_ROUND_OFF = 1e-10
_NOTHING = 1e-36


class Screening:
    """How well single columns fit beside the constants, and beside smooth unknowns or others as well.

    Parameters
    ----------
    frame
        The runs.
    groups
        Whitened columns of each group of the unknown.
    others
        Whitened columns of what else may act; nothing if None.
    """

    def __init__(self, frame: Frame, groups: Sequence[FloatArray], others: FloatArray | None = None) -> None:
        self._runs = frame.runs
        self._steps_s = [o.row_s for o in frame.observations]
        residual, fixed = frame.residual, frame.fixed
        smooth = [g for g in groups if g.shape[1] <= 24]
        known = [] if others is None else [others]
        self._held = np.concatenate([fixed, *smooth, *known], axis=1)
        own, wide = fixed.shape[1], fixed.shape[1] + sum(g.shape[1] for g in smooth)
        every = np.arange(self._held.shape[1])
        sets = [every[:own], every[:wide]]
        if known:
            sets.append(np.concatenate([every[:own], every[wide:]]))
        gram, fit = self._held.T @ self._held, self._held.T @ residual[:, 0]
        self._sets: list[tuple[NDArray[np.intp], FloatArray]] = []
        left = []
        for places in sets:
            factor = np.linalg.cholesky(gram[np.ix_(places, places)] + np.eye(len(places)))
            self._sets.append((places, np.asarray(factor, dtype=np.float64)))
            left.append(residual[:, 0] - self._held[:, places] @ cho_solve((factor, True), fit[places]))
        self._left = np.array(left)

    def gains(self, columns: FloatArray, starts: Sequence[int]) -> FloatArray:
        """Gain of each node, whose columns begin at `starts`, in nats, beside each of these.

        Shape (ways to screen, nodes).
        """
        cross, fits = self._held.T @ columns, self._left @ columns
        gains = np.empty((len(self._sets), len(starts)))
        width = columns.shape[1] // len(starts)
        if width * len(starts) == columns.shape[1] and np.all(np.diff(starts) == width):
            return self._even_gains(columns, cross, fits, width)
        for i, (a, b) in enumerate(pairwise([*starts, columns.shape[1]])):
            gains[:, i] = self._even_gains(columns[:, a:b], cross[:, a:b], fits[:, a:b], b - a)[:, 0]
        return gains

    def _even_gains(self, columns: FloatArray, cross: FloatArray, fits: FloatArray, width: int) -> FloatArray:
        """Gains of nodes of the same number of columns, in nats, shape (ways to screen, nodes)."""
        count = columns.shape[1] // width
        own = _products(columns, columns, width)
        gains = np.empty((len(self._sets), count))
        for i, (places, factor) in enumerate(self._sets):
            half = solve_triangular(factor, cross[places], lower=True, check_finite=False)
            grams = own - _products(half, half, width)
            before, beside = (np.trace(part, axis1=1, axis2=2) for part in (own, grams))
            least = np.maximum.reduce([_RIDGE * beside, _ROUND_OFF * before, np.full(count, _NOTHING)])
            grams += least[:, None, None] * np.eye(width)
            fit = fits[i].reshape(count, width)
            gains[i] = 0.5 * np.einsum("ni,ni->n", fit, np.linalg.solve(grams, fit[:, :, None])[:, :, 0])
        return gains

    def lines(self, nodes: Sequence[Node]) -> tuple[list[int], int | None]:
        """The nodes whose frequencies stand out in the periodogram, and the middle one of the others.

        All and None where they are no lines in time.
        """
        frequencies = np.array([np.nan if n.frequency_hz is None else n.frequency_hz for n in nodes])
        if np.isnan(frequencies).any() or len(nodes) <= MOST_LINES_TRIED:
            return list(range(len(nodes))), None
        kept: set[int] = set()
        total = np.zeros(len(nodes))
        for left in self._left:
            power = np.zeros(len(nodes))
            for run, step in zip(self._runs, self._steps_s):
                part = left[run]
                length = _FINER * len(part)
                spectrum = np.abs(np.fft.rfft(part, length)) ** 2 / len(part)
                places = np.rint(frequencies * step * length).astype(np.intp)
                power += spectrum[np.minimum(places, len(spectrum) - 1)]
            kept |= set(np.argsort(power)[::-1][: MOST_LINES_TRIED // 2].tolist())
            total += power
        others = [i for i in np.argsort(total).tolist() if i not in kept]
        return sorted(kept), others[len(others) // 2] if others else None


def _products(first: FloatArray, second: FloatArray, width: int) -> FloatArray:
    """Inner products of the columns of each node, `width` columns each, shape (nodes, width, width)."""
    products = np.empty((first.shape[1] // width, width, width))
    for a in range(width):
        for b in range(a, width):
            products[:, a, b] = np.einsum("ij,ij->j", first[:, a::width], second[:, b::width])
            products[:, b, a] = products[:, a, b]
    return products
