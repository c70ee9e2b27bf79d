"""The Allan variance that noise terms have (IEEE Std 952, annex C)."""

from __future__ import annotations

import math

import numpy as np


def allan_variance(taus_s, Q=0.0, N=0.0, B=0.0, K=0.0, R=0.0):
    """Q in urad, N in deg/sqrt(h), B in deg/h, K in deg/h/sqrt(h), R in deg/h/h; (deg/h)**2, shape (m,)."""
    hours = np.asarray(taus_s) / 3600.0
    steps = 3.0 * (math.degrees(1e-6 * Q) * 3600.0 / taus_s) ** 2
    flicker = 2.0 * math.log(2.0) / math.pi * B**2
    return steps + N**2 / hours + flicker + K**2 * hours / 3.0 + (R * hours) ** 2 / 2.0
