"""How a window's samples are held where memory must not grow with the rate: one by one, or in bins."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fogml.errors import InputError
from fogml.features.atoms import Window
from fogml.signals.clock import EDGE_TOLERANCE

_HEADROOM = 8
MOST_SINGLE = 132
"""Samples up to which the windows keep each one; more are kept in bins."""
BINS = 64
"""Bins that the longest window, both of a block's, is parted into: 2 s for a block of 64 s."""
_SHORTEST_BINS = 8
"""Bins in the shortest window at least: its edge parts one along a line, beside which it must be long."""
MOST_IN_BIN = 8191
"""Samples that a bin holds at most: its sums then fit 63 bits."""
GAP_BINS = 4
"""Bins more, as lost samples end one early: within a bin they would be taken to be evenly apart."""
LOST = 1.5
"""Sample intervals beyond which samples were lost."""
_LONGEST_RING = 1 << 12
"""Bins at most; windows whose lengths are further apart are refused."""


def ring_of(windows: Sequence[Window], sample_s: float) -> tuple[int, int]:
    """Samples or bins that the rings hold, and samples to a bin.

    Temperature has no content within a second: where the longest window holds more than `MOST_SINGLE`
    samples, they are kept in bins, so that memory does not grow with the rate.

    Raises
    ------
    InputError
        If the windows' lengths are too far apart.
    """
    held = [window for window in windows if window.held]
    if not held:
        return 0, 1
    most = max(math.ceil(window.span_s / sample_s - EDGE_TOLERANCE) + 1 for window in held)
    single = most + most // _HEADROOM + 4, 1
    if most <= MOST_SINGLE:
        return single
    longest = max(window.span_s for window in held)
    bin_s = min(longest / BINS, min(window.length_s for window in held) / _SHORTEST_BINS)
    if bin_s < (2.0 - EDGE_TOLERANCE) * sample_s:
        return single
    # A bin goes on until half an interval before its last sample would be due: not shorter than it then.
    count = min(math.ceil(bin_s / sample_s + 0.5 - EDGE_TOLERANCE), MOST_IN_BIN)
    ring = math.ceil(longest / ((count - 0.5) * sample_s)) + 2 + GAP_BINS
    if ring > _LONGEST_RING:
        raise InputError(
            f"export: windows of {min(w.length_s for w in held):g} s and {longest:g} s at a sample every "
            f"{sample_s:g} s need {ring} bins, C code holds at most {_LONGEST_RING}; train with windows "
            "nearer to each other or [exp, ...], or run the model at a longer --sample-s"
        )
    return ring, count
