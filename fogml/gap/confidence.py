"""Probabilities that hold: the evidence mapped to how often such findings are right.

Evidence takes the forms of effects and of noise for known. How often a finding is right that has a
given margin, needs so much of another form and leaves so much beside it was fitted on spent cases of the
check on withheld effects, 1,699 findings in 2,612 cases of seeds 1000013 and 1000014, by the regression of
``experiments.gap_blind.calibrate`` with weight 0.15 beside the mix, and rounded; the unknown's on those of
the mix alone, 1,322 cases. How sure a name has to be was chosen on the same cases, so that a strong unknown
is hardly ever given one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

LEAST_MARGIN, LARGEST_MARGIN = -3.0, 4.0
LARGEST_JOINT = 8.0
SMALL_LENGTH = 5.0
MOST_OUTSIDE = 3
LARGEST_REST = LARGEST_SURPRISE = 20.0
SURE = 0.85
"""Least probability of a name: a false one costs more than none."""
SURE_BESIDE_UNKNOWN = 0.9
"""The same beside an unknown, for whose form a name may make up."""
SURE_BESIDE, OTHERS = 0.75, 4.0
"""The same beside others that are worth so many nats without it: then something known acts for certain."""
MOSTLY_FORM = 0.5
"""Share of a gain that needs another form beyond which it is not the effect's."""
UNSURE = 0.49
"""Largest probability of an effect that is not named."""
LARGEST_LOG_ODDS = 12.0
NAMED = (0.03, 1.04, -0.28, -1.32, -0.32, -0.91, 0.04, -0.25)
"""Logistic constants of a class's probability: constant, then one for each of `Support.features`."""
UNKNOWN = (0.32, 0.5, -0.9)
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
        How many of its shape parameters were fitted outside of their usual ranges; see
        `fogml.gap.realised.shapes_outside`.
    joint
        Evidence that is lost where the unknown takes the place of every effect of its explanation [nats]:
        two together may mimic what neither is.
    surprise
        How much better the best explanation without it does than it would if what was found were true, in
        standard deviations.
    """

    margin: float = 0.0
    form_share: float = 0.0
    rest: float = 0.0
    length: float = 0.0
    outside: int = 0
    joint: float = 0.0
    surprise: float = 0.0

    @property
    def features(self) -> tuple[float, ...]:
        """What the logistic constants `NAMED` go with, but for the first."""
        return (
            min(max(self.margin, LEAST_MARGIN), LARGEST_MARGIN),
            min(max(self.form_share, 0.0), 1.0),
            math.log1p(min(self.rest, LARGEST_REST)),
            math.log(max(self.length, SMALL_LENGTH) / SMALL_LENGTH),
            float(min(self.outside, MOST_OUTSIDE)),
            min(max(self.joint, LEAST_MARGIN), LARGEST_JOINT),
            math.log1p(min(max(self.surprise, 0.0), LARGEST_SURPRISE)),
        )


def likely(support: Support) -> float:
    """Probability that a class is right; at most `UNSURE` for a gain that is `MOSTLY_FORM`."""
    probability = _logistic(NAMED, support.features)
    return min(probability, UNSURE) if support.form_share > MOSTLY_FORM else probability


def named_probability(support: Support) -> float:
    """The same, and at most `UNSURE` where it is not sure enough for a name: then it is suspected."""
    probability = likely(support)
    if support.joint - support.margin >= OTHERS:
        sure = SURE_BESIDE
    else:
        sure = SURE_BESIDE_UNKNOWN if support.rest > 0.0 else SURE
    return probability if probability >= sure else min(probability, UNSURE)


def unknown_probability(log_odds: float, names: int) -> float:
    """Probability of an unknown that has these odds by the evidence, beside so many names."""
    return _logistic(UNKNOWN, unknown_features(log_odds, names))


def unknown_features(log_odds: float, names: int) -> tuple[float, float]:
    """What the logistic constants `UNKNOWN` go with, but for the first."""
    return min(max(log_odds, -LARGEST_LOG_ODDS), LARGEST_LOG_ODDS), float(names)


def _logistic(constants: Sequence[float], features: Sequence[float]) -> float:
    x = constants[0] + sum(c * f for c, f in zip(constants[1:], features))
    return 1.0 / (1.0 + math.exp(-x))
