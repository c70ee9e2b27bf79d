"""What each group of the unknown gains beside a set of effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.priors import LENGTHS
from fogml.runs.run import FloatArray

if TYPE_CHECKING:
    from fogml.gap.evidence import Conditioned


_CORNER = 1e14
"""Over the squared length of v: above v' M^-1 v, as M is no nearer to singular than rounding."""


def group_gains(held: Conditioned, names: Sequence[str]) -> FloatArray:
    """Gain in log evidence of groups of the unknown at each of `LENGTHS`, shape (groups, lengths).

    With s the inner products of a group's columns beside the constants, which are diagonal, H those of the
    terms, of which the field keeps the whitened half, and w = l^2 / (1 + l^2 s) for a length l ::

        gain = 1/2 (sum w b^2 + v' M^-1 v - sum log(1 + l^2 s) - log det M)
        M = 1 - H w H',   v = H w b

    where b are the columns' inner products with the data beside constants and terms.

    Parameters
    ----------
    held
        The field with a set of effects integrated out.
    names
        Of the groups.
    """
    gram, k, count = held.field.gram, len(held.half), len(LENGTHS)
    sizes = np.diagonal(gram)
    squares = LENGTHS[:, None] ** 2
    # The factor of M with v as one row more ends in v' L^-1, whatever its last corner is.
    whole = np.empty((len(names), count, k + 1, k + 1))
    gains = np.empty((len(names), count))
    for i, name in enumerate(names):
        places = held.field.basis.groups[name]
        wider = 1.0 + squares * sizes[places]
        weights = squares / wider
        across = held.half[:, places]
        fit = gram[places, 0] - across.T @ held.half[:, 0]
        weighed = (weights[:, None, :] * across).reshape(count * k, len(places))
        whole[i, :, :k, :k] = np.eye(k) - (weighed @ across.T).reshape(count, k, k)
        whole[i, :, k, :k] = (weighed @ fit).reshape(count, k)
        gains[i] = weights @ fit**2 - np.log(wider).sum(axis=1)
    sides = whole[..., k, :k]
    whole[..., k, k] = _CORNER * (1.0 + np.einsum("glk,glk->gl", sides, sides))
    factors = np.linalg.cholesky(whole)
    last = factors[..., k, :k]
    gains += np.einsum("glk,glk->gl", last, last)
    gains -= 2.0 * np.log(np.diagonal(factors, axis1=2, axis2=3)[..., :k]).sum(axis=2)
    return np.asarray(0.5 * gains)
