"""The gyro's noise: white, a slope of the unit's own between flat and steep, at times a bump, and a walk.

The slope is a sum of Ornstein-Uhlenbeck processes, one in each half decade of time constants, whose
variances follow a power of the time constant and scatter about it: no unit's is 1/f. All of it are states
of first order, so that the whitening is exact.
"""

from __future__ import annotations

import numpy as np

from fogml.blind.frame.state_noise import StateNoise

_MIDDLE = {"N": 0.004, "B": 0.008, "K": 0.004}
_TAUS_S = np.geomspace(10.0, 1e5, 9)


def draw_noise(rng: np.random.Generator) -> StateNoise:
    """A unit's noise, each strength log-normal about a middle by a factor of 2.5."""
    white, flicker, walk = (
        middle * float(np.exp(np.log(2.5) * np.clip(rng.standard_normal(), -2.0, 2.0)))
        for middle in _MIDDLE.values()
    )
    # Equal variances in each half decade are 1/f; a power of the time constant tilts that.
    tilt = rng.uniform(-0.35, 0.35)
    shares = (_TAUS_S / 1000.0) ** tilt * np.exp(0.4 * rng.standard_normal(len(_TAUS_S)))
    variances, taus = flicker**2 / np.pi * np.log(np.sqrt(10.0)) * shares, _TAUS_S
    if rng.random() < 0.35:
        bump = flicker**2 * rng.uniform(0.3, 1.5)
        variances = np.append(variances, bump)
        taus = np.append(taus, np.exp(rng.uniform(np.log(30.0), np.log(900.0))))
    return StateNoise(white, variances, taus, walk)
