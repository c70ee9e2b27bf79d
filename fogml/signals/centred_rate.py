"""The rate of a recorded quantity, without delay: from what came before and after each sample."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray


def centred_rate(time: FloatArray, x: FloatArray, window_s: float) -> FloatArray:
    """Rate of x per second: mean over the window after each sample less that over the window before.

    Divided by the distance of the two mean times. Both windows, [t, t + w) and (t - w, t], hold the
    sample itself and its neighbour at least, so that on even samples the rate is that at t, without
    delay; at an end, or beside a gap, they take what there is.

    Parameters
    ----------
    time
        Sample times [s], shape (n,), strictly increasing.
    x
        Values, shape (n,).
    window_s
        Length w of each window [s]; 0 takes the neighbours.

    Returns
    -------
    FloatArray
        Rates per second, shape (n,); 0 for a single sample.
    """
    n = len(time)
    if n < 2:
        return np.zeros(n)
    here = np.arange(n)
    # Samples on a grid must not fall on either side of a window's edge by rounding.
    edge_s = max(window_s * (1.0 - 1e-8), 0.0)
    stop = np.clip(np.searchsorted(time, time + edge_s), here + 2, n)
    start = np.clip(np.searchsorted(time, time - edge_s, side="right"), 0, np.maximum(here - 1, 0))

    def distance(values: FloatArray) -> FloatArray:
        """Mean after less mean before; sums are taken about the mean, which keeps them small."""
        total = np.concatenate([[0.0], np.cumsum(values - values.mean())])
        after = (total[stop] - total[here]) / (stop - here)
        return np.asarray(after - (total[here + 1] - total[start]) / (here + 1 - start))

    return distance(x) / distance(time)
