"""Values that a log repeats because it reads them more often than they are new."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

REGULAR = 0.99
"""Share of changes that have to lie on the grid of a hold: the rest are lost samples."""
_FEWEST = 30
"""Changes needed to tell a hold."""
_SPREAD = 0.3
"""Greatest variance of the lengths of a hold that does not last whole samples; two lengths make 1/4."""


@dataclass(frozen=True)
class ValueHold:
    """Samples that are new.

    Attributes
    ----------
    samples
        Mean number of samples that a value lasts; 1 where each is new.
    rows
        The first sample of each value, shape (m,); all of them where each is new.
    """

    samples: float
    rows: IndexArray


def hold_of(values: FloatArray) -> ValueHold:
    """How long each value of an evenly sampled series is held.

    A coarse converter repeats values by chance, for a random number of samples; a hold lasts the same
    number each time, or two neighbouring numbers in turn where it is no whole number of samples.

    Parameters
    ----------
    values
        A stretch without gaps, shape (n,).
    """
    every = ValueHold(1.0, np.arange(len(values)))
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    if len(changes) < _FEWEST or len(changes) > 0.9 * len(values):
        return every
    lengths = np.diff(changes)
    shortest = int(np.quantile(lengths, 1.0 - REGULAR, method="lower"))
    if shortest >= 2:
        # Lost samples shift the grid: lengths, not places, are asked.
        if np.mean(lengths % shortest == 0) >= REGULAR:
            return _whole(values, changes, lengths, shortest)
        if float(np.var(lengths)) > _SPREAD:
            return every
    elif float(np.var(lengths)) > _SPREAD or int(lengths.max()) > 2:
        return every
    return ValueHold(float(np.mean(lengths)), changes.astype(np.intp))


def _whole(values: FloatArray, changes: IndexArray, lengths: IndexArray, samples: int) -> ValueHold:
    """New values every so many samples, those that happen to equal the one before included."""
    between = (
        [np.arange(a, b - samples // 2, samples) for a, b in zip(changes[:-1].tolist(), changes[1:].tolist())]
        if int(lengths.max()) > samples
        else [changes[:-1]]
    )
    last = np.arange(int(changes[-1]), len(values) - samples + 1, samples)
    return ValueHold(float(samples), np.concatenate((*between, last)).astype(np.intp))
