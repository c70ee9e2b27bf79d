"""The steps that a record comes in, and its noise; outputs whose noise hardly leaves them.

What rounding to such steps makes does not average out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.intervals import MEDIAN_SIZE
from fogml.numerals import short
from fogml.runs.findings import Finding
from fogml.runs.run import Run

FINEST_STEP_DEGC = 5e-4
"""Steps of a record that are finer are its digits and no sensor's."""
WHOLE = 1e-2
"""Share of a step by which differences may miss a whole multiple of it."""
_ORDERS = (2, 4, 6, 8)


def recorded_step(values: FloatArray) -> float:
    """The step that all readings are whole multiples apart of, in their unit; 0 where there is none."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9]
    if len(steps) == 0:
        return 0.0
    least = float(steps.min())
    whole = steps / least
    return least if float(np.abs(whole - np.rint(whole)).max()) < WHOLE else 0.0


def to_steps(values: FloatArray, step: float) -> FloatArray:
    """Values rounded to whole multiples of a step, both in the same unit, shape as given.

    Of a step that divides 1, such as 0.01, they are the nearest numbers to the decimals, so that they
    are written with no more digits than the sensor has.
    """
    whole = np.rint(values / step)
    per_unit = np.rint(1.0 / step)
    if abs(per_unit * step - 1.0) < 1e-9:
        return np.asarray(whole / per_unit)
    return np.asarray(whole * step)


def noisy_beyond(temperature: FloatArray, least: float) -> bool:
    """Whether readings hold more noise than `least`, a standard deviation in their unit.

    Of white noise all differences tell the same, ``Var(D^k x) = C(2 k, k) sigma**2``; a course that is
    smooth over some samples leaves ever less in the higher ones, however slow the samples are.
    """
    if reading_noise(temperature) <= least:
        return False
    orders = [order for order in _ORDERS if len(temperature) >= 16 + order]
    told = [_noise_in_differences(temperature, order) for order in orders]
    return not told or min(told) > least or recorded_step(temperature) > least


def _noise_in_differences(values: FloatArray, order: int) -> float:
    size = float(np.median(np.abs(np.diff(values, order)))) / MEDIAN_SIZE
    return size / math.sqrt(math.comb(2 * order, order))


def reading_noise(temperature: FloatArray) -> float:
    """Standard deviation of a temperature's readings [degC]."""
    if len(temperature) < 16:
        return 0.0
    second = np.abs(np.diff(temperature, 2))
    steps = np.abs(np.diff(temperature))
    steps = steps[steps > 1e-9]
    least = float(np.quantile(steps, 0.01)) if len(steps) else 0.0
    quantised = least / np.sqrt(12.0) if len(np.unique(temperature)) < len(temperature) / 2 else 0.0
    return float(max(np.median(second) / MEDIAN_SIZE / np.sqrt(6.0), quantised))


DITHERED = 0.6
"""Standard deviation of samples, in steps of the output, from which on rounding to those makes white noise:
an angle with 0.4 steps of noise a sample, and the rounding itself (simulated)."""
_BLOCK = 32


def hardly_moved(values: FloatArray, step: float, share: float = DITHERED) -> bool:
    """Whether most samples, shape (n,), scatter by less than a share of a step."""
    blocks = _blocks(values)
    return step > 0.0 and len(blocks) > 0 and float(np.median(blocks.std(axis=1))) < share * step


def coarse_output(
    run: Run, *, filled: float = 0.45, counted: float = 0.035, looked_at: int = 100_000
) -> Iterator[Finding]:
    """``coarse_output``: the output is rounded to steps that its noise does not fill.

    Every mean is off by what rounding makes, up to half a step and alike as long as the rate is. Where an
    angle is counted, what a sample leaves over goes on to the next, and means lose nothing.

    Parameters
    ----------
    run
        Any run; one in counts whose scale factor is not stated tells nothing.
    filled
        Standard deviation of samples, in steps of the output, from which on means are off by less than a
        thirtieth of a step (simulated).
    counted
        Median squared difference of half blocks' means over that of variances, below which what a sample
        leaves over is carried on: white noise has 0.057, what drifts more, an angle that is counted less.
    looked_at
        Samples that a step is looked for in.
    """
    try:
        values = run.gyro_deg_h[:looked_at]
    except InputError:
        return  # counts whose scale factor is not stated
    step = recorded_step(values)
    if not hardly_moved(values, step, filled) or _is_counted(values, counted):
        return
    message = (
        f"'gyro' comes in steps, of {short(step)} deg/h as far as they show, and its noise hardly moves it "
        "from one to the next: means, and what is made of them, may be off by up to half a step, which no "
        "interval holds; record it finer, or the angle that is counted"
    )
    yield Finding("coarse_output", message, column="gyro", count=len(run))


def _blocks(values: FloatArray) -> FloatArray:
    return values[: len(values) // _BLOCK * _BLOCK].reshape(-1, _BLOCK)


def _is_counted(values: FloatArray, share: float) -> bool:
    """Whether what samples are off by is carried on from one to the next, as far as blocks that move tell."""
    blocks = _blocks(values)
    variance = float(np.median(blocks.var(axis=1)))
    halves = blocks.reshape(-1, 2, _BLOCK // 2).mean(axis=2)
    return float(np.median(np.diff(halves, axis=1) ** 2)) < share * variance
