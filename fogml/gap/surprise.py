"""Whether another explanation does better than it would if the one that was found were true.

Another explanation follows some of the signal of the true one, and some noise; how much, is known. One
that follows the runs by far better than that sees something in them that the found one does not make.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from fogml.gap.evidence import Field, Term

LEAST_SPREAD = 1.0
"""Chance moves what another explanation gains by so much at least [nats]: shapes are refined to the runs."""
_ROUNDING = 1e-9


def surprise(field: Field, found: Sequence[Term], other: Sequence[Term]) -> float:
    """How much better `other` does than it would if `found` were true, in standard deviations.

    With what `found` most probably makes, s, the rows r that its columns leave of the data, and the gain
    q / 2 of `other` but for what does not depend on the data ::

        q = |B y|^2,    B = (1 + D F'F D)^-1/2 D F'
        y = s + r,      r ~ N(0, 1 - P)    if `found` is true
        E q = |B s|^2 + tr W,    var q = 4 (B s)' W B s + 2 tr W^2,    W = B (1 - P) B'

    where F are the columns of `other`, D their lengths, and P projects on the columns of `found`, all
    beside the constants. Moments of quadratic forms are those of normal variables.

    Parameters
    ----------
    field
        Inner products beside the constants.
    found, other
        Terms of both explanations.
    """
    if not found or not other:
        return 0.0
    gram = field.gram
    own = np.array([c for t in found for c in t.columns], dtype=np.intp)
    places = np.array([c for t in other for c in t.columns], dtype=np.intp)
    scale = np.array([t.length for t in other for _ in t.columns])
    inner = scale[:, None] * gram[np.ix_(places, places)] * scale
    factor = np.linalg.cholesky(np.eye(len(places)) + 0.5 * (inner + inner.T))

    def seen(columns: np.ndarray) -> np.ndarray:
        """B times columns of which inner products with those of `other` are given."""
        return np.asarray(solve_triangular(factor, scale[:, None] * columns, lower=True))

    mean, _ = field.condition(found).coefficients()
    across = seen(gram[np.ix_(places, own)])
    values, axes = np.linalg.eigh(gram[np.ix_(own, own)])
    used = values > _ROUNDING * values[-1]
    along = across @ (axes[:, used] / np.sqrt(values[used]))
    left = solve_triangular(factor, solve_triangular(factor, inner, lower=True).T, lower=True)
    left = left - along @ along.T
    signal, data = across @ mean, seen(gram[places, 0][:, None])[:, 0]
    gain = 0.5 * float(data @ data - signal @ signal - np.trace(left))
    variance = float(signal @ left @ signal + 0.5 * np.sum(left**2))
    return gain / math.sqrt(max(variance, 0.0) + LEAST_SPREAD**2)
