"""What a static run says of slow noise: its own likelihood, which is no bell in the coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fogml.gap.families.linear_gaussian import LinearGaussian
from fogml.gap.noise import UNIT_FACTOR
from fogml.runs.run import FloatArray, Run
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener

MOST_ROWS = 1000
FREE_DEG_H = 1e3
"""Prior standard deviation of the run's own constant and of what goes with its temperature [deg/h]."""


@dataclass(frozen=True, eq=False)
class StaticRun:
    """A static run as rows: when each ends [s], their values [deg/h] and what is free, shape (m, k)."""

    end_s: FloatArray
    values: FloatArray
    free: FloatArray
    row_s: float

    @classmethod
    def of(cls, run: Run) -> StaticRun:
        """Means over even rows; those with few samples are left out."""
        run = run.without_dropouts
        values = run.gyro_deg_h
        usable = np.isfinite(values) & np.isfinite(run.time)
        time, values = run.time[usable], values[usable]
        step = float(np.median(np.diff(time)))
        width = max(1, -(-len(time) // MOST_ROWS))
        row = np.floor((time - time[0] + 0.5 * step) / (width * step)).astype(np.intp)
        counts = np.bincount(row)
        full = counts >= max(0.5 * width, 1)
        means = np.bincount(row, weights=values) / np.maximum(counts, 1)
        free = [np.ones(len(counts))]
        if run.temperature_columns:
            warmth = run.temperature()[usable]
            if np.isfinite(warmth).all() and np.ptp(warmth) > 0.05:
                free.append(np.bincount(row, weights=warmth - warmth.mean()) / np.maximum(counts, 1))
        ends = time[0] + (np.arange(len(counts)) + 1.0) * width * step
        return cls(ends[full], means[full], FREE_DEG_H * np.column_stack(free)[full], width * step)

    def log_likelihood(self, noise: NoiseModel) -> float:
        """Of noise that is a factor of `UNIT_FACTOR` more or less from run to run."""
        values = []
        for off, weight in ((-1.0, 0.25), (0.0, 0.5), (1.0, 0.25)):
            scale = UNIT_FACTOR**off
            held = NoiseModel(noise.N, noise.B * scale, noise.K * scale)
            whitener = Whitener(held, self.end_s, self.row_s)
            model = LinearGaussian.of(whitener.whiten(self.values)).beside(whitener.whiten(self.free))
            values.append(model.log_evidence - whitener.log_det + math.log(weight))
        return float(np.logaddexp.reduce(values))
