"""An oscillation whose period changes steadily, looked up in the data: a beat of clocks that drift apart.

Rows times exp(-i pi c t^2) turn an oscillation of frequency f + c t into a line at f.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fogml.gap.frame import Frame
from fogml.gap.group import Group, side_by_side
from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray

ROW_S = 60.0
"""Rows are averaged to this, so that periods from some minutes on are searched [s]."""
LEAST_SWEEP, MOST_SWEEP = 4.0, 80.0
"""Change of frequency over the longest run, in oscillations over that run."""
_STEP, _FINER = 1.0, 2


def swept_group(frame: Frame, left: Sequence[FloatArray]) -> Group | None:
    """The strongest swept oscillation, of any phase on each run; None where runs are too short.

    Parameters
    ----------
    frame
        The runs.
    left
        Whitened rows of each run beside the constants.
    """
    longest = max(o.row_s * len(o) for o in frame.observations)
    widths = [max(1, round(ROW_S / o.row_s)) for o in frame.observations]
    finest = max(o.row_s * width for o, width in zip(frame.observations, widths))
    step_hz = 1.0 / (_FINER * longest)
    frequencies = np.arange(1.0 / longest, 0.45 / finest, step_hz)
    sweeps = np.arange(LEAST_SWEEP, MOST_SWEEP + _STEP, _STEP) / longest**2
    sweeps = np.concatenate([-sweeps[::-1], sweeps])
    if len(frequencies) < 16:
        return None
    power = np.zeros((len(sweeps), len(frequencies)))
    for o, rows, width in zip(frame.observations, left, widths):
        means = rows[: len(rows) // width * width].reshape(-1, width).mean(axis=1) * math.sqrt(width)
        step_s = o.row_s * width
        time = (np.arange(len(means)) + 0.5) * step_s
        length = round(1.0 / (step_hz * step_s))
        turned = np.exp(-1j * np.pi * np.outer(sweeps, time**2)) * means
        spectrum = np.abs(np.fft.fft(turned, length, axis=1)) ** 2 / len(means)
        place = np.minimum(np.round(frequencies * length * step_s).astype(int), length - 1)
        power += spectrum[:, place]
    # A frequency that leaves the band, or goes through zero, on the way is no sweep.
    ends = frequencies + sweeps[:, None] * longest
    power[(ends < frequencies[0]) | (ends > frequencies[-1])] = 0.0
    row, column = np.unravel_index(int(np.argmax(power)), power.shape)
    first, sweep = float(frequencies[column]), float(sweeps[row])
    words = f"oscillates with a period that goes from {1.0 / first:.3g} to {1.0 / ends[row, column]:.3g} s"
    price = math.log(np.count_nonzero(power) / _FINER)
    return Group("swept", words, side_by_side([_waves(o, first, sweep) for o in frame.observations]), price)


def _waves(o: Observation, frequency_hz: float, sweep_hz_s: float) -> FloatArray:
    """The oscillation, as large always or growing, shape (m, 4)."""
    time = o.time - o.time[0]
    phase = 2.0 * np.pi * (frequency_hz + 0.5 * sweep_hz_s * time) * time
    waves = np.column_stack([np.cos(phase), np.sin(phase)])
    return np.concatenate([waves, waves * (time / max(float(time[-1]), 1.0))[:, None]], axis=1)
