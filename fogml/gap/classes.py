"""Effects that the runs can't tell from each other, and the probabilities of what was found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from fogml.gap.confidence import UNSURE, Support, named_probability, unknown_probability
from fogml.gap.evidence import log_sum_exp
from fogml.gap.explanation import Chosen, Explanation
from fogml.gap.result import NAMED
from fogml.gap.search import Search
from fogml.gap.unknown_noise import UnevenNoise, uneven_noise

SAME_CLASS_NATS = 3.0
FORM_SHARE = 0.01
"""Share of an effect's gain that may hang on details of its form."""
UNEVEN = 0.03
"""Prior probability of an unknown in the noise."""
LEAST_MARGIN = -1.5
"""Effects whose evidence has a smaller margin [nats] are not listed."""


@dataclass(frozen=True)
class Ranked:
    """An effect of the best explanation, or one that competes with it.

    Attributes
    ----------
    chosen
        At its best.
    members
        Ids of its class, itself first.
    probability
        That a member of the class acts, by the evidence.
    support
        What that follows.
    unrealised
        Gain that its own form, as fitted, does not bring, which the margin is less by [nats].
    """

    chosen: Chosen
    members: tuple[str, ...]
    probability: float
    support: Support
    unrealised: float = 0.0

    @property
    def margin(self) -> float:
        """How much the evidence falls without the class [nats]."""
        return self.support.margin


@dataclass(frozen=True)
class Ranking:
    """What the evidence says.

    Attributes
    ----------
    best
        The most probable explanation.
    effects
        Effects with some probability, the most certain first.
    unknown
        Probability that something unknown acts, by the evidence.
    log_odds
        Those of the unknown, before calibration.
    noise
        What is uneven in the noise.
    nothing
        Probability that neither an effect nor an unknown acts, by the evidence.
    """

    best: Explanation
    effects: tuple[Ranked, ...]
    unknown: float
    log_odds: float
    noise: UnevenNoise
    nothing: float

    @property
    def named(self) -> frozenset[str]:
        """Ids of the best explanation's effects that are named."""
        return self.best.ids & {r.chosen.candidate for r in self.effects if r.probability >= NAMED}


def rank(
    search: Search,
    explanations: Sequence[Explanation],
    tension: float = -math.inf,
    rivals: Sequence[Explanation] = (),
) -> Ranking:
    """Classes and probabilities.

    Parameters
    ----------
    search
        For swapping one effect for another.
    explanations
        What was tried, the most probable first.
    tension
        Evidence for an unknown that was taken for noise [nats]; see `fogml.gap.noise.tension`.
    rivals
        Explanations under other noise, on the same scale.
    """
    best = _leading(explanations)
    classes = {c.candidate: _members(search, best, c.candidate, rivals) for c in best.effects}
    taken = frozenset(id for members in classes.values() for id in members)
    whole = _merged(explanations, rivals)
    weights = _weights(whole)
    unknown = float(sum(w for e, w in zip(whole, weights) if e.unknown is not None))
    noise = uneven_noise(search, best)
    uneven = expit(float(np.logaddexp(noise.gain, tension)) + math.log(UNEVEN / (1.0 - UNEVEN)))
    unknown = float(1.0 - (1.0 - min(unknown, 1.0)) * (1.0 - uneven))
    ranked = [
        _ranked(search, best, chosen, classes[chosen.candidate], taken, whole) for chosen in best.effects
    ]
    for id in sorted({i for e in explanations[:60] for i in e.ids} - taken):
        with_it = next(e for e in explanations if id in e.ids)
        chosen = next(c for c in with_it.effects if c.candidate == id)
        other = _ranked(search, with_it, chosen, (id,), with_it.ids, whole)
        # Named is what the best explanation holds, and what is fitted.
        other = replace(other, probability=min(other.probability, UNSURE))
        if other.margin >= LEAST_MARGIN:
            ranked.append(other)
    ranked.sort(key=lambda r: -r.probability)
    log_odds = math.log(max(unknown, 1e-12)) - math.log(max(1.0 - unknown, 1e-12))
    nothing = float(sum(w for e, w in zip(whole, weights) if not e.ids and e.unknown is None))
    names = sum(r.probability >= NAMED for r in ranked)
    return Ranking(best, tuple(ranked), unknown_probability(log_odds, names), log_odds, noise, nothing)


