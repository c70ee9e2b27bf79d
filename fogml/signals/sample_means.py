"""Oscillations as samples hold them: the mean over each sample."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray

_SMALL = 0.05


def mean_cosine(before: FloatArray, after: FloatArray) -> FloatArray:
    """Mean of cos(x) while x moves evenly from `before` to `after` [rad], shape (n,).

    ``(sin(after) - sin(before)) / (after - before)``, in a form that holds for equal ends.
    """
    half = 0.5 * (after - before)
    return np.cos(before + half) * _sine_ratio(half)


def with_whole_turns(turned_deg: FloatArray, told_deg: FloatArray) -> FloatArray:
    """Differences of an angle [deg] with the whole turns that its record may have left out, shape (n,).

    Parameters
    ----------
    turned_deg
        Differences of neighbouring samples of an angle that may begin anew after each turn. Over a turn
        they are whole already.
    told_deg
        The same by the rate, good to half a turn.
    """
    turns = np.rint((told_deg - turned_deg) / 360.0)
    return np.where(np.abs(turned_deg) > 360.0, turned_deg, turned_deg + 360.0 * turns)


def _sine_ratio(x: FloatArray) -> FloatArray:
    """sin(x) / x, shape (n,), exact to rounding."""
    if max(float(x.max(initial=0.0)), -float(x.min(initial=0.0))) > _SMALL:
        return np.sinc(x / np.pi)
    # Slow motion, the usual case, needs no sine.
    square = x * x
    return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
