"""The noise floor of a run at an averaging time: what no drift model can take away."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fogml.runs.run import BoolArray, FloatArray, Run
from fogml.signals.floor import noise_floor


def floor_of_run(run: Run, used: BoolArray, error_deg_h: FloatArray, averaging_s: float) -> float:
    """Noise left in averages over `averaging_s` [deg/h], from the fast part of an error series.

    Differences cross neither gaps nor rows that don't count.

    Parameters
    ----------
    used
        Rows that count, shape (n,).
    error_deg_h
        Error of the whole run [deg/h], shape (n,).
    """
    rows = np.flatnonzero(used)
    broken = np.flatnonzero(np.diff(rows) > 1) + 1
    gaps = np.searchsorted(rows, run.gap_starts)
    edges = np.union1d(np.concatenate(([0], broken, gaps)), [len(rows)])
    segments = [(int(a), int(b)) for a, b in pairwise(edges.tolist())]
    return float(noise_floor(error_deg_h[used], run.sample_s, averaging_s, segments=segments))
