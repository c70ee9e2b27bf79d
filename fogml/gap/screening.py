"""Which nodes of a long grid are worth keeping: those that fit best by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fogml.gap.frame import Frame
from fogml.gap.shapes import Node
from fogml.runs.run import FloatArray

MOST_LINES_TRIED = 28
_FINER = 4


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
        beside = np.concatenate([fixed, *smooth], axis=1) if smooth else fixed
        self._sets: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        known = [] if others is None else [np.concatenate([fixed, others], axis=1)]
        for held in (fixed, beside, *known):
            inverse = np.linalg.inv(held.T @ held + np.eye(held.shape[1]))
            left = residual[:, 0] - held @ (inverse @ (held.T @ residual[:, 0]))
            self._sets.append((held, np.asarray(inverse, dtype=np.float64), left))

    def gains(self, columns: FloatArray, starts: Sequence[int]) -> list[FloatArray]:
        """Gain of each node, whose columns begin at `starts`, in nats, beside each of these."""
        gains = []
        for held, inverse, left in self._sets:
            cross = held.T @ columns
            fit = left @ columns
            edges = [*starts, columns.shape[1]]
            gain = np.empty(len(starts))
            width = columns.shape[1] // len(starts)
            if width * len(starts) == columns.shape[1] and np.all(np.diff(starts) == width):
                gain = _even_gains(columns, cross, inverse, fit, width)
            else:
                edges = [*starts, columns.shape[1]]
                for i, (a, b) in enumerate(pairwise(edges)):
                    gain[i] = _even_gains(columns[:, a:b], cross[:, a:b], inverse, fit[a:b], b - a)[0]
            gains.append(gain)
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
        for _, _, left in self._sets:
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


def _even_gains(
    columns: FloatArray, cross: FloatArray, inverse: FloatArray, fit: FloatArray, width: int
) -> FloatArray:
    """Gains of nodes of the same number of columns, in nats, shape (nodes,)."""
    count = columns.shape[1] // width
    grams = np.empty((count, width, width))
    weighed = inverse @ cross
    for a in range(width):
        for b in range(a, width):
            own = np.einsum("ij,ij->j", columns[:, a::width], columns[:, b::width])
            grams[:, a, b] = own - np.einsum("ij,ij->j", cross[:, a::width], weighed[:, b::width])
            grams[:, b, a] = grams[:, a, b]
    grams += 1e-6 * np.maximum(np.trace(grams, axis1=1, axis2=2), 1e-30)[:, None, None] * np.eye(width)
    fits = fit.reshape(count, width)
    return np.asarray(0.5 * np.einsum("ni,ni->n", fits, np.linalg.solve(grams, fits[:, :, None])[:, :, 0]))
