"""What acts, how surely: causes of the likeliest set, their classes, and whether they carry over."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from fogml.arrays import FloatArray
from fogml.gap.inference import Inference
from fogml.gap.linear_gaussian import Posterior, left_out_log_density
from fogml.gap.result import NAMED, Found, Unknown
from fogml.gap.search import Explanation, Member


@dataclass(frozen=True)
class Cause:
    """A cause of the likeliest set.

    Attributes
    ----------
    members
        Its family's, with nodes and sizes, the largest first.
    ids
        Effects that these runs don't tell from it, itself first.
    evidence
        Probability that one of them acts, by the evidence alone.
    carried
        What it adds to the log density of each run given the others, over the best set without it [nats].
    known
        That it, or another known cause in its place, acts, by the evidence alone.
    log_share
        Logarithm of its share of what all causes of the set make, by energy.
    left_out
        Effects that were taken off the candidates and look like it.
    probability
        That one of them acts, as far as evidence is trusted, at the cost of a false name.
    """

    members: tuple[Member, ...]
    ids: tuple[str, ...]
    evidence: float
    carried: float
    known: float
    log_share: float
    left_out: tuple[str, ...]
    probability: float = 0.0

    @property
    def member(self) -> Member:
        """The one that stands for it."""
        return self.members[0]

    @property
    def odds(self) -> float:
        """Logarithm of the odds that a known cause acts in its place, against something unknown or nothing.

        Less what the runs foretell each other worse with it.
        """
        return _log_odds(self.known) + min(self.carried, 0.0)

    @property
    def within(self) -> float:
        """Logarithm of its odds against other known causes in its place."""
        return _log_odds(self.evidence / max(self.known, self.evidence, 1e-300))


@dataclass(frozen=True)
class Judgement:
    """The causes, most certain first, and the probabilities that nothing, or something unknown, acts."""

    best: Explanation
    causes: tuple[Cause, ...]
    nothing: float
    unknown: float
    explanations: tuple[Explanation, ...]
    weights: FloatArray

    @property
    def named(self) -> tuple[Cause, ...]:
        """Those that are surer than not."""
        return tuple(cause for cause in self.causes if cause.probability >= NAMED)

    def weight_of(self, family: int) -> float:
        """Posterior probability of the sets that hold a family."""
        return float(sum(w for e, w in zip(self.explanations, self.weights) if family in e.key))


def judge(found: Inference, cost_of_false_name: float = 1.0) -> Judgement:
    """Causes of the likeliest set with their classes, at a cost of a false name over a missed one.

    The odds of a cause are those of all sets that hold a member of its class; where runs foretell each other
    worse with it than with the best of what is unknown in its place, less so. Forms are never quite known, so
    that all odds count less, and those of a small cause beside a large one least (`Priors.believed`).
    """
    families, priors, search = found.columns.families, found.setting.priors, found.search
    first = sorted(found.with_others(found.explanations), key=lambda e: -e.score)
    best = _likeliest(found, first)
    exchanges = [e for f in search.names(best) for e in search.exchanged(best, f).values()]
    explanations = _with_more(first, found.with_others(exchanges))
    likeliest = _likeliest(found, explanations)
    # What stands in for names may turn out likelier than they: then what that has is asked.
    for _ in range(2):
        best = likeliest
        alike = {f: _alike(found, explanations, best, f) for f in search.names(best)}
        instead = {f: search.unexplained(best, set(alike[f])) for f in alike}
        more = [e for sets in instead.values() for e in sets]
        explanations = _with_more(explanations, found.with_others(more))
        likeliest = _likeliest(found, explanations)
        if search.names(likeliest) >= search.names(best):
            break
    weights, energies = _weights(explanations), _energies(found, best)
    causes = []
    for f, members in alike.items():
        held = min(float(sum(w for e, w in zip(explanations, weights) if set(members) & set(e.key))), 1.0)
        near = [e for e in instead[f] if e.score > instead[f][0].score - priors.exchange]
        carried = carries(found, best) - max(carries(found, e) for e in near)
        own = sorted((m for m in best.members if m.family == f), key=lambda m: -m.size)
        rest = search.names(best) - {f}
        known = float(sum(w for e, w in zip(explanations, weights) if search.names(e) - rest))
        cause = Cause(
            tuple(own),
            tuple(families[g].id for g in members),
            evidence=held,
            carried=carried,
            known=max(known, held),
            log_share=math.log(max(energies[f], 1e-12) / max(sum(energies.values()), 1e-12)),
            left_out=_left_out(found, best, f),
        )
        believed = priors.believed(cause.odds, cause.within, log_share=cause.log_share)
        causes.append(replace(cause, probability=at_cost(believed, cost_of_false_name)))
    causes.sort(key=lambda c: -c.probability)

    def weight(counts: Callable[[Explanation], bool]) -> float:
        return min(float(sum(w for e, w in zip(explanations, weights) if counts(e))), 1.0)

    known_share = 1.0 - weight(lambda e: any(families[f].kind == "unknown" for f in e.key))
    for cause in causes:
        known_share *= 1.0 - max(cause.known - priors.believed(cause.odds, log_share=cause.log_share), 0.0)
    nothing = weight(lambda e: all(families[f].kind == "plant" for f in e.key))
    # Sums of weights end beside 0 and 1 by rounding.
    unknown = float(np.clip(1.0 - known_share, 0.0, 1.0))
    return Judgement(best, tuple(causes), nothing, unknown, explanations, weights)


def _weights(explanations: Sequence[Explanation]) -> FloatArray:
    """Posterior of the sets, shape (n,)."""
    return np.asarray(softmax([e.score for e in explanations]))


def _energies(found: Inference, explanation: Explanation) -> dict[int, float]:
    """Squares of the whitened lengths, beside what is fixed, of what each family makes; no plant's."""
    held = found.field
    mean = Posterior.of(held.design(explanation.members), held.base.data).mean
    made: dict[int, float] = {}
    for m, course in zip(explanation.members, held.courses(explanation.members, mean)):
        if found.kind(m) != "plant":
            left = float(held.base.gram(course[:, None])[0, 0])
            made[m.family] = made.get(m.family, 0.0) + max(left, 0.0)
    return made


