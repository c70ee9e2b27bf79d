"""Where a network's centres begin: k-means, or orthogonal least squares."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.processes import one_thread

MOST_CANDIDATES = 5000
"""Rows among which centres are sought; more rows are thinned evenly."""
_WIDEST = 1.0
_DEPENDENT = 1e-9
# Share of a column's square that must be left after projection for it to be chosen.


def thinned(rows: FloatArray, most: int = MOST_CANDIDATES) -> FloatArray:
    """Evenly spaced rows, at most `most` of them."""
    return rows[thinned_rows(len(rows), most)]


def thinned_rows(count: int, most: int) -> IndexArray:
    """Evenly spaced indices of `count` rows, at most `most` of them."""
    return np.linspace(0, count - 1, min(most, count)).round().astype(np.intp)


def kmeans_centres(rows: FloatArray, count: int, seed: int) -> FloatArray:
    """Centres of `count` clusters of the rows, or of as many as there are distinct rows; shape (j, d)."""
    from sklearn.cluster import KMeans

    sample = thinned(rows)
    distinct = np.unique(sample, axis=0)
    if len(distinct) <= count:
        return distinct
    # Threads would add up in an order that changes from call to call.
    with one_thread("openmp"):
        found = KMeans(count, n_init=1, max_iter=30, random_state=seed).fit(sample)
    return np.asarray(found.cluster_centers_, dtype=np.float64)


def orthogonal_least_squares(
    products: Callable[[int], FloatArray],
    squares: FloatArray,
    images: FloatArray,
    count: int,
    forced: int = 0,
) -> IndexArray:
    """Greedy choice of columns, each the one that explains most of what is left of the target.

    Chen, Cowan & Grant, IEEE Trans. Neural Networks 2 (1991) 302: the candidate with the largest
    error reduction ratio after orthogonalisation against those chosen. Only the products of a
    chosen column with all others are asked for, so k choices among m candidates take O(k^2 m)
    and k calls.

    Parameters
    ----------
    products
        Gives ``P' p_i``, shape (m,), for a candidate i.
    squares
        Squares of the candidates, the diagonal of ``P'P``, shape (m,).
    images
        Their products with the target, ``P'y``, shape (m,).
    count
        Number of columns to choose, the forced ones included.
    forced
        The first so many candidates are chosen first, in order, unless they depend on each other.

    Returns
    -------
    Indices in order of choice; fewer than `count` where the rest depends on those chosen.
    """
    left = squares.astype(np.float64, copy=True)
    image = images.astype(np.float64, copy=True)
    free = squares > 0.0
    rows = np.empty((count, len(squares)))
    chosen: list[int] = []
    for step in range(min(count, len(squares))):
        usable = free & (left > _DEPENDENT * squares)
        if not usable.any():
            break
        if step < forced:
            best = step
            if not usable[best]:
                continue
        else:
            gain = np.where(usable, image**2 / np.where(usable, left, 1.0), -1.0)
            best = int(np.argmax(gain))
        taken = len(chosen)
        row = products(best) - rows[:taken, best] @ rows[:taken]
        root = np.sqrt(left[best])
        row /= root
        rows[taken] = row
        image -= row * (image[best] / root)
        left -= row**2
        free[best] = False
        chosen.append(best)
    return np.array(chosen, dtype=np.intp)


def ols_centres(
    inputs: FloatArray, linear: FloatArray, target: FloatArray, widths: FloatArray, count: int
) -> FloatArray:
    """Centres by orthogonal least squares among the rows, beside a linear part; shape (j, d).

    Parameters
    ----------
    inputs
        Network inputs, shape (n, d).
    linear
        Columns always in the model, shape (n, p).
    target
        Shape (n,).
    widths
        Width of every candidate along each input, shape (d,); at most one standard deviation is used.
    count
        Number of centres.
    """
    candidates = np.unique(thinned(inputs), axis=0)
    # Wide columns tell little apart and soon depend on each other.
    widths = np.minimum(widths, _WIDEST)
    basis, _ = np.linalg.qr(linear)
    scaled, places = inputs / widths, candidates / widths
    columns = -2.0 * (scaled @ places.T)
    columns += (scaled**2).sum(axis=1)[:, None]
    columns += (places**2).sum(axis=1)
    np.exp(np.negative(columns, out=columns), out=columns)
    columns -= basis @ (basis.T @ columns)
    rest = target - basis @ (basis.T @ target)
    chosen = orthogonal_least_squares(
        lambda i: np.asarray(columns[:, i] @ columns),
        np.einsum("ij,ij->j", columns, columns),
        rest @ columns,
        count,
    )
    return candidates[chosen]
