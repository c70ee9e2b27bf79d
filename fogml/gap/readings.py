"""Temperature readings: their usual steps, and temperatures without noise and steps."""

from __future__ import annotations

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
