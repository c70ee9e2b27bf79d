"""What training runs can tell by how temperature moves in them: span, resolution, and both directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.runs.run import FloatArray, Run

TURNS = 0.2
"""Share of the span that temperature has to move each way for its direction to tell anything."""


def ways_moved(temperatures: Sequence[FloatArray]) -> frozenset[str]:
    """Which ways, ``up`` and ``down``, temperature moves by a fifth of its span, in all runs together.

    Parameters
    ----------
    temperatures
        T [degC] of each run, shapes (n,).
    """
    moved = {"up": 0.0, "down": 0.0}
    low, high = np.inf, -np.inf
    for T in temperatures:
        low, high = min(low, float(T.min())), max(high, float(T.max()))
        # Averages over a hundredth of the run keep the sensor's noise from adding up as motion.
        parts = np.array([part.mean() for part in np.array_split(T, min(100, len(T)))])
        steps = np.diff(parts)
        moved["up"] += float(steps[steps > 0].sum())
        moved["down"] -= float(steps[steps < 0].sum())
    return frozenset(way for way, by in moved.items() if by > TURNS * (high - low))


def moves_both_ways(temperatures: Sequence[FloatArray]) -> bool:
    """Whether temperature rises and falls by a fifth of its span or more, in all runs together."""
    return len(ways_moved(temperatures)) == 2


def direction_is_told(temperatures: Sequence[FloatArray]) -> bool:
    """Whether what the direction of temperature does is told beside what shifts a run as a whole.

    It is by a run that moves both ways, or by runs of one way each of which both ways are left whichever run
    is left out. Of a run up and a run down, a shift from run to run looks like direction, and no run left out
    can tell: what is left moves one way only.

    Parameters
    ----------
    temperatures
        T [degC] of each run, shapes (n,).
    """
    if any(moves_both_ways([T]) for T in temperatures):
        return True
    runs = list(temperatures)
    return len(runs) > 2 and all(moves_both_ways(runs[:i] + runs[i + 1 :]) for i in range(len(runs)))


LEAST_SPAN_DEGC = 5.0
"""Span of temperature below which what was learned holds at that temperature alone [degC]: less than a room
changes in a day, and a few percent of what gyros are used over."""
LEAST_STEPS = 10.0
"""Steps of a sensor's resolution that a span must hold to tell a slope."""


def refusals(runs: Sequence[Run]) -> list[str]:
    """What training runs can't tell because temperature hardly moves in them, and what to record next."""
    temperatures = [run.temperature("T") for run in runs]
    low, high = min(float(T.min()) for T in temperatures), max(float(T.max()) for T in temperatures)
    span = high - low
    if span == 0.0:
        return [
            f"one temperature only, {low:.4g} degC: nothing can be told of drift over temperature; record a "
            "ramp up and a ramp down over the range of use"
        ]
    steps = [np.diff(np.unique(T)) for T in temperatures]
    resolution = min((float(step.min()) for step in steps if len(step)), default=0.0)
    if span < LEAST_STEPS * resolution:
        return [
            f"T spans {span:.3g} degC, {span / resolution:.0f} steps of its sensor: that tells no slope; "
            "record a wider range, or with a finer sensor"
        ]
    if span < LEAST_SPAN_DEGC:
        return [
            f"T spans {span:.3g} degC in the training runs, under {LEAST_SPAN_DEGC:g} degC: what is "
            f"compensated holds at {0.5 * (low + high):.3g} degC alone; record a ramp up and a ramp down "
            "over the range of use"
        ]
    return []