def _likeliest(found: Inference, explanations: Sequence[Explanation]) -> Explanation:
    """The likeliest set with as many names as more sets have than not.

    Where what acts is one of several that these runs don't tell apart, each set with a name may be less
    likely than one without, and all of them together more.
    """
    counts = np.array([len(found.search.names(e)) for e in explanations])
    weights = _weights(explanations)
    most = max((k for k in set(counts.tolist()) if weights[counts >= k].sum() >= 0.5), default=0)
    return next(e for e, k in zip(explanations, counts) if k >= min(max(most, counts[0]), counts.max()))


def _alike(
    found: Inference, explanations: Sequence[Explanation], best: Explanation, family: int
) -> list[int]:
    """Families that one of the likeliest set may be exchanged for at a low cost; itself first."""
    families = found.columns.families
    rest = frozenset(best.key) - {family}
    by_set: dict[frozenset[int], float] = {}
    for e in explanations:
        by_set.setdefault(frozenset(e.key), e.score)
    near = [
        (score, next(iter(held - rest)))
        for held, score in by_set.items()
        if held > rest and len(held) == len(rest) + 1 and score > best.score - found.setting.priors.exchange
    ]
    others = [f for _, f in sorted(near, reverse=True) if f != family and families[f].kind == "known"]
    return [family, *others]


def _left_out(found: Inference, best: Explanation, family: int) -> tuple[str, ...]:
    """Effects that are no candidates, and that these runs don't tell from one of the likeliest set."""
    search = found.search
    others = search.instead(best, family, search.families_of("left_out"))
    asked = best.log_prior + best.log_evidence - found.setting.priors.exchange
    near = [f for f, e in others.items() if e.log_prior + e.log_evidence > asked]
    return tuple(found.columns.families[f].id for f in near)


def carries(found: Inference, explanation: Explanation) -> float:
    """Sum over runs of the log density of each given the others; over halves of a single one."""
    held = found.field
    spans = list(found.setting.spans)
    if len(spans) == 1:
        middle = spans[0].stop // 2
        spans = [slice(0, middle), slice(middle, spans[0].stop)]
    return left_out_log_density(held.design(explanation.members), held.base.data, spans)


def _with_more(explanations: Sequence[Explanation], more: Sequence[Explanation]) -> tuple[Explanation, ...]:
    """With explanations that are known at one noise: as far ahead at every one; the likeliest first.

    Of a set that is there already the evidence over all noises stays, unless its members are better chosen.
    """
    best = explanations[0]
    have = {e.key: e for e in explanations}
    for e in more:
        if e.key not in have or e.log_evidence > have[e.key].log_evidence + 1e-6:
            ahead = e.log_evidence - best.log_evidence
            have[e.key] = replace(e, by_noise=tuple(x + ahead for x in best.by_noise))
    return tuple(sorted(have.values(), key=lambda e: -e.score))


def _log_odds(probability: float) -> float:
    clipped = min(max(probability, 1e-12), 1.0 - 1e-12)
    return math.log(clipped / (1.0 - clipped))


def at_cost(probability: float, cost_of_false_name: float) -> float:
    """A probability said so that a half stands for odds of the cost of a false name over a missed one's."""
    return probability / (probability + cost_of_false_name * (1.0 - probability))


def doubted(unknown: Unknown, found: Sequence[Found]) -> Unknown:
    """The unknown, at least as probable as that a left-out look-alike acts in the place of a named effect.

    All look-alikes count as likely as each member of the class: these runs can't say which it is.
    """
    shares = [f.probability * len(f.left_out) / len({*f.members, *f.left_out}) for f in found if f.left_out]
    if not shares:
        return unknown
    doubt = 1.0 - math.prod(1.0 - share for share in shares)
    names = ", ".join(dict.fromkeys(id for f in found for id in f.left_out))
    words = f"may be {names}, left out of the candidates, in place of what is named"
    if unknown.probability > doubt and unknown.looks_like:
        words = f"{unknown.looks_like}; {words}"
    return replace(unknown, probability=1.0 - (1.0 - unknown.probability) * (1.0 - doubt), looks_like=words)
