"""How a gyro follows changes of the rate: gain over frequency, bandwidth, and slew."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fogml.arrays import FloatArray
from fogml.lab.rate_pieces import Oscillation, Plateaus
from fogml.runs.run import Run

STRAIGHT = 0.01
"""Rms deviation from a straight line, over the step, of a straight flank; that of a lag's is 0.06."""
LEAST_FLANK_ROWS = 5
"""Rows that tell a flank's slope and shape."""
FOLLOWS = 0.9
"""Share of the table's own acceleration from which on the output counts as having followed it."""
HALF_POWER = math.sqrt(0.5)


@dataclass(frozen=True)
class Gain:
    """What an oscillation shows at its frequency.

    Attributes
    ----------
    frequency_hz
        Frequency [Hz].
    gain, se
        Output over the table's rate, and its standard error.
    phase_deg
        Of the output, negative where it is behind [deg].
    """

    frequency_hz: float
    gain: float
    se: float
    phase_deg: float


@dataclass(frozen=True)
class Bandwidth:
    """Bandwidth [Hz].

    Attributes
    ----------
    half_power_hz
        Where the gain, interpolated between the frequencies tested, is 1 / sqrt(2) of the scale factor; None
        where none of them shows less, or all do.
    first_order_hz, se
        That of a first-order loop fitted to all gains, and its standard error; None where the gain does not
        fall beyond noise.
    """

    half_power_hz: float | None
    first_order_hz: float | None
    se: float | None


@dataclass(frozen=True)
class Slew:
    """Greatest change of the output [deg/s2], the table's own, and whether the output was limited."""

    output_deg_s2: float
    table_deg_s2: float
    limited: bool


def gain_of(run: Run, oscillation: Oscillation) -> Gain:
    """Gain and phase at an oscillation's frequency, by least squares on rate and output."""
    rows = slice(oscillation.start, oscillation.stop)
    time = run.time[rows] - run.time[oscillation.start]
    omega = 2.0 * math.pi * oscillation.frequency_hz * time
    basis = np.column_stack([np.cos(omega), np.sin(omega), np.ones(len(time)), time])
    given, _ = _wave(basis, 3600.0 * run.rate[rows])
    got, deviation = _wave(basis, run.gyro_deg_h[rows])
    ratio = got / given
    se = deviation * math.sqrt(2.0 / len(time)) / abs(given)
    phase = math.degrees(math.atan2(ratio.imag, ratio.real))
    return Gain(oscillation.frequency_hz, abs(ratio), se, phase)


def _wave(basis: FloatArray, values: FloatArray) -> tuple[complex, float]:
    """Amplitude of a wave as a complex number, and the deviation of what is left of its samples."""
    solved, *_ = np.linalg.lstsq(basis, values, rcond=None)
    left = values - basis @ solved
    freedom = max(len(values) - basis.shape[1], 1)
    # a cos + b sin is the real part of (a - i b) exp(i omega t).
    return complex(solved[0], -solved[1]), float(np.sqrt(left @ left / freedom))


def bandwidth(gains: Sequence[Gain], scale_factor: float = 1.0) -> Bandwidth | None:
    """Bandwidth from gains at two frequencies or more, relative to the scale factor's size; else None.

    A first-order loop has ``(K / gain)**2 - 1 = (f / f_3)**2``, which is linear in ``f**2``.
    """
    if len(gains) < 2:
        return None
    ordered, scale = sorted(gains, key=lambda one: (one.frequency_hz, one.gain)), abs(scale_factor)
    f = np.array([one.frequency_hz for one in ordered])
    gain = np.array([one.gain for one in ordered]) / scale
    error = np.array([max(one.se, 1e-12 * one.gain) for one in ordered]) / scale
    below = np.flatnonzero(gain < HALF_POWER)
    half_power = None
    if len(below) and below[0] > 0:
        # Between logarithms, straight for a loop of first order.
        pair = slice(below[0] - 1, below[0] + 1)
        at = np.log(np.maximum(gain[pair] ** -2.0 - 1.0, 1e-6))
        half_power = float(math.exp(np.interp(0.0, at, np.log(f[pair]))))
    lost, weight = gain**-2.0 - 1.0, (gain**3.0 / (2.0 * error)) ** 2.0
    squares = float(weight @ f**4)
    slope = float(weight @ (f**2 * lost)) / squares
    spread = squares**-0.5
    # Where the loop is of first order by a small part only, what is left over widens the error.
    left = lost - slope * f**2
    spread *= max(1.0, math.sqrt(float(weight @ left**2) / (len(f) - 1)))
    if not slope > 2.0 * spread:
        return Bandwidth(half_power, None, None)
    first = slope**-0.5
    return Bandwidth(half_power, first, 0.5 * first * spread / slope)


def slew(run: Run, plateaus: Plateaus, scale_factor: float = 1.0) -> Slew | None:
    """How fast the output changes after the greatest step between two plateaus; None without a step.

    The slope between 10 and 90 % of the step, of output and table; where neither takes `LEAST_FLANK_ROWS`
    rows, the step over a row. An output is limited if its flank is straight to within `STRAIGHT` of the step,
    which that of a lag is not, and slower than `FOLLOWS` of the table's.
    """
    if len(plateaus) < 2:
        return None
    place = int(np.argmax(np.abs(np.diff(plateaus.rate))))
    height = float(plateaus.rate[place + 1] - plateaus.rate[place])
    if height == 0.0:
        return None
    rows = slice(int(plateaus.stop[place]) - 1, int(plateaus.stop[place + 1]))
    time = run.time[rows]
    table = (3600.0 * (run.rate[rows] - run.rate[rows.start])) / height
    # Of the output's own step, which a saturated one has smaller than the table's.
    risen = float(plateaus.output[place + 1] - plateaus.output[place])
    if risen == 0.0:
        return None
    output = (run.gyro_deg_h[rows] - plateaus.output[place]) / risen
    got, given = _flank(time, output), _flank(time, table)
    white = plateaus.error[place] * math.sqrt(plateaus.stop[place] - plateaus.start[place]) / abs(risen)
    straight = got.rows >= LEAST_FLANK_ROWS and got.bent < STRAIGHT + white
    slopes = abs(risen) / scale_factor / 3600.0 * got.slope, abs(height) / 3600.0 * given.slope
    return Slew(*slopes, straight and slopes[0] < FOLLOWS * slopes[1])


class _Flank(NamedTuple):
    """Slope [1/s], rows from 10 to 90 %, and rms deviation from a straight line, of a step of height 1."""

    slope: float
    rows: int
    bent: float


def _flank(time: FloatArray, risen: FloatArray) -> _Flank:
    first = int(np.argmax(risen >= 0.1))
    last = first + int(np.argmax(risen[first:] >= 0.9))
    if last - first < LEAST_FLANK_ROWS:
        return _Flank(1.0 / float(time[max(first, 1)] - time[max(first, 1) - 1]), last - first, 0.0)
    part, since = risen[first : last + 1], time[first : last + 1] - time[first]
    line = np.polynomial.polynomial.polyfit(since, part, 1)
    left = part - line[0] - line[1] * since
    return _Flank(float(line[1]), last - first, float(np.sqrt(np.mean(left * left))))
