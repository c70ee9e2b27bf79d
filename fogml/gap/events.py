"""Unknowns in time that are looked up in the data first: lines, steady or swept, and steps.

What is found is a group of the unknown like the others, at the price of having been looked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fogml.gap.frame import Frame
from fogml.gap.group import Group, side_by_side
from fogml.gap.observation import Observation
from fogml.gap.swept import swept_group
from fogml.runs.run import FloatArray

MOST_LINES, MOST_STEPS = 3, 4
FEWEST_CYCLES = 2.5
"""Cycles over the longest run from which on an oscillation is no drift."""
APART_S = 600.0
"""Least time between two steps [s]."""
LOOKED_THROUGH = 3.0
"""Price of the places that were looked through, in their logarithm."""
_FINER = 4


def event_groups(frame: Frame) -> list[Group]:
    """Lines, steady or swept, and steps that stand out beside the constants.

    Parameters
    ----------
    frame
        The runs.
    """
    rows = frame.without_constants(frame.residual[:, 0])
    left = [rows[run] for run in frame.runs]
    others = (swept_group(frame, left), _steps(frame, left))
    return _lines(frame, left) + [group for group in others if group is not None]


def _lines(frame: Frame, left: Sequence[FloatArray]) -> list[Group]:
    """The strongest lines, of any phase on each run.

    One of any form, at times or always; or several, steady or growing with temperature or turns.
    """
    longest = max(o.row_s * len(o) for o in frame.observations)
    finest = max(o.row_s for o in frame.observations)
    step_hz = 1.0 / (_FINER * longest)
    frequencies = np.arange(FEWEST_CYCLES / longest, 0.45 / finest, step_hz)
    if len(frequencies) < 16:
        return []
    power = np.zeros(len(frequencies))
    for o, rows in zip(frame.observations, left):
        length = round(1.0 / (step_hz * o.row_s))
        spectrum = np.abs(np.fft.rfft(rows, length)) ** 2 / len(rows)
        own = np.arange(len(spectrum)) / (length * o.row_s)
        power += np.interp(frequencies, own, spectrum)
    places = _highest(power, MOST_LINES, _FINER)
    found = frequencies[places]
    words = f"is periodic in time with a period of {1.0 / found[0]:.3g} s"
    price = math.log(len(frequencies) / _FINER)
    one = side_by_side([_of_any_form(o, float(found[0])) for o in frame.observations])
    several = side_by_side([_modulated(o, found) for o in frame.observations])
    return [Group("line", words, one, price), Group("lines", words, several, LOOKED_THROUGH * price)]


def _of_any_form(o: Observation, frequency_hz: float) -> FloatArray:
    """An oscillation with its overtones, as large always, or only in turns, or going with temperature."""
    phase = 2.0 * np.pi * frequency_hz * (o.time - o.time[0])
    overtones = [
        wave(k * phase) for k in (1, 2, 3) if k * frequency_hz * o.row_s < 0.5 for wave in (np.cos, np.sin)
    ]
    waves = np.column_stack(overtones)
    first = waves[:, :2]
    parts = [waves, first * ((o.temperature - 25.0) / 50.0)[:, None]]
    rate = np.abs(o.averaged(o.run.rate))
    if np.any(rate):
        parts.append(first * (rate > 1e-3 * rate.max())[:, None])
    return np.concatenate(parts, axis=1)


def _modulated(o: Observation, frequencies: FloatArray) -> FloatArray:
    angle = 2.0 * np.pi * np.outer(o.time - o.time[0], frequencies)
    waves = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    parts = [waves, waves * ((o.temperature - 25.0) / 50.0)[:, None]]
    rate = np.abs(o.averaged(o.run.rate))
    if np.any(rate):
        parts.append(waves * np.sqrt(rate / rate.max())[:, None])
    return np.concatenate(parts, axis=1)


def _steps(frame: Frame, left: Sequence[FloatArray]) -> Group | None:
    """The strongest steps in time, each on its run."""
    gains, apart = [], []
    for o, whitener, rows in zip(frame.observations, frame.whiteners, left):
        early = len(o) // 4
        unit = np.zeros(len(o))
        unit[early:] = 1.0
        step = whitener.whiten(unit)[early:]
        length = 2 * len(o)
        across = np.fft.irfft(np.fft.rfft(rows, length) * np.conj(np.fft.rfft(step, length)), length)[
            : len(o)
        ]
        size = np.cumsum(np.append(step, np.zeros(early)) ** 2)[::-1]
        gain = 0.5 * across**2 / np.maximum(size, 1e-12)
        apart.append(max(1, round(APART_S / o.row_s)))
        gain[: apart[-1]] = gain[-apart[-1] :] = 0.0
        gains.append(gain)
    edges = np.cumsum([0, *map(len, gains)])
    places = _highest(np.concatenate(gains), MOST_STEPS, max(apart))
    columns: list[list[FloatArray]] = [[] for _ in gains]
    words = ""
    for place in sorted(places, key=lambda p: -np.concatenate(gains)[p]):
        run = int(np.searchsorted(edges, place, side="right")) - 1
        o, row = frame.observations[run], place - int(edges[run])
        for r, other in enumerate(frame.observations):
            columns[r].append(
                np.zeros(len(other)) if r != run else np.where(np.arange(len(o)) >= row, 1.0, 0.0)
            )
        if not words:
            words = f"steps at {o.time[row] / 3600.0:.2f} h in {o.run.name}"
    if not words:
        return None
    rows_of = tuple(np.column_stack(held) for held in columns)
    return Group("step", words, rows_of, LOOKED_THROUGH * math.log(float(edges[-1]) / max(apart)))


def _highest(values: FloatArray, count: int, apart: int) -> list[int]:
    """Places of the highest values, `apart` from each other, the highest first."""
    free = values.copy()
    found = []
    for _ in range(count):
        place = int(np.argmax(free))
        if free[place] <= 0.0:
            break
        found.append(place)
        free[max(place - apart, 0) : place + apart + 1] = 0.0
    return found
