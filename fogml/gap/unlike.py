"""What makes an unknown unknown: it is unlike every candidate.

Groups of the unknown are wide enough to follow an effect that is known as well as its own equation does.
Such a signal is not unknown. Of a group's probability only that part counts in which its signal is
unlike every candidate at its best shape.
"""

from __future__ import annotations

import math

import numpy as np

from fogml.gap.evidence import Conditioned, Field
from fogml.runs.run import FloatArray

RELATIVE = 0.95
"""Cosine beside the constants from which two signals are relatives, as in the check on withheld effects."""
DRAWS = 100
USUAL_COLUMNS = 400
"""Draws stay the same up to so many columns of a group."""
LEAST_AXIS = 0.1
"""Axes of a candidate's node with less of the first one's energy are left out."""
NEAR = 0.6
"""Squared cosine of the mean signal with a node, under which no draw is near it."""
MOSTLY = 0.5
"""Share of a group's signals that may be like a candidate's for it to count as an unknown in full."""
_LARGEST = 1.0 - 1.0 / DRAWS


class Unlike:
    """How much of a group's probability lies away from the candidates.

    Parameters
    ----------
    field
        Inner products beside the constants.
    without
        Ids of candidates that don't count.
    """

    def __init__(self, field: Field, without: frozenset[str] = frozenset()) -> None:
        self._field = field
        widest = max(map(len, field.basis.groups.values()), default=0)
        self._normal = np.random.default_rng(0).standard_normal((DRAWS, max(widest, USUAL_COLUMNS)))
        gram = field.gram
        main = [
            [c for c in node.columns if gram[c, c] >= LEAST_AXIS * gram[node.columns[0], node.columns[0]]]
            for node in field.basis.nodes
            if node.candidate not in without
        ]
        width = max(map(len, main), default=1)
        self._index = np.array([p + [p[0]] * (width - len(p)) for p in main], np.intp).reshape(-1, width)
        used = np.array([[i < len(p) for i in range(width)] for p in main], bool).reshape(-1, width)
        both = used[:, :, None] & used[:, None, :]
        blocks = gram[self._index[:, :, None], self._index[:, None, :]] * both
        blocks += np.eye(width) * (1e-9 + ~used[:, :, None])
        # Brings inner products with a node's columns to an orthonormal frame of what they span.
        self._frames = np.linalg.inv(np.linalg.cholesky(blocks)) * used[:, None, :]
        self._across: dict[str, FloatArray] = {}
        self._prior: dict[str, float] = {}

    def log_share(self, held: Conditioned, name: str, length: float) -> float:
        """Logarithm of how much less probable a group is for signals like a candidate's.

        ::

            (1 - P(like a candidate | data)) / (1 - P(like a candidate))

        Parameters
        ----------
        held
            The field with a set of effects and the group integrated out, the group's term last.
        name, length
            The group and the length of its columns' coefficients.
        """
        if not len(self._index):
            return 0.0
        places = self._field.basis.groups[name]
        k = len(places)
        mean, covariance = held.coefficients()
        factor = np.linalg.cholesky(covariance[-k:, -k:] + 1e-12 * length**2 * np.eye(k))
        after = self._like(name, mean[-k:] + self._normal[:, :k] @ factor.T)
        if name not in self._prior:
            self._prior[name] = self._like(name, self._normal[:, :k])
        # A group that holds hardly anything but a candidate is no unknown, however alike all its signals are.
        before = min(self._prior[name], MOSTLY)
        return math.log1p(-after * _LARGEST) - math.log1p(-before * _LARGEST)

    def _like(self, name: str, draws: FloatArray) -> float:
        """Share of draws of a group's coefficients, shape (draws, k), whose signal is like a candidate's."""
        places = self._field.basis.groups[name]
        if name not in self._across:
            gram = self._field.gram
            self._across[name] = self._frames @ gram[self._index[:, :, None], places]
        across = self._across[name]
        sizes = np.diagonal(self._field.gram)[places]
        centre = draws.mean(axis=0)
        near = np.sum((across @ centre) ** 2, axis=1) > NEAR * float(sizes @ centre**2)
        if np.abs(centre).max() < 0.5 * np.abs(draws).max():
            near[:] = True
        if not near.any():
            return 0.0
        along = np.sum((across[near] @ draws.T) ** 2, axis=1).max(axis=0)
        return float(np.mean(along > RELATIVE**2 * (draws**2 @ sizes)))
