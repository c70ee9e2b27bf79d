"""Frequencies that stand out of the gaps of several runs together."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from fogml.gap.families.places import Scene

SMOOTH_S = 3000.0
"""What is slower than this is no line but drift, and taken out first [s]."""
APART = 0.25
"""Spacing of the frequencies in cycles over the longest run."""
NEIGHBOURS = 41


def outstanding_lines(scene: Scene, count: int) -> tuple[float, ...]:
    """The frequencies [Hz] of most power over that of their neighbours, the most first."""
    step = APART / scene.span_s
    frequencies = np.arange(4.0 * step, 0.5 / scene.row_s, step)
    if len(frequencies) < NEIGHBOURS:
        return tuple(float(f) for f in frequencies[:count])
    power = np.zeros(len(frequencies))
    for rows in scene.runs[: scene.fitted]:
        phase = np.pi * (rows.time_s - rows.time_s[0]) / max(rows.time_s[-1] - rows.time_s[0], 1.0)
        order = max(int((rows.time_s[-1] - rows.time_s[0]) / SMOOTH_S), 1)
        smooth = np.cos(phase[:, None] * np.arange(order + 1))
        known = np.concatenate([smooth, rows.constants], axis=1)
        known = known / np.maximum(np.linalg.norm(known, axis=0), 1e-300)
        left = rows.gap - known @ np.linalg.lstsq(known, rows.gap, rcond=1e-10)[0]
        waves = np.exp(-2j * np.pi * np.outer(frequencies, rows.time_s))
        power += np.abs(waves @ left) ** 2 / max(float(left @ left), 1e-300)
    power /= np.maximum(median_filter(power, NEIGHBOURS, mode="nearest"), 1e-300)
    peaks = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] > power[2:])) + 1
    best = peaks[np.argsort(-power[peaks])][:count]
    return tuple(float(f) for f in frequencies[best])
