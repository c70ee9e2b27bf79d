"""What acts, how surely: causes of the likeliest set, their classes, and whether they carry over."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fogml.gap.families.inference import Inference
from fogml.gap.families.linear_gaussian import left_out_log_density
from fogml.gap.families.search import Explanation, Member
from fogml.runs.run import FloatArray


@dataclass(frozen=True)
class Cause:
    """A cause of the likeliest set.

    Attributes
    ----------
    member
        Its family, node and size.
    ids
        Effects that these runs don't tell from it, itself first.
    probability
        That one of them acts, doubt and carrying over in it.
    evidence
        The same by the evidence alone.
    carried
        What it adds to the log density of each run given the others, over the best set without it [nats].
    """

    member: Member
    ids: tuple[str, ...]
    probability: float
    evidence: float
    carried: float


@dataclass(frozen=True)
class Judgement:
    """The causes, most certain first, and the probabilities that nothing, or something unknown, acts."""

    best: Explanation
    causes: tuple[Cause, ...]
    nothing: float
    unknown: float
    explanations: tuple[Explanation, ...]
    weights: FloatArray


def judge(found: Inference) -> Judgement:
    """Causes of the likeliest set with their classes.

    The odds of a cause are those of all sets that hold a member of its class, or those by which it helps to
    foretell each run from the others where these are lower, over the prior's doubt.
    """
    families, priors = found.columns.families, found.setting.priors
    best = found.explanations[0]
    known = [m for m in best.members if families[m.family].kind == "known"]
    exchanges = {m: found.search.exchanged(best, m) for m in known}
    explanations = _with_exchanges(found, exchanges)
    best = explanations[0]
    scores = np.array([e.score for e in explanations])
    weights = np.exp(scores - scores.max())
    weights /= weights.sum()
    by_key = {e.key: e.score for e in explanations}
    causes = []
    for member in best.members:
        if families[member.family].kind != "known":
            continue
        rest = [m.family for m in best.members if m is not member]
        alike = [
            (by_key[key], f)
            for f in range(len(families))
            if families[f].kind == "known"
            and f not in rest
            and (key := tuple(sorted([*rest, f]))) in by_key
            and by_key[key] > best.score - priors.exchange
        ]
        members = {f for _, f in alike} | {member.family}
        held = float(sum(w for e, w in zip(explanations, weights) if members & set(e.key)))
        carried = carries(found, best) - carries(found, found.search.unexplained(best, member))
        odds = min(_log_odds(held), max(carried, 0.0)) - math.log(priors.doubt)
        order = [families[f].id for _, f in sorted(alike, reverse=True) if f != member.family]
        causes.append(
            Cause(
                member,
                tuple(dict.fromkeys([families[member.family].id, *order])),
                1.0 / (1.0 + math.exp(-odds)),
                held,
                carried,
            )
        )
    causes.sort(key=lambda c: -c.probability)
    unknown = float(
        sum(
            w
            for e, w in zip(explanations, weights)
            if any(families[m.family].kind == "unknown" for m in e.members)
        )
    )
    known_share = 1.0 - unknown
    for cause in causes:
        lost = cause.evidence - 1.0 / (
            1.0 + math.exp(-min(_log_odds(cause.evidence), max(cause.carried, 0.0)))
        )
        known_share *= 1.0 - max(lost, 0.0)
    nothing = float(
        sum(
            w
            for e, w in zip(explanations, weights)
            if all(families[m.family].kind == "plant" for m in e.members)
        )
    )
    return Judgement(best, _once(causes), nothing, 1.0 - known_share, explanations, weights)


def _once(causes: list[Cause]) -> tuple[Cause, ...]:
    """Causes of which each effect is named by one alone."""
    kept: list[Cause] = []
    for cause in causes:
        if all(cause.ids[0] != other.ids[0] for other in kept):
            kept.append(cause)
    return tuple(kept)


def carries(found: Inference, explanation: Explanation) -> float:
    """Sum over runs of the log density of each given the others; over halves of a single one."""
    held = found.field
    spans = list(found.setting.spans)
    if len(spans) == 1:
        middle = spans[0].stop // 2
        spans = [slice(0, middle), slice(middle, spans[0].stop)]
    return left_out_log_density(held.design(explanation.nodes), held.base.data, spans)


def _with_exchanges(
    found: Inference, exchanges: dict[Member, dict[int, Explanation]]
) -> tuple[Explanation, ...]:
    """All explanations with those of exchanged members: as far ahead at every noise as at the likeliest."""
    have = {e.key for e in found.explanations}
    best = found.explanations[0]
    more: dict[tuple[int, ...], Explanation] = {}
    for by_family in exchanges.values():
        for e in by_family.values():
            if e.key not in have and (e.key not in more or e.score > more[e.key].score):
                more[e.key] = e
    ahead = {key: e.log_evidence - best.log_evidence for key, e in more.items()}
    added = [replace(e, by_noise=tuple(x + ahead[key] for x in best.by_noise)) for key, e in more.items()]
    return tuple(sorted([*found.explanations, *added], key=lambda e: -e.score))


def _log_odds(probability: float) -> float:
    clipped = min(max(probability, 1e-12), 1.0 - 1e-12)
    return math.log(clipped / (1.0 - clipped))
