"""Turn-on time: from power-on until the bias stays within a band about its settled value."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from fogml.errors import InputError
from fogml.runs.run import FloatArray, Run

SETTLED_SHARE = 0.25
"""The last quarter of a run's averages tells the settled bias."""
LEAST_AVERAGES = 8


def check_turn_on_band(band: float | None, runs: Iterable[Run] | None = None) -> None:
    """Raise `InputError` for a band that is no positive number of deg/h, or that no run of `runs` answers."""
    if band is not None and not (math.isfinite(band) and band > 0.0):
        raise InputError(f"turn-on band {band:g} deg/h: a positive number is needed")
    if band is not None and runs is not None and all(run.facts.powered_on is None for run in runs):
        raise InputError(
            f"turn-on band {band:g} deg/h: no run states when the gyro was switched on; write "
            "'powered_on: SECONDS' into a side file, on the run's own clock, or leave the band out"
        )


def turn_on_time(
    time_s: FloatArray, averages: FloatArray, powered_on_s: float, band_deg_h: float, averaging_s: float
) -> float | None:
    """Time from power-on until the averages stay within the band about their settled value [s].

    The settled value is the mean of the last quarter of the averages. Where the band is entered
    lies between two averages, and is interpolated.

    Parameters
    ----------
    time_s
        Mean time of each average [s], shape (m,).
    averages
        Averages of the error [deg/h], shape (m,).
    powered_on_s
        Time of power-on on the same clock [s].
    band_deg_h
        Greatest distance from the settled value [deg/h].
    averaging_s
        Averaging time [s].

    Returns
    -------
    float or None
        Infinite where the last quarter itself leaves the band, so the run does not settle. None
        where the averages don't tell: fewer than 8 after power-on, or none of them outside the
        band though the first is not right after power-on.
    """
    on = time_s >= powered_on_s
    time, values = time_s[on], averages[on]
    if len(values) < LEAST_AVERAGES:
        return None
    first_settled = len(values) - int(SETTLED_SHARE * len(values))
    away = values - values[first_settled:].mean()
    outside = np.flatnonzero(np.abs(away) > band_deg_h)
    if len(outside) == 0:
        # Settled before the first average ended; which says little where that came late.
        at_once = float(time[0]) - powered_on_s
        return at_once if at_once <= averaging_s else None
    last = int(outside[-1])
    if last >= first_settled - 1:
        return math.inf
    edge = math.copysign(band_deg_h, away[last])
    share = (away[last] - edge) / (away[last] - away[last + 1])
    return float(time[last] + share * (time[last + 1] - time[last]) - powered_on_s)
