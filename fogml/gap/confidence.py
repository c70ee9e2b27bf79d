"""Probabilities that hold: the evidence mapped to how often such findings are right.

Evidence takes the forms of effects and of noise for known. How often a finding of a given margin is
right was fitted on a development suite of the check on withheld effects, by
``python -m experiments.gap_blind.calibrate DIR``.
"""

from __future__ import annotations

import math

NAMED = (0.1, 0.16)
"""Logistic constants of a class's probability over the margin of its evidence [nats]."""
UNKNOWN = (-0.6, 0.3)
"""Logistic constants of the unknown's probability over the log odds of the evidence."""
LARGEST_MARGIN, LARGEST_LOG_ODDS = 30.0, 12.0


def named_probability(margin: float) -> float:
    """Probability that a class is right whose loss costs `margin` nats."""
    constant, slope = NAMED
    return _logistic(constant + slope * min(max(margin, -LARGEST_MARGIN), LARGEST_MARGIN))


def unknown_probability(log_odds: float) -> float:
    """Probability of an unknown that has these odds by the evidence."""
    constant, slope = UNKNOWN
    return _logistic(constant + slope * min(max(log_odds, -LARGEST_LOG_ODDS), LARGEST_LOG_ODDS))


def _logistic(x: float) -> float:
    return 1.0 / (1.0 + math.exp(-x))
