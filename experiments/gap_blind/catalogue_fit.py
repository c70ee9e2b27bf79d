"""What one or two effects of the catalogue, at their best shapes and amplitudes, leave of a signal.

Lengths are whitened and beside the nominal constants, so that half of a square is a log likelihood ratio
between the signal and what is put in its place [nats]. Amplitudes beyond the card's ranges cost what they
do in a diagnosis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fogml.gap.basis import stands_still
from fogml.gap.candidate_columns import NodeColumns, candidate_columns
from fogml.gap.frame import Frame
from fogml.gap.model import Candidate
from fogml.gap.priors import FURTHER_DECADES
from fogml.gap.screening import Screening
from fogml.runs.run import FloatArray

FIRSTS = 12
"""Candidates that a second one is looked for beside: those that leave the least alone."""
_SINGULAR = 1e-8


class Pair(NamedTuple):
    """Two candidates and what they leave [nats]."""

    ids: tuple[str, str]
    left: float


class CatalogueFit:
    """Fits of a signal by the candidates' nodes.

    Parameters
    ----------
    frame
        The runs.
    signal
        Whitened and beside the constants, shape (n,).
    candidates
        What may be named.
    grade
        Whose ranges are usual.
    """

    def __init__(
        self, frame: Frame, signal: FloatArray, candidates: Mapping[str, Candidate], grade: str
    ) -> None:
        screening = Screening(frame, [])
        self._nodes: list[NodeColumns] = []
        self._places: list[slice] = []
        blocks, first = [np.zeros((len(signal), 0))], 0
        self._largest = {id: c.amplitude.of_any_grade[1] for id, c in candidates.items()}
        for candidate in candidates.values():
            if stands_still(candidate, frame):
                continue
            for node, columns in candidate_columns(candidate, frame, grade, screening):
                blocks.append(frame.without_constants(columns))
                self._nodes.append(node)
                self._places.append(slice(first, first + columns.shape[1]))
                first += columns.shape[1]
        columns = np.concatenate(blocks, axis=1)
        self._gram, self._fits = columns.T @ columns, columns.T @ signal
        self.energy = 0.5 * float(signal @ signal)
        self._gains = [self._gain(k, self._gram, self._fits) for k in range(len(self._nodes))]
        ranked = sorted(range(len(self._nodes)), key=self._gains.__getitem__)
        self._best = {self._nodes[k].candidate: k for k in ranked}

    def singles(self) -> dict[str, float]:
        """What each candidate leaves alone [nats]."""
        return {id: self.energy - self._gains[k] for id, k in self._best.items()}

    def pair(self) -> Pair | None:
        """The two candidates that leave the least together; None where there are no two."""
        best: Pair | None = None
        singles = self.singles()
        for id in sorted(singles, key=singles.__getitem__)[:FIRSTS]:
            k = self._best[id]
            for _ in range(2):
                # The second one beside the first, then the first one beside that.
                beside = self._beside(k)
                others = [
                    j for j, node in enumerate(self._nodes) if node.candidate != self._nodes[k].candidate
                ]
                if not others:
                    return None
                gains = {j: self._gain(j, *beside) for j in others}
                j = max(gains, key=gains.__getitem__)
                left = self.energy - self._gains[k] - gains[j]
                if best is None or left < best.left:
                    best = Pair((self._nodes[k].candidate, self._nodes[j].candidate), left)
                k = j
        return best

    def _beside(self, k: int) -> tuple[FloatArray, FloatArray]:
        """Inner products of everything beside a node's columns."""
        own = self._places[k]
        inverse = _inverse(self._gram[own, own], self._gram[own, own])
        across = self._gram[:, own] @ inverse
        return self._gram - across @ self._gram[own], self._fits - across @ self._fits[own]

    def _gain(self, k: int, gram: FloatArray, fits: FloatArray) -> float:
        """What a node takes of the signal, less what an amplitude out of its range costs [nats]."""
        own = self._places[k]
        at_best = _inverse(gram[own, own], self._gram[own, own]) @ fits[own]
        taken = 0.5 * float(fits[own] @ at_best)
        length = math.sqrt(max(float(at_best @ self._gram[own, own] @ at_best), 0.0))
        node = self._nodes[k]
        above = max(math.log10(max(length * node.size, 1e-300) / self._largest[node.candidate]), 0.0)
        return taken - 0.5 * (above / FURTHER_DECADES) ** 2


def _inverse(inner: FloatArray, whole: FloatArray) -> FloatArray:
    """Of inner products, without the directions of which hardly anything is left of the whole."""
    values, vectors = np.linalg.eigh(inner)
    kept = values > _SINGULAR * max(float(np.trace(whole)), 1e-300)
    return np.asarray((vectors[:, kept] / values[kept]) @ vectors[:, kept].T)
