"""Probabilities that hold: the evidence mapped to how often such findings are right.

Evidence takes the forms of effects and of noise for known. How often a finding is right that has a
given margin, needs so much of another form and stands beside so much else was fitted on spent cases of the
check on withheld effects, the findings in 6,180 cases of seeds 1000015 and 1000016, by the regression of
``experiments.gap_blind.calibrate`` with weight 0.15 beside the mix, and 0.5 for findings beside an unknown,
slopes kept from the wrong sign, and rounded. The marks of these seeds lack `Support.others`: it was taken
from the lengths that the answers list. The unknown's constants were fitted on cases of the mix of seeds
1000013 and 1000014 alone. How sure a name has to be was chosen on the cases that the names were fitted on,
so that a strong unknown is hardly ever given one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

LARGEST_NATS = 60.0
SMALL_LENGTH = 5.0
MOST_OUTSIDE = 3
LARGEST_REST = 20.0
SURE = 0.8
"""Least probability of a name: a false one costs more than none."""
SURE_BESIDE_UNKNOWN = 0.86
"""The same beside an unknown, for whose form a name may make up."""
LEAST_NAMED_MARGIN = 0.5
"""Margin under which nothing is named, however much would be lost with all else [nats]."""
MOSTLY_FORM = 0.5
"""Share of a gain that needs another form beyond which it is not the effect's."""
UNSURE = 0.49
"""Largest probability of an effect that is not named."""
LARGEST_LOG_ODDS = 12.0
NAMED = (-0.44, 1.16, -27.5, -1.25, 0.86, -0.85)
"""Logistic constants of a class's probability where all that acts is known: constant, then one for each of
`Support.features`."""
NAMED_BESIDE_UNKNOWN = (1.06, 1.55, -1.48, -1.23, -1.30, -0.92)
"""The same beside an unknown."""
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
    others
        Largest whitened length of the other effects of its explanation: a small one may be no more than what
        a large one's true form differs by.
    """

    margin: float = 0.0
    form_share: float = 0.0
    rest: float = 0.0
    length: float = 0.0
    outside: int = 0
    joint: float = 0.0
    others: float = 0.0

    @property
    def beside_unknown(self) -> bool:
        """Whether something unknown acts besides in its explanation."""
        return self.rest > 0.0

    @property
    def features(self) -> tuple[float, ...]:
        """What the logistic constants go with, but for the first."""
        margin, others = _log_nats(self.margin), _log_length(self.others)
        outside = float(min(self.outside, MOST_OUTSIDE))
        if self.beside_unknown:
            rest = math.log1p(min(self.rest, LARGEST_REST))
            return margin, rest, outside, _log_length(self.length), others
        form_share = min(max(self.form_share, 0.0), 1.0)
        return margin, form_share, outside, _log_nats(self.joint), others


def _log_nats(nats: float) -> float:
    return math.log1p(min(max(nats, 0.0), LARGEST_NATS))


def _log_length(length: float) -> float:
    return math.log(max(length, SMALL_LENGTH) / SMALL_LENGTH)


def likely(support: Support) -> float:
    """Probability that a class is right; at most `UNSURE` for a gain that is `MOSTLY_FORM`."""
    constants = NAMED_BESIDE_UNKNOWN if support.beside_unknown else NAMED
    probability = _logistic(constants, support.features)
    return min(probability, UNSURE) if support.form_share > MOSTLY_FORM else probability


def named_probability(support: Support) -> float:
    """The same, and at most `UNSURE` where it is not sure enough for a name: then it is suspected."""
    probability = likely(support)
    sure = SURE_BESIDE_UNKNOWN if support.beside_unknown else SURE
    named = probability >= sure and support.margin >= LEAST_NAMED_MARGIN
    return probability if named else min(probability, UNSURE)


def unknown_probability(log_odds: float, names: int) -> float:
    """Probability of an unknown that has these odds by the evidence, beside so many names."""
    return _logistic(UNKNOWN, unknown_features(log_odds, names))


def unknown_features(log_odds: float, names: int) -> tuple[float, float]:
    """What the logistic constants `UNKNOWN` go with, but for the first."""
    return min(max(log_odds, -LARGEST_LOG_ODDS), LARGEST_LOG_ODDS), float(names)


def _logistic(constants: Sequence[float], features: Sequence[float]) -> float:
    x = constants[0] + sum(c * f for c, f in zip(constants[1:], features))
    return 1.0 / (1.0 + math.exp(-x))
