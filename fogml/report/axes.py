"""Axes: the unit in which a time reads best, and round numbers on logarithmic axes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

_LEAST_TICKS = 3
_MULTIPLES: tuple[tuple[float, ...], ...] = (
    (1,),
    (1, 2, 5),
    (1, 1.5, 2, 3, 4, 5, 6, 8),
    (1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 6, 7, 8, 9),
    tuple(tenth / 10 for tenth in range(10, 100)),
)


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

    Ticks are plain round numbers, as few as tell the scale: powers of ten, or 1, 2 and 5 times
    these, or finer. ``room`` is left on either side, as a share of the axis.
    """
    ends = math.log10(low), math.log10(high)
    margin = room * max(ends[1] - ends[0], 0.5)
    start, stop = ends[0] - margin, ends[1] + margin
    for multiples in _MULTIPLES:
        values = [
            float(f"{m}e{power}")
            for power in range(math.floor(start), math.ceil(stop) + 1)
            for m in multiples
            if start <= math.log10(m) + power <= stop
        ]
        if len(values) >= _LEAST_TICKS:
            break
    return {
        "type": "log",
        "range": [start, stop],
        "tickmode": "array",
        "tickvals": values,
        "ticktext": [_plain(value) for value in values],
        "minor": {"showgrid": multiples == (1,), "gridcolor": "#F1F3F5", "dtick": "D1"},
    }


def _plain(value: float) -> str:
    power = math.floor(math.log10(value) + 1e-9)
    if -4 <= power <= 4:
        return np.format_float_positional(value, trim="-")
    mantissa = f"{value / 10.0**power:.2g}·"
    return f"{'' if mantissa == '1·' else mantissa}10<sup>{power}</sup>".replace("-", "−")
