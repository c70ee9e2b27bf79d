"""An output in steps that its noise hardly leaves: what rounding to them makes does not average out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.numerals import short
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from fogml.runs.steps import recorded_step

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
