"""Whether a named effect does what the evidence credits it with: its fitted shape against the columns.

Evidence is linear: a shape parameter that the response is in proportion to has a coefficient of its own,
and a large effect has room for another form. Together they may follow what no shape within its limits
makes. What the fitted effect itself does not bring is no evidence for it, but for something unknown;
unless another of its class does bring it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fogml.gap.classes import LEAST_MARGIN, Ranked, Ranking
from fogml.gap.confidence import named_probability
from fogml.gap.evidence import Term
from fogml.gap.fitting import Fit, usable_range
from fogml.gap.found import fit_named
from fogml.gap.model import Candidate, amplitudes_about, drawn_per_run
from fogml.gap.preparing import Prepared
from fogml.gap.search import Search
from fogml.gap.shapes import AT_AMPLITUDE, is_angle

SHAPE_ROOM, LARGEST_ROOM = 0.02, 0.1
"""Shares of its range that a shape parameter may miss it by: whatever its standard error, and within that."""
AT_END = 1e-3
"""Share of its range within which a shape parameter is at the end of where a fit lets it go."""
FORM_SHARE = 0.1
"""Share of an effect's gain that its true form may owe to not being the catalogue's."""


def realised(
    p: Prepared, candidates: Mapping[str, Candidate], search: Search, ranking: Ranking, fit: Fit
) -> Ranking:
    """The ranking with margins of the fitted effects less what their own forms don't bring.

    Effects that had to be fitted with unusual shapes are less probable, too. Of a class that member stands
    first which brings the most. The unknown becomes more probable by what the names become less so.

    Parameters
    ----------
    p
        The runs.
    candidates
        What may be named.
    search, ranking
        The search and its result.
    fit
        The named effects, fitted on the replay.
    """
    ranking, lost, fit = _best_heads(p, candidates, search, ranking, fit)
    outside = {e.id: shapes_outside(candidates[e.id], e.shape, fit.standard_errors) for e in fit.effects}
    effects, known, all_lost = [], 1.0 - ranking.unknown, sum(lost.values())
    for r in ranking.effects:
        id = r.chosen.candidate
        nats = lost.get(id, 0.0)
        support = replace(
            r.support, margin=r.margin - nats, joint=r.support.joint - all_lost, outside=outside.get(id, 0)
        )
        if support == r.support:
            effects.append(r)
            continue
        probability = min(r.probability, named_probability(support))
        known *= 1.0 - (r.probability - probability)
        if support.margin >= LEAST_MARGIN:
            effects.append(replace(r, support=support, probability=probability, unrealised=nats))
    effects.sort(key=lambda r: -r.probability)
    return replace(ranking, effects=tuple(effects), unknown=1.0 - known)


def shapes_outside(
    candidate: Candidate, shape: Mapping[str, float], standard_errors: Mapping[str, float]
) -> int:
    """How many shape parameters lie outside of their usual ranges, of any grade; directions never do.

    Near an end chance decides on which side one lies that the runs hardly tell. One that went as far as a
    fit lets it would go further, and counts twice.
    """
    count = 0
    for quantity in candidate.shape:
        low, high = quantity.of_any_grade
        error = standard_errors.get(f"{candidate.id}.{quantity.name}", 0.0)
        room = (high - low) * min(max(SHAPE_ROOM, error / (high - low)), LARGEST_ROOM)
        value = shape.get(quantity.name, low)
        if is_angle(quantity) or low - room <= value <= high + room:
            continue
        least, most = usable_range(quantity, low, high)
        count += 1 + (min(value - least, most - value) <= AT_END * (high - low))
    return count


def no_more_certain(ranking: Ranking, other: Ranking) -> Ranking:
    """The ranking with no name more probable than in another one, and no unknown less so.

    What was found beside an effect that turned out to be none was found beside the wrong thing.
    """
    known = {m: r.probability for r in reversed(other.effects) for m in r.members}

    def less(r: Ranked) -> Ranked:
        if r.chosen.candidate not in ranking.named:
            return r
        again = max((known[m] for m in r.members if m in known), default=0.0)
        return replace(r, probability=min(r.probability, again))

    effects = sorted((less(r) for r in ranking.effects), key=lambda r: -r.probability)
    return replace(ranking, effects=tuple(effects), unknown=max(ranking.unknown, other.unknown))


def lost_names(before: Ranking, after: Ranking) -> frozenset[str]:
    """Ids of the classes that had a name before and have none after, whichever member is first."""
    kept = _named_classes(after)
    lost = _named_classes(before) - kept
    return frozenset().union(*lost) - frozenset().union(*kept)


def _named_classes(ranking: Ranking) -> set[frozenset[str]]:
    return {frozenset(r.members) for r in ranking.effects if r.chosen.candidate in ranking.named}


def unrealised(
    candidates: Mapping[str, Candidate], search: Search, ranking: Ranking, fit: Fit
) -> dict[str, float]:
    """Evidence that each effect's columns have and its fitted shape has not, `FORM_SHARE` apart [nats].

    Beside everything else of the best explanation; the size of the fitted effect is averaged over.
    """
    field, frame, best = search.field_, search.field_.basis.frame, ranking.best
    lost = {}
    for effect in fit.effects:
        chosen = next((c for c in best.effects if c.candidate == effect.id), None)
        if chosen is None or drawn_per_run(candidates[effect.id]):
            # What each run draws anew has no shape that all share.
            continue
        shape = dict(effect.shape)
        if amplitudes_about(candidates[effect.id]):
            shape[AT_AMPLITUDE] = effect.amplitude
        response = frame.responses(effect.id, [shape])
        length = float(np.linalg.norm(frame.without_constants(response[:, 0])))
        beside = search.beside(best, effect.id)
        nothing = field.condition(beside).log_evidence
        credited = field.condition(search.terms(best)).log_evidence - nothing
        brought = 0.0
        if length > 0.0:
            term = Term(field.append(response / length), chosen.length)
            whole = [*beside, term, *search.parts.within(chosen)]
            brought = field.condition(whole).log_evidence - nothing
        lost[effect.id] = max((1.0 - FORM_SHARE) * credited - brought, 0.0)
    return lost


def _best_heads(
    p: Prepared,
    candidates: Mapping[str, Candidate],
    search: Search,
    ranking: Ranking,
    fit: Fit,
) -> tuple[Ranking, dict[str, float], Fit]:
    """The ranking with that member of each class first which brings the most, what is lost, and its fit."""
    lost = unrealised(candidates, search, ranking, fit)
    paid: dict[str, float] = {}
    for r in ranking.effects:
        id = r.chosen.candidate
        least, before = lost.get(id, 0.0), ranking
        for member in r.members[1:]:
            swapped = _headed_by(search, before, r, member)
            if swapped is None or drawn_per_run(candidates[member]):
                continue
            behind = max(before.best.log_posterior - swapped.best.log_posterior, 0.0)
            if behind >= least:
                continue
            fitted = fit_named(p, candidates, search, swapped)
            found = unrealised(candidates, search, swapped, fitted)
            if behind + found.get(member, 0.0) < least:
                least = behind + found.get(member, 0.0)
                ranking, lost, fit = swapped, found, fitted
                paid = {other: nats for other, nats in paid.items() if other != id} | {member: behind}
    total = {i: lost.get(i, 0.0) + paid.get(i, 0.0) for i in lost.keys() | paid.keys()}
    return ranking, total, fit


def _headed_by(search: Search, ranking: Ranking, ranked: Ranked, member: str) -> Ranking | None:
    """The ranking with another member first of a class; None where it was not tried in its place."""
    ids = (ranking.best.ids - {ranked.chosen.candidate}) | {member}
    tried = next((e for e in search.tried if e.ids == ids and e.rest == ranking.best.rest), None)
    if tried is None:
        return None
    chosen = {c.candidate: c for c in tried.effects}
    head = replace(
        ranked, chosen=chosen[member], members=(member, *(m for m in ranked.members if m != member))
    )
    others = [
        replace(r, chosen=chosen.get(r.chosen.candidate, r.chosen))
        for r in ranking.effects
        if r.chosen.candidate != ranked.chosen.candidate
    ]
    return replace(ranking, best=tried, effects=(head, *others))
