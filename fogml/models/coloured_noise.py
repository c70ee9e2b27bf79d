"""What rows tell of linear coefficients when their noise is coloured and not known beforehand.

The noise of block means is white, flicker and random walk together. How much of each the rows themselves
tell, by the restricted likelihood, in which what the coefficients absorb is accounted for (H. Patterson &
R. Thompson, Biometrika 58 (1971) 545); the covariance is averaged over all mixtures, each weighed by its
likelihood, as a short run tells little of slow noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from fogml.runs.run import FloatArray

MOST_MEANS = 128
"""Block means that rows are averaged down to: slow noise shows in so many, and their covariance is inverted
for each noise model."""
FLICKER = (0.0, *(4.0**power for power in range(-4, 2)))
"""Variances of flicker noise in an octave of time scales that are weighed, over that of white noise."""
WALK = (0.0, *(4.0**power for power in range(-7, 1)))
"""Variances of a random walk's step from one block to the next that are weighed, over that of white noise."""


def whitened_rows(
    columns: FloatArray, target: FloatArray, groups: ArrayLike | None = None, time: ArrayLike | None = None
) -> tuple[FloatArray, float]:
    """Rows whose noise is white and of variance one, from rows in time order whose noise is coloured.

    Parameters
    ----------
    columns, target
        Shapes (n, k) and (n,); the columns hold a constant.
    groups
        Labels of the runs, shape (n,); by default one run. Noise of different runs is independent.
    time
        Times of the rows [s], shape (n,); by default rows follow each other evenly.

    Returns
    -------
    rows
        Block means of ``[columns, target]``, whitened under the covariance of the noise averaged over its
        models, shape (m, k + 1).
    freedom
        Degrees of freedom behind the variance.
    """
    means, label, clock = _block_means(np.column_stack([columns, target]), groups, time)
    count, width = len(means), columns.shape[1]
    if count <= width:
        # Too few to tell noise from drift: all that moves is noise.
        return means / max(float(means[:, -1].std()), 1e-12), 1.0
    white, (flicker, walk) = np.eye(count), _slow(label, clock)
    scaled = means / np.maximum(np.abs(means).max(axis=0), 1e-300)
    found: list[tuple[float, float, float, float]] = []
    for a in FLICKER:
        for b in WALK:
            factor = np.linalg.cholesky(white + a * flicker + b * walk)
            triangle = np.linalg.qr(solve_triangular(factor, scaled, lower=True), mode="r")
            diagonal = np.maximum(np.abs(np.diag(triangle)), 1e-150)
            restricted = -np.log(np.diag(factor)).sum() - np.log(diagonal[:-1]).sum()
            likelihood = float(restricted) - (count - width) * float(np.log(diagonal[-1]))
            found.append((likelihood, diagonal[-1] ** 2, a, b))
    weights = np.exp(np.array([one[0] for one in found]) - max(one[0] for one in found))
    weights *= np.array([one[1] for one in found]) / weights.sum()
    own = weights.sum() * white
    own += sum(w * a for w, (*_, a, _) in zip(weights, found)) * flicker
    own += sum(w * b for w, (*_, b) in zip(weights, found)) * walk
    variance = max(float(np.abs(means[:, -1]).max()), 1e-12) ** 2 / (count - width)
    factor = np.linalg.cholesky(variance * own)
    return np.asarray(solve_triangular(factor, means, lower=True)), float(count - width)


def _block_means(
    values: FloatArray, groups: ArrayLike | None, time: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means of consecutive rows of one group, their group's number, and their times in blocks."""
    count = len(values)
    clock = np.arange(count, dtype=np.float64) if time is None else np.asarray(time, dtype=np.float64)
    labels = np.zeros(count) if groups is None else np.unique(np.asarray(groups), return_inverse=True)[1]
    size = -(-count // MOST_MEANS)
    fresh = np.flatnonzero(np.append(True, labels[1:] != labels[:-1]))
    # Blocks start anew with each group.
    place = np.arange(count) - fresh[np.searchsorted(fresh, np.arange(count), side="right") - 1]
    starts = np.flatnonzero(place % size == 0)
    weights = np.diff(np.append(starts, count))
    means = np.add.reduceat(np.column_stack([values, clock]), starts, axis=0) / weights[:, None]
    # A last block of fewer rows is noisier: it goes, unless its run has no other.
    whole = (weights == size) | ~np.isin(labels[starts], labels[starts][weights == size])
    times = means[whole, -1]
    inside = np.diff(times)[np.diff(labels[starts][whole]) == 0]
    step = float(np.median(inside)) if len(inside) and np.median(inside) > 0.0 else 1.0
    return means[whole, :-1], np.asarray(labels[starts][whole], dtype=np.float64), times / step


def _slow(label: FloatArray, clock: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Covariance of flicker noise, a sum of exponentials over octaves of time scales, and of random walks.

    A walk's start is free where the columns hold a constant, and is that of its run otherwise.
    """
    same = label[:, None] == label[None, :]
    apart = np.abs(clock[:, None] - clock[None, :])
    span = max(float(apart[same].max()), 1.0)
    octaves = 2.0 ** np.arange(np.ceil(np.log2(span)) + 1)
    flicker = np.zeros_like(apart)
    for scale in octaves:
        flicker += np.exp(-apart / scale)
    begin = np.array([clock[label == one].min() for one in label])
    since = clock - begin
    walk = np.minimum(since[:, None], since[None, :])
    return np.where(same, flicker, 0.0), np.where(same, walk, 0.0)