def _leading(explanations: Sequence[Explanation]) -> Explanation:
    """The best explanation of those that are the most probable together.

    Together are those with an unknown, or without one, that differ by one effect that takes another's place
    at less than `SAME_CLASS_NATS`, or by nothing but the form of their effects.
    """
    near = [e for e in explanations if e.log_posterior > explanations[0].log_posterior - SAME_CLASS_NATS]

    def together(e: Explanation) -> float:
        held = (
            x.log_posterior
            for x in explanations
            if len(x.ids) == len(e.ids)
            and len(x.ids - e.ids) <= 1
            and (x.unknown is None) == (e.unknown is None)
            and 0.0 <= e.log_posterior - x.log_posterior < SAME_CLASS_NATS
        )
        return log_sum_exp(np.fromiter(held, np.float64))

    return max(near, key=together)


def _merged(explanations: Sequence[Explanation], rivals: Sequence[Explanation]) -> list[Explanation]:
    """Each set of effects and rest once, under the noise that it is the most probable with."""
    held: dict[tuple[frozenset[str], str], Explanation] = {}
    for e in (*explanations, *rivals):
        key = (e.ids, e.rest)
        if key not in held or e.log_posterior > held[key].log_posterior:
            held[key] = e
    return list(held.values())


def _weights(explanations: Sequence[Explanation]) -> np.ndarray:
    logs = np.array([e.log_posterior for e in explanations])
    return np.asarray(np.exp(logs - log_sum_exp(logs)))


def _members(search: Search, best: Explanation, id: str, rivals: Sequence[Explanation]) -> tuple[str, ...]:
    """The effect and those that take its place at less than `SAME_CLASS_NATS` of evidence."""
    others = tuple(c for c in best.effects if c.candidate != id)
    held = search.field_.condition(search.beside(best, id))
    gains = held.node_gains()
    members = {id: best.log_evidence}
    # No form is known to the last per cent: of a large effect more nats hang on that.
    nats = SAME_CLASS_NATS + FORM_SHARE * max(log_sum_exp(gains[search.places[id]]), 0.0)
    for other in search.places:
        if other in best.ids:
            continue
        # A quick look first: with the others held, a swap only gets better by a few nats.
        quick = log_sum_exp(gains[search.places[other]]) - log_sum_exp(gains[search.places[id]])
        if quick < -nats - 3.0:
            continue
        swapped = search.explanation((*others, search.best_node(other, held)), best.rest)
        if swapped.log_evidence > best.log_evidence - nats:
            members[other] = swapped.log_evidence
    # One that takes the place with something else beside it, or under other noise, is no less likely to act;
    # unless what is beside it takes the place alone.
    pool, kept = _merged(search.tried, rivals), best.ids - {id}
    alone = {e.rest: e.log_posterior for e in pool if e.ids == kept}
    for tried in pool:
        news, behind = tried.ids - best.ids, best.log_posterior - tried.log_posterior
        swaps = len(news) == 1 and tried.ids - news == kept
        if swaps and behind < nats and tried.log_posterior > alone.get(tried.rest, -math.inf):
            other = min(news)
            members[other] = max(members.get(other, -math.inf), best.log_evidence - behind)
    rest = sorted((m for m in members if m != id), key=lambda m: -members[m])
    return (id, *rest)


def _ranked(
    search: Search,
    held: Explanation,
    chosen: Chosen,
    members: tuple[str, ...],
    together: frozenset[str],
    explanations: Sequence[Explanation],
) -> Ranked:
    """An effect of an explanation, whose effects or their classes are `together`."""
    inside = np.array([bool(e.ids & set(members)) for e in explanations])
    logs = np.array([e.log_posterior for e in explanations])
    with_it, without = logs[inside], logs[~inside]
    margin = float(with_it.max() - without.max(initial=-math.inf))
    if len(without):
        # The smaller of the two: many weak sets without the class may outweigh the best of them, and many
        # unlike members that do as well say that none of them is it.
        margin = min(margin, log_sum_exp(with_it) - log_sum_exp(without))
    unknown = [e.log_posterior for e in explanations if e.unknown is not None and not e.ids & together]
    joint = max(margin, held.log_posterior - max(unknown)) if unknown else margin
    # What each part of the explanation most probably makes.
    lengths = search.lengths(held)
    own = lengths[chosen.candidate]
    beside = lengths[held.unknown[0]] if held.unknown is not None else 0.0
    support = Support(
        margin,
        search.form_share(held),
        rest=beside / own if own > 0.0 else 0.0,
        length=own,
        joint=joint,
        others=max((lengths[id] for id in held.ids if id != chosen.candidate), default=0.0),
    )
    return Ranked(chosen, members, named_probability(support), support)
