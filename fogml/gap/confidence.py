"""Probabilities that hold: the evidence mapped to how often such findings are right.

Evidence takes the forms of effects and of noise for known. How often a finding is right that has a
given margin, needs so much of another form and leaves so much beside it was fitted on a development
suite of the check on withheld effects, by ``python -m experiments.gap_blind.calibrate DIR``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SMALL_MARGIN, LARGEST_MARGIN = 4.0, 30.0
LEAST_MARGIN = -3.0
SMALL_LENGTH = 5.0
FIRST_NAME = 1.5
"""Least margin of an effect that nothing else is named beside [nats]: a false name costs more than none."""
MOSTLY_FORM = 0.5
"""Share of a gain that needs another form beyond which it is not the effect's."""
UNSURE = 0.49
"""Largest probability of an effect that is not named for another reason."""
LARGEST_LOG_ODDS = 12.0
NAMED = (0.75, 0.5, 0.2, -0.75, -0.85, -0.53)
"""Logistic constants of a class's probability: constant, then one for each of `named_features`."""
UNKNOWN = (-0.37, 0.42)
"""Logistic constants of the unknown's probability over the log odds of the evidence."""


def named_features(margin: float, form_share: float, rest: float, length: float) -> tuple[float, ...]:
    """What a finding's probability follows.

    Parameters
    ----------
    margin
        Evidence that is lost without its class [nats].
    form_share
        Share of the gain that needs other forms than the catalogue's.
    rest
        Length of what acts beside it over its own.
    length
        Its whitened length: of a large effect as many nats hang on details of its form.
    """
    return (
        min(max(margin, LEAST_MARGIN), SMALL_MARGIN),
        max(min(margin, LARGEST_MARGIN) - SMALL_MARGIN, 0.0),
        min(max(form_share, 0.0), 1.0),
        math.log1p(min(rest, 20.0)),
        math.log(max(length, SMALL_LENGTH) / SMALL_LENGTH),
    )


def named_probability(
    margin: float, form_share: float = 0.0, rest: float = 0.0, length: float = 0.0, *, alone: bool = False
) -> float:
    """Probability that a class is right; for the parameters see `named_features`.

    The first name at all, that of an effect `alone`, has to be `FIRST_NAME` more probable than none; and
    no name is given for a gain that is `MOSTLY_FORM`.
    """
    probability = _logistic(NAMED, named_features(margin, form_share, rest, length))
    unsure = (alone and margin < FIRST_NAME) or form_share > MOSTLY_FORM
    return min(probability, UNSURE) if unsure else probability


def unknown_probability(log_odds: float) -> float:
    """Probability of an unknown that has these odds by the evidence."""
    return _logistic(UNKNOWN, (min(max(log_odds, -LARGEST_LOG_ODDS), LARGEST_LOG_ODDS),))


def _logistic(constants: Sequence[float], features: Sequence[float]) -> float:
    x = constants[0] + sum(c * f for c, f in zip(constants[1:], features))
    return 1.0 / (1.0 + math.exp(-x))
