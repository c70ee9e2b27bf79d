"""Whether temperature moves both ways in training runs: what tells a rate from its time and direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.runs.run import FloatArray

TURNS = 0.2
"""Share of the span that temperature has to move each way for its direction to tell anything."""


def moves_both_ways(temperatures: Sequence[FloatArray]) -> bool:
    """Whether temperature rises and falls by a fifth of its span or more, in all runs together.

    Parameters
    ----------
    temperatures
        T [degC] of each run, shapes (n,).
    """
    up = down = 0.0
    low, high = np.inf, -np.inf
    for T in temperatures:
        low, high = min(low, float(T.min())), max(high, float(T.max()))
        # Averages over a hundredth of the run keep the sensor's noise from adding up as motion.
        parts = np.array([part.mean() for part in np.array_split(T, min(100, len(T)))])
        steps = np.diff(parts)
        up, down = up + float(steps[steps > 0].sum()), down - float(steps[steps < 0].sum())
    return min(up, down) > TURNS * (high - low)
