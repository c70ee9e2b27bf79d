"""Temperature readings: their noise, their steps, and temperatures without either."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray, Run

SMOOTHED_S = 150.0
"""Readings are smoothed over this time for the responses of candidates [s]."""
USUAL_STEP_DEGC = 0.0101
"""Steps of a good sensor are no coarser: part of any recording."""


def smoothed(run: Run, temperature: FloatArray) -> FloatArray:
    """A temperature without the noise of its readings: local parabolas over `SMOOTHED_S`, shape (n,).

    Reference: A. Savitzky and M. J. E. Golay, Anal. Chem. 36 (1964) 1627.
    """
    from scipy.signal import savgol_filter

    width = 2 * round(0.5 * SMOOTHED_S / max(run.sample_s, 1e-9)) + 1
    if width < 5:
        return temperature
    smooth = temperature.copy()
    for part in run.stretches:
        if part.stop - part.start >= width:
            smooth[part] = savgol_filter(temperature[part], width, 2)
    return smooth


def reading_noise(temperature: FloatArray) -> float:
    """Standard deviation of a temperature's readings [degC]."""
    if len(temperature) < 16:
        return 0.0
    second = np.abs(np.diff(temperature, 2))
    steps = np.abs(np.diff(temperature))
    steps = steps[steps > 1e-9]
    least = float(np.quantile(steps, 0.01)) if len(steps) else 0.0
    quantised = least / np.sqrt(12.0) if len(np.unique(temperature)) < len(temperature) / 2 else 0.0
    return float(max(np.median(second) / 0.6745 / np.sqrt(6.0), quantised))
