"""Axes: the unit in which a time reads best, and round numbers on logarithmic axes."""

from __future__ import annotations

import math
from typing import Any


def time_unit(span_s: float) -> tuple[float, str]:
    """Seconds per unit, and the unit, in which a time axis of this span [s] reads best."""
    if span_s > 6.0 * 86400.0:
        return 86400.0, "d"
    if span_s > 3.0 * 3600.0:
        return 3600.0, "h"
    if span_s > 300.0:
        return 60.0, "min"
    return 1.0, "s"


def rounded_up(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten at or above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    steps = (m * power for m in (1, 2, 5, 10))
    return float(f"{next(s for s in steps if s >= value * (1 - 1e-9)):.6g}")


def log_axis(low: float, high: float, room: float = 0.06) -> dict[str, Any]:
    """Settings of a logarithmic axis from ``low`` to ``high``, both positive.

    Ticks are plain round numbers: 1, 2 and 5 times powers of ten over up to two decades, the
    powers alone beyond. ``room`` is left on either side, as a share of the axis.
    """
    ends = math.log10(low), math.log10(high)
    margin = room * max(ends[1] - ends[0], 0.5)
    start, stop = ends[0] - margin, ends[1] + margin
    multiples = (1, 2, 5) if stop - start <= 2.2 else (1,)
    values = [
        m * 10.0**power
        for power in range(math.floor(start), math.ceil(stop) + 1)
        for m in multiples
        if start <= math.log10(m) + power <= stop
    ]
    return {
        "type": "log",
        "range": [start, stop],
        "tickmode": "array",
        "tickvals": values,
        "ticktext": [_plain(value) for value in values],
        "minor": {"showgrid": len(multiples) == 1, "gridcolor": "#F1F3F5", "dtick": "D1"},
    }


def _plain(value: float) -> str:
    power = math.floor(math.log10(value) + 1e-9)
    if -4 <= power <= 4:
        return f"{value:.{max(-power, 0)}f}"
    return f"{round(value / 10.0**power)}·10<sup>{power}</sup>".replace("1·", "").replace("-", "−")
