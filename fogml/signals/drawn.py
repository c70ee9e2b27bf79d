"""Fewer points for drawing: what is seen stays, and gaps are drawn as gaps.

For drawing only. No figure in a table or a JSON file ever comes from a reduced series.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IndexArray
from fogml.signals import large

DRAWN_POINTS = 4000
"""Points per trace above which a series is reduced."""
LONGEST_STEP = 2.5
"""A step longer than this many median steps is drawn as a gap."""


def gap_starts(time: ArrayLike, longest: float = LONGEST_STEP) -> IndexArray:
    """Indices of the samples that follow a gap, for times of shape (n,) in any unit."""
    steps = np.diff(np.asarray(time, dtype=np.float64))
    if steps.size == 0:
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero(steps > longest * np.median(steps)) + 1


def min_max_indices(values: ArrayLike, points: int = DRAWN_POINTS) -> IndexArray:
    """Indices of at most ``points`` samples that keep every bucket's least and greatest value.

    The first and the last sample stay as well, so a curve's ends do not move.

    Parameters
    ----------
    values
        Shape (n,), any unit; NaN is passed over.
    points
        At least 4.

    Returns
    -------
    IndexArray
        Increasing indices; all of them where n is at most ``points``.
    """
    values = np.asarray(values, dtype=np.float64)
    n = len(values)
    if n <= points:
        return np.arange(n)
    width = -(-n // ((points - 2) // 2))
    whole = n // width * width
    kept = [np.array([0, n - 1])]
    # The tail that does not fill a bucket is a bucket of its own.
    parts = [
        (span.start, values[span].reshape(-1, width)) for span in large.pieces(values[:whole], least=width)
    ]
    for start, part in (*parts, (whole, values[whole:].reshape(1, -1))):
        if part.size == 0:
            continue
        offsets = start + np.arange(len(part)) * part.shape[1]
        missing = np.isnan(part)
        if missing.any():
            kept.append(offsets + np.argmin(np.where(missing, np.inf, part), axis=1))
            kept.append(offsets + np.argmax(np.where(missing, -np.inf, part), axis=1))
        else:
            kept.append(offsets + np.argmin(part, axis=1))
            kept.append(offsets + np.argmax(part, axis=1))
        large.release()
    return np.unique(np.concatenate(kept))


def drawn(
    time: ArrayLike,
    values: ArrayLike,
    points: int = DRAWN_POINTS,
    gaps: IndexArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """A time series as it is drawn: min-max reduced, with a NaN in every gap.

    Parameters
    ----------
    time, values
        Shape (n,), in the units of the axes.
    points
        Most samples kept; each gap that is seen adds one more point.
    gaps
        Indices of the samples that follow a gap; found from ``time`` where not given.

    Returns
    -------
    time, values
        Shape (m,); plotly lifts the pen at a NaN.
    """
    time = np.asarray(time, dtype=np.float64)
    values = np.asarray(values, dtype=np.float64)
    starts = gap_starts(time) if gaps is None else np.asarray(gaps, dtype=np.intp)
    kept = min_max_indices(values, points)
    if starts.size == 0:
        return time[kept], values[kept]
    # Among kept samples, the first at or after each gap start; several gaps between two
    # kept samples are one gap on the screen.
    places = np.unique(np.searchsorted(kept, starts))
    places = places[(places > 0) & (places < len(kept))]
    middle = 0.5 * (time[kept[places - 1]] + time[kept[places]])
    return np.insert(time[kept], places, middle), np.insert(values[kept], places, np.nan)
