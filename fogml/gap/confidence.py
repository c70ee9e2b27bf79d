"""Probabilities that hold: the evidence mapped to how often such findings are right.

Evidence takes the forms of effects and of noise for known. How often a finding is right that has a
given margin, needs so much of another form and leaves so much beside it was fitted on spent cases of the
check on withheld effects, 1,537 findings in some 2,100 cases, with
``python -m experiments.gap_blind.calibrate DIR --beside 0.4``, and rounded; the unknown's on those of the
mix alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

SMALL_MARGIN, LARGEST_MARGIN = 4.0, 30.0
LEAST_MARGIN = -3.0
SMALL_LENGTH = 5.0
MOST_OUTSIDE = 2
FIRST_NAME = 1.0
"""Least margin of an effect that nothing else is named beside [nats]: a false name costs more than none."""
BESIDE = 0.7
"""Least probability of a name beside a more certain one or an unknown, whose form it may make up for."""
MOSTLY_FORM = 0.5
"""Share of a gain that needs another form beyond which it is not the effect's."""
UNSURE = 0.49
"""Largest probability of an effect that is not named for another reason."""
LARGEST_LOG_ODDS = 12.0
NAMED = (1.0, 0.74, 0.08, -0.6, -1.5, -0.64, -1.1, -0.36)
"""Logistic constants of a class's probability: constant, then one for each of `Support.features`."""
UNKNOWN = (0.7, 0.6, -1.2)
"""Logistic constants of the unknown's probability: constant, the log odds of the evidence, each name.

An unknown beside effects that are named is rarer than one that acts alone.
"""


@dataclass(frozen=True)
class Support:
    """What stands behind a finding, and its probability follows.

    Attributes
    ----------
    margin
        Evidence that is lost without its class [nats].
    form_share
        Share of the gain that needs other forms than the catalogue's.
    rest
        Whitened length of the unknown beside it over its own.
    length
        Its whitened length on the runs: of a large effect as many nats hang on details of its form.
    outside
        How many of its shape parameters were fitted outside of their usual ranges.
    second
        Whether one beside it is more certain.
    """

    margin: float = 0.0
    form_share: float = 0.0
    rest: float = 0.0
    length: float = 0.0
    outside: int = 0
    second: bool = False

    @property
    def features(self) -> tuple[float, ...]:
        """What the logistic constants `NAMED` go with, but for the first."""
        return (
            min(max(self.margin, LEAST_MARGIN), SMALL_MARGIN),
            max(min(self.margin, LARGEST_MARGIN) - SMALL_MARGIN, 0.0),
            min(max(self.form_share, 0.0), 1.0),
            math.log1p(min(self.rest, 20.0)),
            math.log(max(self.length, SMALL_LENGTH) / SMALL_LENGTH),
            float(min(self.outside, MOST_OUTSIDE)),
            float(self.second),
        )


def named_probability(support: Support, *, alone: bool = False) -> float:
    """Probability that a class is right.

    The first name at all, that of an effect `alone`, has to be `FIRST_NAME` more probable than none, one
    beside others as probable as `BESIDE`; and no name is given for a gain that is `MOSTLY_FORM`.
    """
    probability = _logistic(NAMED, support.features)
    unsure = (
        (alone and support.margin < FIRST_NAME)
        or ((support.second or support.rest > 0.0) and probability < BESIDE)
        or support.form_share > MOSTLY_FORM
    )
    return min(probability, UNSURE) if unsure else probability


def unknown_probability(log_odds: float, names: int) -> float:
    """Probability of an unknown that has these odds by the evidence, beside so many names."""
    return _logistic(UNKNOWN, unknown_features(log_odds, names))


def unknown_features(log_odds: float, names: int) -> tuple[float, float]:
    """What the logistic constants `UNKNOWN` go with, but for the first."""
    return min(max(log_odds, -LARGEST_LOG_ODDS), LARGEST_LOG_ODDS), float(names)


def _logistic(constants: Sequence[float], features: Sequence[float]) -> float:
    x = constants[0] + sum(c * f for c, f in zip(constants[1:], features))
    return 1.0 / (1.0 + math.exp(-x))
