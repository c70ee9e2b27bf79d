"""What is thought of an effect before the runs: how large it may be, and what shapes are likely.

Amplitudes are normal with one of several standard deviations, stated as whitened lengths beside the
constants, so that evidence does not hang on a scale that nobody knows. A length that would take an
amplitude far outside of the card's ranges, of any grade, weighs less.
"""

from __future__ import annotations

import numpy as np

from fogml.gap.model import Candidate
from fogml.runs.run import FloatArray

LENGTHS = np.array([5.0, 10.0, 20.0, 40.0, 100.0, 300.0, 1000.0])
"""Whitened lengths that the prior of an amplitude is a mixture over."""
LENGTH_WEIGHTS = np.array([0.2, 0.2, 0.2, 0.15, 0.12, 0.08, 0.05])
FURTHER_DECADES = 0.6
"""Standard deviation of the size of an amplitude outside its ranges, in decades."""
LEAST_DECADES = 1.5
"""From so far below its ranges on, a smaller amplitude is no less likely."""
ABSURD_DECADES, ABSURD = 1.5, -1e4
"""So far above its ranges an amplitude is absurd: no evidence makes up for it."""
SLACK = 0.2
"""How much of an effect's length its true form may differ from the catalogue's."""
SLACK_FROM = 10.0
"""Whitened length from which that can be seen."""


def plausible_lengths(candidate: Candidate, size: float) -> FloatArray:
    """Logarithm of the weight of each of `LENGTHS`, shape (lengths,).

    `size` is the amplitude that has a whitened length of 1, in the card's unit.
    """
    quantity = candidate.amplitude
    low, high = quantity.of_any_grade
    low = low if low > 0.0 else 1e-3 * high
    decades = np.log10(LENGTHS * size)
    above = np.maximum(decades - np.log10(high), 0.0)
    # A gyro may well have less of it than is usual.
    below = np.minimum(np.maximum(np.log10(low) - decades, 0.0), LEAST_DECADES)
    weights = np.log(LENGTH_WEIGHTS) - 0.5 * ((above + below) / FURTHER_DECADES) ** 2
    return np.where(above > ABSURD_DECADES, weights + ABSURD, weights)
