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
FILLED = 0.45
"""... and from which on the means are off by less than a thirtieth of a step."""
LOOKED_AT = 100_000
"""Samples that a step is looked for in."""
_BLOCK = 32
_COUNTED = 0.035
"""Median squared difference of half blocks' means over that of variances, below which what a sample leaves
over is carried on to the next: white noise has 0.057, what drifts more, an angle that is counted less."""


def hardly_moved(values: FloatArray, step: float, share: float = DITHERED) -> bool:
    """Whether most samples, shape (n,), scatter by less than a share of a step."""
    blocks = _blocks(values)
    return step > 0.0 and len(blocks) > 0 and float(np.median(blocks.std(axis=1))) < share * step


def coarse_output(run: Run) -> Iterator[Finding]:
    """``coarse_output``: the output is rounded to steps that its noise does not fill.

    Every mean is off by what rounding makes, up to half a step and alike as long as the rate is. Where an
    angle is counted, what a sample leaves over goes on to the next, and means lose nothing.
    """
    try:
        values = run.gyro_deg_h[:LOOKED_AT]
    except InputError:
        return  # counts whose scale factor is not stated
    step = recorded_step(values)
    if not hardly_moved(values, step, FILLED) or _is_counted(values):
        return
    message = (
        f"'gyro' comes in steps, of {short(step)} deg/h as far as they show, and its noise hardly moves it "
        "from one to the next: means, and what is made of them, may be off by up to half a step, which no "
        "interval holds; record it finer, or the angle that is counted"
    )
    yield Finding("coarse_output", message, column="gyro", count=len(run))


def _blocks(values: FloatArray) -> FloatArray:
    return values[: len(values) // _BLOCK * _BLOCK].reshape(-1, _BLOCK)


def _is_counted(values: FloatArray) -> bool:
    """Whether what samples are off by is carried on from one to the next, as far as blocks that move tell."""
    blocks = _blocks(values)
    variance = float(np.median(blocks.var(axis=1)))
    halves = blocks.reshape(-1, 2, _BLOCK // 2).mean(axis=2)
    return float(np.median(np.diff(halves, axis=1) ** 2)) < _COUNTED * variance
